// The networks in plain JavaScript against ONNX Runtime, on what nobody made for this page.

import assert from "node:assert/strict";
import test from "node:test";

import * as ort from "onnxruntime-web";

import { examine, networkMember } from "../src/format/validate.js";
import { inspect } from "../src/format/profile.js";
import { KINDS } from "../src/format/tables.js";
import { compare } from "../src/format/vectors.js";
import { evaluate } from "../src/network/evaluate.js";
import { bytes, inputsOf, json, NEEDS, unpacked } from "./files.mjs";

const ROWS = 7;
ort.env.wasm.numThreads = 1;
ort.env.logLevel = "fatal";

async function run(model, network, inputs, count) {
  const session = await ort.InferenceSession.create(model, { logSeverityLevel: 3 });
  const { inputs: shapes } = KINDS[network];
  const feeds = Object.fromEntries(Object.entries(inputs).map(([name, data]) => [
    name, new ort.Tensor("float32", Float32Array.from(data), [count, ...shapes[name]]),
  ]));
  const results = await session.run(feeds);
  return Object.fromEntries(Object.entries(results).map(([name, { data }]) => [name, data]));
}

test("operators and drawn networks give what ONNX Runtime gives", NEEDS, async () => {
  let compared = 0;
  for (const entry of json("networks.json").filter(({ outputs }) => outputs)) {
    const model = unpacked(entry.onnx);
    const network = inspect(model, "appearance", networkMember("appearance"));
    const inputs = inputsOf(entry);
    const { radiance: ours } = evaluate(network, inputs, ROWS);
    const { radiance: theirs } = await run(model, "appearance", inputs, ROWS);
    ours.forEach((value, k) => {
      const error = Math.abs(value - theirs[k]);
      assert.ok(error <= 1e-3 + 1e-3 * Math.abs(theirs[k]), `${entry.name}: ${value}, ${theirs[k]}`);
    });
    compared += 1;
  }
  assert.ok(compared > 100);
});

test("the lamps' networks meet their golden vectors by either", NEEDS, async () => {
  for (const lamp of ["octahedron", "globe", "lantern"]) {
    const found = examine(bytes("good", `${lamp}.plux`));
    for (const [name, vectors] of found.vectors) {
      const model = Uint8Array.from(found.read(networkMember(name)));
      const theirs = await run(model, name, vectors.inputs, vectors.count);
      const ours = evaluate(found.networks.get(name), vectors.inputs, vectors.count);
      assert.ok(compare(vectors, theirs).worst <= 1, `${lamp} ${name}, ONNX Runtime`);
      assert.ok(compare(vectors, ours).worst <= 1, `${lamp} ${name}, JavaScript`);
    }
  }
});
