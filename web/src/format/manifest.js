// The manifest (plux.md, M2 to M9): every fault is noted instead of stopping at the first.

import { readFinishes } from "./finishes.js";
import { FormatError, issue } from "./issues.js";
import { parse, Real, toNumber } from "./json.js";
import { FORMAT_VERSION, LIMITS, LONGEST, MANIFEST_BOUNDS, UNITS } from "./tables.js";
import { general, isPrintable } from "./text.js";

export const MANIFEST = "manifest.json";
const VERSION = /^(0|[1-9][0-9]{0,3})\.(0|[1-9][0-9]{0,3})$/;
const DIGEST = /^[0-9a-f]{64}$/;
const { smallest, largest, faintest } = MANIFEST_BOUNDS;

/** Reads manifest.json into `findings`; gives the manifest, nothing if there is an error. */
export function readManifest(bytes, findings, limits = LIMITS) {
  let value;
  try {
    value = parse(bytes, MANIFEST, limits);
  } catch (error) {
    if (!(error instanceof FormatError)) {
      throw error;
    }
    findings.add(error.issue);
    return undefined;
  }
  const reader = new Reader(value, MANIFEST, findings);
  if (!reader.version("format_version", FORMAT_VERSION)) {
    return undefined;
  }
  const manifest = read(reader, limits);
  return findings.errors.length ? undefined : manifest;
}

function read(reader, limits) {
  const manifest = {
    format_version: reader.text("format_version"),
    name: reader.text("name", 200),
    bounding_sphere: readSphere(reader.object("bounding_sphere")),
    flux: reader.vector("flux"),
    radiance_scale: reader.number("radiance_scale"),
    r_max: reader.number("r_max"),
    channels: reader.flags("channels"),
    networks: reader.objects("networks", readNetwork),
    provenance: reader.free("provenance"),
    fidelity: reader.free("fidelity"),
    finishes: readFinishes(reader, limits),
    extensions: reader.free("extensions"),
    members: reader.objects("members", readMember),
    tier: reader.optionalText("tier", 64),
  };
  reader.units("units", UNITS);
  if (!reader.findings.errors.length) {
    requireSense(manifest, reader);
  }
  reader.rest();
  return manifest;
}

function readSphere(reader) {
  const sphere = { center: reader.vector("center"), radius: reader.number("radius") };
  reader.rest();
  return sphere;
}

function readMember(reader) {
  const member = { size: reader.count("size"), sha256: reader.digest("sha256") };
  reader.rest();
  return member;
}

function readNetwork(reader) {
  const info = {
    member: reader.text("member"),
    macs_per_sample: reader.count("macs_per_sample"),
    floats_per_sample: reader.count("floats_per_sample"),
    bytes: reader.count("bytes"),
    uniform_fraction: reader.fraction("uniform_fraction"),
  };
  reader.rest();
  return info;
}

/** Physical sense of the values, rules M6 to M9. */
function requireSense(manifest, reader) {
  const { center, radius } = manifest.bounding_sphere;
  const far = Math.max(...center.map(Math.abs)) > largest;
  if (!(radius >= smallest && radius <= largest) || far) {
    reader.add("PLX_MANIFEST_SPHERE_INVALID", "bounding_sphere");
  }
  const wrong = (flux, k) => (manifest.channels[k] ? !isBright(flux) : flux !== 0);
  if (manifest.flux.some(wrong)) {
    reader.add("PLX_MANIFEST_FLUX_INVALID", "flux");
  }
  if (!manifest.channels.some(Boolean)) {
    reader.add("PLX_MANIFEST_DARK", "channels");
  }
  if (!isBright(manifest.radiance_scale)) {
    reader.add("PLX_MANIFEST_SCALE_INVALID", "radiance_scale");
  }
  if (!(manifest.r_max > 1 && manifest.r_max <= largest)) {
    reader.add("PLX_MANIFEST_RMAX_INVALID", "r_max");
  }
}

/** Whether a quantity of light is far from what float32 cannot hold, or holds as zero. */
function isBright(value) {
  return value >= faintest && value <= 1 / faintest;
}

/** One JSON object; a field that is read is known, the others are the `rest`. */
class Reader {
  constructor(value, pointer, findings) {
    this.findings = findings;
    this.pointer = Array.from(pointer.slice(0, 8 * LONGEST)).slice(0, 4 * LONGEST).join("");
    this.value = value instanceof Map ? value : new Map();
    this.known = new Set();
    if (!(value instanceof Map)) {
      findings.add(issue("PLX_MANIFEST_SCHEMA", this.pointer, { expected: "must be an object" }));
    }
  }

  add(code, key, values) {
    if (!this.findings.isFull(code)) {
      this.findings.add(issue(code, this.below(key), values));
    }
  }

  /** The location of a field as a JSON pointer (RFC 6901). */
  below(key) {
    const short = key.slice(0, 8 * LONGEST);
    return `${this.pointer}/${short.replaceAll("~", "~0").replaceAll("/", "~1")}`;
  }

  get(key) {
    this.known.add(key);
    return this.value.get(key);
  }

  /** A field that has a form, else a stand-in and an issue. */
  field(key, fits, expected, otherwise) {
    const value = this.get(key);
    if (fits(value)) {
      return value;
    }
    this.add("PLX_MANIFEST_SCHEMA", key, { expected });
    return otherwise;
  }

