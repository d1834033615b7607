// Validation of a bundle: bytes in, report out, cheap stages first; what `purelight-validate` does.

import { asciiText, digest, startsWith, view } from "./bytes.js";
import { member, scan } from "./container.js";
import { FINISH_MEMBER } from "./finishes.js";
import { fail, Findings, FormatError, issue } from "./issues.js";
import { MANIFEST, readManifest } from "./manifest.js";
import { inspect } from "./profile.js";
import { readSurface, SURFACE_MEMBERS, surfaceIssues } from "./surface.js";
import { KINDS, LIMITS, TIERS } from "./tables.js";
import { tierFault } from "./tiers.js";
import { layerIssues } from "./usd_layer.js";
import { compare, doubts, largestError, layout, readVectors } from "./vectors.js";
import { isVerdict } from "./verdict.js";
import { BrokenNetwork, evaluate } from "../network/evaluate.js";

const PREVIEW = "preview.png";
const PHOTOMETRY = "photometry.ies";
const EXTENSIONS = "extensions/";
const PNG = Uint8Array.from([137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82]);
const PNG_HEAD = 29;

/** Where the ONNX bytes of a network lie. */
export function networkMember(name) {
  return `networks/${name}.onnx`;
}

/** A file under examination: what the stages so far have found. */
export class Examination {
  constructor(data, limits = LIMITS) {
    Object.assign(this, { data, limits, findings: new Findings(limits.issues) });
    this.entries = new Map();
    this.networks = new Map(); // Vetted ones by name.
    this.vectors = new Map();
  }

  /** The networks that this version knows, as the manifest describes them. */
  get known() {
    return [...this.manifest.networks].filter(([name]) => Object.hasOwn(KINDS, name));
  }

  /** Bytes of a member. */
  read = (name) => {
    if (!this.entries.has(name)) {
      fail("PLX_MANIFEST_MEMBER_MISSING", MANIFEST, { member: name });
    }
    return member(this.data, this.entries.get(name));
  };

  /** Runs a stage; a fault it cannot go on from, even one of ours, is its last issue. */
  find(stage) {
    try {
      for (const found of stage(this)) {
        this.findings.add(found);
      }
    } catch (error) {
      this.findings.add(issueOf(error));
    }
  }
}

function issueOf(error) {
  if (error instanceof FormatError) {
    return error.issue;
  }
  return issue("PLX_VALIDATOR_FAULT", "file", { what: `${error.name}: ${error.message}` });
}

/** Runs the stages and stops after the first one that finds an error. */
export function examine(data, limits = LIMITS) {
  const examination = new Examination(data, limits);
  for (const stage of [container, manifest, digests, layer, members, networks, surface, golden,
    values]) {
    examination.find(stage);
    if (examination.findings.errors.length) {
      break;
    }
  }
  return examination;
}

/** The issue of a file that is too large to be read. */
export function tooLarge(size, limits = LIMITS) {
  return size > limits.file_bytes
    ? issue("PLX_FILE_TOO_LARGE", "file", { size, limit: limits.file_bytes })
    : undefined;
}

// Container, manifest and digests

function* container(examination) {
  examination.entries = scan(examination.data, examination.limits);
}

function* manifest(examination) {
  if (!examination.entries.has(MANIFEST)) {
    fail("PLX_MANIFEST_MISSING", "file");
  }
  const { read, findings, limits } = examination;
  examination.manifest = readManifest(read(MANIFEST), findings, limits);
  const stated = examination.manifest?.fidelity.get("verdict");
  if (stated !== undefined && stated !== null && !isVerdict(stated)) {
    yield issue("PLX_MANIFEST_VERDICT", `${MANIFEST}/fidelity/verdict`);
  }
}

/** The manifest lists every member but itself, with size and digest. */
function* digests({ manifest: { members: listed }, entries, data }) {
  const where = `${MANIFEST}/members`;
  if (listed.has(MANIFEST)) {
    fail("PLX_MANIFEST_SCHEMA", where, { expected: "must not list the manifest" });
  }
  for (const name of [...listed.keys()].filter((key) => !entries.has(key)).sort(byCodePoints)) {
    yield issue("PLX_MANIFEST_MEMBER_MISSING", where, { member: name });
  }
  for (const [name, entry] of entries) {
    if (name === MANIFEST) {
      continue;
    }
    if (!listed.has(name)) {
      yield issue("PLX_MANIFEST_MEMBER_UNLISTED", name);
    } else if (entry.size !== listed.get(name).size) {
      yield issue("PLX_MANIFEST_DIGEST_MISMATCH", name, { what: "size" });
    } else if (digest(member(data, entry)) !== listed.get(name).sha256) {
      yield issue("PLX_MANIFEST_DIGEST_MISMATCH", name, { what: "SHA-256" });
    }
  }
}

function byCodePoints(a, b) {
  const [x, y] = [Array.from(a), Array.from(b)];
  const k = x.findIndex((character, i) => character !== y[i]);
  return k < 0 ? x.length - y.length : x[k].codePointAt(0) - (y[k]?.codePointAt(0) ?? -1);
}

function* layer({ read, entries, limits }) {
  yield* layerIssues(read, [...entries.keys()], limits);
}

// Content of the members

/** Which members there are, and the small ones for people. */
function* members(examination) {
  const { entries } = examination;
  const known = new Set([[...entries.keys()][0], MANIFEST, PHOTOMETRY, PREVIEW]);
  Object.values(SURFACE_MEMBERS).forEach(([name]) => known.add(name));
  if (examination.manifest.finishes.length) {
    known.add(FINISH_MEMBER);
  }
  for (const [network] of examination.known) {
    [networkMember(network), ...layout(network).keys()].forEach((name) => known.add(name));
  }
  for (const name of entries.keys()) {
    if (!known.has(name) && !name.startsWith(EXTENSIONS)) {
      yield issue("PLX_MEMBER_UNKNOWN", name);
    }
  }
  for (const name of [PREVIEW, PHOTOMETRY]) {
    if (entries.has(name)) {
      yield* small(examination, name);
    }
  }
}

