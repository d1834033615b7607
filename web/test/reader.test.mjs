// The page's reader says of every file what Python says, word for word.

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import test from "node:test";

import { scan } from "../src/format/container.js";
import { Findings, FormatError } from "../src/format/issues.js";
import { parse } from "../src/format/json.js";
import { readManifest } from "../src/format/manifest.js";
import { readNpy } from "../src/format/npy.js";
import { inspect } from "../src/format/profile.js";
import { summaryText } from "../src/format/summary.js";
import { layerIssues } from "../src/format/usd_layer.js";
import { examine, networkMember, tooLarge } from "../src/format/validate.js";
import { BrokenNetwork, evaluate } from "../src/network/evaluate.js";
import { bytes, inputsOf, json, largestError, NEEDS, path, unpacked } from "./files.mjs";

const KEPT = 5; // Issues of a long report in the golden reports.
const FEW = 6; // Issues of a damaged input.
// Python's own words differ between its versions, and count a lone surrogate's place otherwise.
const OWN_WORDS = ["PLX_JSON_ENCODING", "PLX_JSON_SYNTAX"];

/** The lines of a golden report. */
function lines({ issues, truncated }) {
  const found = issues.map(({ severity, code, location, message }) =>
    `${severity} ${code} ${location}: ${message}`);
  const more = ` of ${found.length}${truncated ? " and more" : ""}`;
  return found.length > KEPT ? [...found.slice(0, KEPT), found[0].split(":")[0] + more] : found;
}

function reportOf(name) {
  const large = tooLarge(statSync(path("bad", `${name}.plux`)).size);
  return large ? { issues: [large] } : examine(bytes("bad", `${name}.plux`)).findings.report();
}

function comparable(line) {
  const own = OWN_WORDS.some((code) => line.includes(code));
  return own ? line.split(":")[0] : line.replace(/\(error .*\)/, ""); // Rounded otherwise.
}

test("every bad bundle of the repository has the report of purelight-validate", NEEDS, () => {
  const expected = Object.entries(json("expected.json").bad);
  assert.ok(expected.length > 300);
  for (const [name, wanted] of expected) {
    assert.deepEqual(lines(reportOf(name)).map(comparable), wanted.map(comparable), name);
  }
});

test("a lamp is described as purelight-inspect describes it", NEEDS, () => {
  for (const [name, wanted] of Object.entries(json("expected.json").good)) {
    const found = examine(bytes("good", `${name}.plux`));
    assert.deepEqual(found.findings.report().issues, []);
    assert.equal(summaryText(found), wanted);
  }
});

test("the files of the conformance suite: bad ones are refused, good ones are not", NEEDS, () => {
  const { sets, bundles } = json("suite/suite.json");
  const files = sets.filter(({ operation }) => operation === "reader");
  assert.ok(files.length > 50);
  for (const { bundle, refusal, parameters } of files) {
    const { errors } = examine(bytes("suite", bundles[bundle])).findings;
    assert.equal(errors.length > 0, refusal === "required", `${bundle} ${parameters.issue}`);
  }
  for (const file of new Set(Object.values(bundles).filter((name) => name.startsWith("bundles/")))) {
    assert.deepEqual(examine(bytes("suite", file)).findings.errors, [], file);
  }
});

test("networks have the verdict and the cost that Python finds, and the same values", NEEDS, () => {
  const seen = { refused: 0, broken: 0, values: 0 };
  for (const entry of json("networks.json")) {
    let network;
    try {
      network = inspect(unpacked(entry.onnx), "appearance", networkMember("appearance"));
    } catch (error) {
      assert.ok(error instanceof FormatError, `${entry.name}: ${error.stack}`);
      assert.deepEqual([error.issue.code, error.issue.message], [entry.code, entry.message], entry.name);
      seen.refused += 1;
      continue;
    }
    const [macs, floats, nanoseconds] = entry.cost ?? [];
    assert.deepEqual([network.macs, network.floats], [macs, floats], `${entry.name} ${entry.code}`);
    assert.ok(Math.abs(network.nanoseconds - nanoseconds) < 1e-6 * nanoseconds, entry.name);
    assert.deepEqual(network.warnings.map(({ code }) => code), entry.warnings, entry.name);
    if (entry.broken) {
      assert.throws(() => evaluate(network, inputsOf(entry), 7), BrokenNetwork, entry.name);
      seen.broken += 1;
    } else {
      const { radiance } = evaluate(network, inputsOf(entry), 7);
      seen.values += 1;
      assert.ok(!entry.outputs || largestError(radiance, entry) <= 1, entry.name);
    }
  }
  assert.ok(seen.refused > 100 && seen.values > 100, JSON.stringify(seen));
});

/** By fuzz target what is wrong with an input. */
const CHECKS = {
  container: (data) => [...(scan(data), [])],
  json: (data) => [...(parse(data, "test"), [])],
  manifest(data) {
    const findings = new Findings();
    readManifest(data, findings);
    return findings.report().issues;
  },
  npy: (data) => [...(readNpy(data, "test", "<f4"), [])],
  onnx_bytes(data, { models }) {
    const name = models[data[0]];
    return inspect(data.subarray(1), name, networkMember(name)).warnings;
  },
  layer: (data, { layer, members }) => [...layerIssues(() => data, members, undefined, layer)],
  bundle: (data) => examine(data).findings.report().issues,
};
CHECKS.onnx_graph = CHECKS.onnx_bytes;

test("damaged inputs of the fuzz targets have the issues that Python finds", NEEDS, () => {
  const about = json("damage.json");
  for (const [target, inputs] of Object.entries(about.targets)) {
    let refused = 0;
    for (const [k, { data, issues }] of inputs.entries()) {
      let found;
      try {
        found = CHECKS[target](unpacked(data), about);
      } catch (error) {
        assert.ok(error instanceof FormatError, `${target} ${k}: ${error.stack}`);
        found = [error.issue];
      }
      const text = found.slice(0, FEW).map((i) => `${i.code} ${i.location}: ${i.message}`);
      assert.deepEqual(text.map(comparable), issues.map(comparable), `${target} ${k}`);
      refused += issues.length ? 1 : 0;
    }
    assert.ok(refused > 0 && refused < inputs.length, `${target}: ${refused} of ${inputs.length}`);
  }
});