  text(key, longest = 260) {
    const fits = (value) => typeof value === "string" && isShort(value, longest);
    return this.field(key, fits, `must be a printable text of 1 to ${longest} characters`, "");
  }

  optionalText(key, longest) {
    return isNothing(this.get(key)) ? null : this.text(key, longest);
  }

  digest(key) {
    const fits = (value) => typeof value === "string" && DIGEST.test(value);
    return this.field(key, fits, "must be 64 lower-case hexadecimal digits", "");
  }

  count(key) {
    const fits = (value) => isWhole(value) && value >= 0 && value <= 2 ** 53;
    return Number(this.field(key, fits, "must be a whole number, not negative", 0));
  }

  number(key) {
    return toNumber(this.field(key, isNumber, "must be a number", 1));
  }

  fraction(key) {
    const fits = (value) => isNothing(value) || (toNumber(value) > 0 && toNumber(value) <= 1);
    const value = this.field(key, fits, "must be a number above 0, at most 1", undefined);
    return isNothing(value) ? undefined : toNumber(value);
  }

  within(key, low, high, otherwise) {
    const fits = (value) => isNothing(value)
      || (isNumber(value) && toNumber(value) >= low && toNumber(value) <= high);
    const expected = `must be a number from ${general(low)} to ${general(high)}`;
    const value = this.field(key, fits, expected, undefined);
    return isNothing(value) ? otherwise : toNumber(value);
  }

  flag(key, otherwise) {
    const fits = (value) => isNothing(value) || typeof value === "boolean";
    return this.field(key, fits, "must be a truth value", otherwise) ?? otherwise;
  }

  /** Three numbers in [0, 1]; where there may be none, `otherwise`. */
  color(key, otherwise) {
    const within = (value) => isNumber(value) && toNumber(value) >= 0 && toNumber(value) <= 1;
    const fits = (value) => isThree(within)(value) || (isNothing(value) && otherwise);
    const value = this.field(key, fits, "must be three numbers from 0 to 1", [0, 0, 0]);
    return isNothing(value) ? otherwise : value.map(toNumber);
  }

  /** Readers of a list's elements, which must all be objects; none if it is not there. */
  listed(key, most, tooMany) {
    const fits = (value) => isNothing(value) || Array.isArray(value);
    const found = this.field(key, fits, "must be a list", []) ?? [];
    if (found.length > most) {
      this.add(tooMany, key, { count: found.length, limit: most });
      return [];
    }
    return found.map((value, k) => new Reader(value, `${this.below(key)}/${k}`, this.findings));
  }

  vector(key) {
    return this.field(key, isThree(isNumber), "must be three numbers", [0, 0, 0]).map(toNumber);
  }

  flags(key) {
    const isFlag = (value) => typeof value === "boolean";
    return this.field(key, isThree(isFlag), "must be three truth values", [false, false, false]);
  }

  object(key) {
    return new Reader(this.get(key), this.below(key), this.findings);
  }

  /** What `read` makes of an object's members by name, which must all be objects. */
  objects(key, read) {
    const inner = this.object(key);
    return new Map([...inner.value.keys()].map((name) => [name, read(inner.object(name))]));
  }

  /** An object of any content; empty if it is not there. */
  free(key) {
    const fits = (value) => isNothing(value) || value instanceof Map;
    return this.field(key, fits, "must be an object", new Map()) ?? new Map();
  }

  units(key, expected) {
    const found = this.get(key);
    const pairs = Object.entries(expected);
    const same = found instanceof Map && found.size === pairs.length;
    if (!same || !pairs.every(([name, unit]) => found.get(name) === unit)) {
      const text = pairs.map(([name, unit]) => `${name} ${unit}`).join(", ");
      this.add("PLX_MANIFEST_UNITS", key, { expected: text });
    }
  }

  /** Whether a major.minor version can be read: a newer minor one with a warning. */
  version(key, known) {
    const value = this.get(key);
    const match = typeof value === "string" ? VERSION.exec(value) : null;
    if (!match) {
      this.add("PLX_MANIFEST_SCHEMA", key, { expected: "must be a version such as 1.0" });
      return false;
    }
    const [major, minor] = known.split(".").map(Number);
    if (Number(match[1]) !== major) {
      this.add("PLX_MANIFEST_VERSION_UNSUPPORTED", key, { version: value, known });
      return false;
    }
    if (Number(match[2]) > minor) {
      this.add("PLX_MANIFEST_VERSION_NEWER", key, { version: value, known });
    }
    return true;
  }

  /** Warns of the fields that were not read. */
  rest() {
    for (const key of this.value.keys()) {
      if (!this.known.has(key)) {
        this.add("PLX_MANIFEST_UNKNOWN_FIELD", key);
      }
    }
  }
}

function isNothing(value) {
  return value === undefined; // Null is a value, and none that fits.
}

function isWhole(value) {
  return typeof value === "number" || typeof value === "bigint";
}

function isNumber(value) {
  return isWhole(value) || value instanceof Real;
}

function isThree(fits) {
  return (value) => Array.isArray(value) && value.length === 3 && value.every(fits);
}

function isShort(text, longest) {
  return text.length > 0 && text.length <= 2 * longest && [...text].length <= longest
    && isPrintable(text);
}