function* small({ read, limits }, name) {
  const bytes = read(name);
  if (bytes.length > limits.picture_bytes) {
    const sizes = { size: bytes.length, limit: limits.picture_bytes };
    yield issue("PLX_MEMBER_TOO_LARGE", name, sizes);
  } else if (name === PREVIEW) {
    yield* picture(bytes, name, limits);
  } else if (asciiText(bytes.subarray(0, 3)) !== "IES") {
    yield issue("PLX_PHOTOMETRY_INVALID", name);
  }
}

function* picture(bytes, name, limits) {
  if (bytes.length < PNG_HEAD || !startsWith(bytes, PNG)) {
    yield issue("PLX_PREVIEW_INVALID", name);
    return;
  }
  const [width, height] = [16, 20].map((at) => view(bytes).getUint32(at));
  const fits = (size) => size > 0 && size <= limits.picture_pixels;
  if (!fits(width) || !fits(height)) {
    const sizes = { size: `${width} x ${height}`, limit: limits.picture_pixels };
    yield issue("PLX_PREVIEW_TOO_LARGE", name, sizes);
  }
}

function* networks(examination) {
  const where = `${MANIFEST}/networks`;
  const named = [...examination.manifest.networks.keys()];
  for (const name of named.filter((key) => !Object.hasOwn(KINDS, key)).sort(byCodePoints)) {
    yield issue("PLX_MANIFEST_NETWORK_UNKNOWN", `${where}/${name}`);
  }
  const needed = new Set(Object.keys(KINDS).filter((name) => KINDS[name].required));
  examination.known.forEach(([name]) => KINDS[name].needs.forEach((other) => needed.add(other)));
  for (const network of [...needed].filter((name) => !named.includes(name)).sort()) {
    yield issue("PLX_MANIFEST_NETWORK_MISSING", where, { network });
  }
  for (const [name, info] of examination.known) {
    try {
      yield* network(examination, name, info);
    } catch (error) {
      yield issueOf(error);
    }
  }
  if (!examination.findings.errors.length) {
    yield* tier(examination);
  }
}

/** Every network must keep to the tier that is stated; of other tiers nothing is known. */
function* tier({ manifest: { tier: stated }, networks: vetted }) {
  if (stated === null || !Object.hasOwn(TIERS.known, stated)) {
    return;
  }
  for (const [name, found] of vetted) {
    const fault = tierFault(TIERS.known[stated], found, name);
    if (fault) {
      const pair = { stated, actual: `none: ${name} has ${fault}` };
      yield issue("PLX_MANIFEST_COST_MISMATCH", `${MANIFEST}/tier`, pair);
    }
  }
}

function* network({ networks: vetted, read, limits }, name, info) {
  const [where, member] = [`${MANIFEST}/networks/${name}`, networkMember(name)];
  if (info.member !== member) {
    fail("PLX_MANIFEST_SCHEMA", where, { expected: `member must be ${member}` });
  }
  const found = inspect(read(member), name, member, limits);
  vetted.set(name, found);
  yield* found.warnings;
  const actual = {
    macs_per_sample: found.macs, floats_per_sample: found.floats, bytes: found.bytes,
  };
  for (const [figure, value] of Object.entries(actual)) {
    if (info[figure] !== value) {
      const pair = { stated: info[figure], actual: value };
      yield issue("PLX_MANIFEST_COST_MISMATCH", `${where}/${figure}`, pair);
    }
  }
}

function* surface(examination) {
  const { read, limits, manifest: { finishes } } = examination;
  examination.surface = readSurface(read, limits, finishes.length);
  yield* surfaceIssues(examination.surface, examination.manifest, examination.limits);
}

// Golden vectors

function* golden(examination) {
  const { entries, read, limits, manifest: about } = examination;
  let work = 0;
  for (const [name] of examination.known) {
    if (![...layout(name).keys()].some((key) => entries.has(key))) {
      yield issue("PLX_GOLDEN_MISSING", "vectors", { network: name });
      continue;
    }
    const found = readVectors(name, read, limits);
    examination.vectors.set(name, found);
    work += (found.count * examination.networks.get(name).nanoseconds) / 1e6;
    yield* doubts(found, about);
  }
  if (work > limits.golden_milliseconds) {
    const sizes = { size: Math.round(work), limit: limits.golden_milliseconds };
    yield issue("PLX_GOLDEN_COST", "vectors", sizes);
  }
}

/** The networks must give what their golden vectors say, here evaluated in float32. */
function* values({ known, networks: vetted, vectors, manifest: about }) {
  for (const [name] of known) {
    const expected = vectors.get(name);
    const results = attempt(vetted.get(name), expected, networkMember(name));
    const { missed } = compare(expected, results);
    if (missed) {
      const error = largestError(expected, results, about.radiance_scale);
      const figures = { count: missed, total: expected.count, error };
      yield issue("PLX_GOLDEN_MISMATCH", `vectors/${name}`, figures);
    }
  }
}

function attempt(network, { inputs, count }, where) {
  try {
    return evaluate(network, inputs, count);
  } catch (error) {
    if (!(error instanceof BrokenNetwork)) {
      throw error;
    }
    return fail("PLX_GOLDEN_BROKEN", where, { what: error.message });
  }
}
