// One screen about a bundle, word for word what `purelight-inspect` says.

import { digest } from "./bytes.js";
import { fidelityWords } from "./fidelity.js";
import { Real } from "./json.js";
import { MANIFEST } from "./manifest.js";
import { triangleAreas } from "./surface.js";
import { ABILITIES, LUMENS_PER_WATT, LUMINANCE, SUMMARY, TIERS } from "./tables.js";
import { fixed, general, grouped, plain, repr } from "./text.js";
import { isVerdict } from "./verdict.js";
import { verdictLines } from "./verdict_words.js";

const WIDTH = 14;
const LONGEST = 9; // Lines for each open-ended table, so that all fits on one screen.
const WIDEST = 120;

/** The headline, and lines as pairs of a title and a text; most titles are said once. */
export function summary(examination) {
  const { manifest: about, data, read } = examination;
  const size = sizeText(data.length);
  const headline = `${about.name}: a PureLight luminaire, format ${about.format_version}, ${size}`;
  const { said, left } = fidelityWords(about);
  const judged = isVerdict(left.get("verdict")) ? verdict(left.get("verdict"), about) : [];
  if (judged.length) {
    left.delete("verdict");
  }
  const lines = [
    ...lamp(examination),
    ...networks(about),
    ...(typeof about.tier === "string" ? [["tier", tier(about.tier)]] : []),
    ...judged,
    ...table("faithful", [...said, ...flattened("", left)]),
    ...table("made from", [...flattened("", about.provenance)]),
    ["digest", digest(read(MANIFEST))],
  ];
  return { headline, lines: lines.map(([title, text]) => [title, cut(text, WIDEST)]) };
}

/** The same as text. */
export function summaryText(examination) {
  const { headline, lines } = summary(examination);
  return [headline, ...lines.map(([title, text]) => (title.padEnd(WIDTH) + text).trimEnd())]
    .join("\n");
}

function cut(text, longest) {
  return text.length > longest ? Array.from(text).slice(0, longest).join("") : text;
}

/** Four digits, with commas between thousands, as long as that is readable. */
function lumensText(value) {
  const text = general(value, 4);
  const rounded = Number(text);
  const readable = Math.abs(rounded) >= 1000 && Math.abs(rounded) < 1e12;
  return `${readable ? grouped(fixed(rounded, 0)) : text} lm`;
}

function lamp({ manifest: about, surface }) {
  const { center, radius } = about.bounding_sphere;
  const area = triangleAreas(surface).reduce((a, b) => a + b, 0);
  const far = `${general(about.r_max)} radii (${lengthText(about.r_max * radius)}) away`;
  return [
    ["size", `${lengthText(2 * radius)} across; a sphere of radius ${general(radius, 4)} m about (${
      numbers(center.map((x) => (Math.abs(x) < 1e-6 * radius ? 0 : x)))})`],
    ["light", `${lumensText(lumens(about.flux))}; ${numbers(about.flux)} W (R, G, B)${
      colorText(about)}`],
    ["radiance", `${general(about.radiance_scale, 4)} W/(m2 sr) in the mean; trained to ${far}`],
    ["exit surface", `${grouped(surface.triangles.length / 3)} triangles, ${areaText(area)}`],
    ...finishes(about.finishes),
  ];
}

/** Of what the lamp is made, in the light of a room. */
function finishes(all) {
  const words = [...new Set(all.filter(answers).map((f) => `${plain(f.name, 40)} (${kind(f)})`))];
  const more = words.length - SUMMARY.finishes;
  const text = words.slice(0, SUMMARY.finishes).join(", ") + (more > 0 ? ` and ${more} more` : "");
  return words.length ? [["finishes", text]] : [];
}

/** Whether any light comes back from a finish, or goes on. */
function answers({ opacity, ior, base_color: color }) {
  return opacity < 1 || ior > 1 || Math.max(...color) > 0;
}

function kind({ opacity, thin_walled: thin, metalness }) {
  return opacity < 1 ? thin ? "thin glass" : "glass" : metalness > SUMMARY.metal ? "metal" : "opaque";
}

/** A tier, and what it says of the lamp. */
function tier(name) {
  if (!Object.hasOwn(TIERS.known, name)) {
    return `${plain(name, 64)}, of which this version knows nothing`;
  }
  const known = TIERS.known[name];
  return `${known.name}: at most ${grouped(known.macs)} multiply-adds (a map ${
    grouped(known.map_macs)}), layers of ${known.multiple}; for any GPU`;
}

/** What its maker found, in words. */
function verdict(found, { provenance }) {
  const lines = ["says its maker:", ...verdictLines(found, provenance)];
  return lines.flatMap(folded).map((text, k) => [k ? "" : "verdict", text]);
}

/** A line of words as lines that are not too wide, all but the first of them indented. */
function folded(line) {
  const lines = [];
  for (const word of line.split(" ")) {
    const last = lines.at(-1);
    if (last !== undefined && last.length + 1 + word.length <= SUMMARY.fold) {
      lines[lines.length - 1] = `${last} ${word}`;
    } else {
      lines.push(lines.length ? `  ${word}` : word);
    }
  }
  return lines;
}

/** Luminous flux of W per channel. */
export function lumens(flux) {
  return LUMENS_PER_WATT * flux.reduce((sum, x, k) => sum + x * LUMINANCE[k], 0);
}

/** The colour of the light on an sRGB screen, and the channels that are dark. */
function colorText({ flux, channels }) {
  const dark = ["R", "G", "B"].filter((_, k) => !channels[k]);
  if (dark.length === 3) {
    return "; it gives no light";
  }
  return `; color ${screenColor(flux)}${dark.length ? `; dark: ${dark.join(" ")}` : ""}`;
}

/** The colour of light as #RRGGBB, its largest channel full. */
export function screenColor(flux) {
  const most = Math.max(...flux);
  const code = flux.map((x) => fixed(255 * encoded(x / most), 0));
  return `#${code.map((x) => Number(x).toString(16).padStart(2, "0").toUpperCase()).join("")}`;
}

/** The transfer curve of IEC 61966-2-1. */
function encoded(linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}

/** What the lamp can do, and with which networks at what cost. */
function networks({ networks: known }) {
  const others = [...known.keys()].filter((name) => !Object.hasOwn(ABILITIES, name));
  const names = [...Object.keys(ABILITIES), ...others].slice(0, LONGEST);
  const head = `${"network".padEnd(WIDTH)}${"size".padStart(9)}${"multiply-adds".padStart(15)}${
    "values".padStart(9)}`;
  return [["can", head], ...names.map((name) => network(name, known.get(name)))];
}

function network(name, info) {
  const ability = Object.hasOwn(ABILITIES, name) ? ABILITIES[name] : "";
  const short = plain(name, WIDTH - 1);
  if (!info) {
    return ["  no", `${short.padEnd(WIDTH + 33)}   ${ability}`];
  }
  const share = info.uniform_fraction ? `; ${general(info.uniform_fraction)} uniform` : "";
  const [macs, floats] = [info.macs_per_sample, info.floats_per_sample].map(grouped);
  const figures = `${sizeText(info.bytes).padStart(9)}${macs.padStart(15)}${floats.padStart(9)}`;
  return [ability ? "  yes" : "", `${short.padEnd(WIDTH)}${figures}   ${ability}${share}`];
}

// Tables of free content

/** A few lines under a title. */
function table(title, found) {
  const lines = found.slice(0, LONGEST).map((text, k) => [k ? "" : title, text]);
  if (found.length > LONGEST) {
    lines.push(["", `and ${found.length - LONGEST} more (--json)`]);
  }
  return lines.length ? lines : [[title, "not stated"]];
}

/** Nested values as dotted names. */
function* flattened(prefix, value) {
  if (value instanceof Map && (value.size || !prefix)) {
    for (const [key, inner] of value) {
      yield* flattened(`${prefix}.${key}`, inner);
    }
  } else {
    const values = Array.isArray(value) ? value : [value];
    yield plain(`${prefix.slice(1)} ${values.map(shortText).join(", ")}`, 110);
  }
}

function shortText(value) {
  return value instanceof Real ? general(value.value, 4) : asText(value);
}

/** A JSON value as Python's str. */
function asText(value, inside = false) {
  if (typeof value === "string") {
    return inside ? repr(value) : value;
  }
  if (value === null || typeof value === "boolean") {
    return { null: "None", true: "True", false: "False" }[value];
  }
  if (Array.isArray(value)) {
    return `[${value.map((x) => asText(x, true)).join(", ")}]`;
  }
  if (value instanceof Map) {
    const pairs = [...value].map(([key, x]) => `${repr(key)}: ${asText(x, true)}`);
    return `{${pairs.join(", ")}}`;
  }
  return value instanceof Real ? floatText(value.value) : String(value);
}

/** Python's repr of a float. */
function floatText(value) {
  const text = String(value);
  const [digits, power] = text.split("e");
  const size = Math.abs(value);
  if (power === undefined && (size === 0 || (size >= 1e-4 && size < 1e16))) {
    return text.includes(".") ? text : `${text}.0`;
  }
  const [mantissa, exponent] = power === undefined ? value.toExponential().split("e")
    : [digits, power];
  const sign = exponent.startsWith("-") ? "-" : "+";
  return `${mantissa}e${sign}${exponent.replace(/^[-+]/, "").padStart(2, "0")}`;
}

// Figures

function numbers(values) {
  return values.map((x) => general(x, 4)).join(", ");
}

function lengthText(metres) {
  const small = metres >= 1e-3 && metres < 1;
  return small ? `${general(100 * metres, 3)} cm` : `${general(metres, 4)} m`;
}

function areaText(area) {
  return area < 0.1 ? `${general(1e4 * area, 4)} cm2` : `${general(area, 4)} m2`;
}

/** A number of bytes. */
export function sizeText(count) {
  return count >= 1e5 ? `${fixed(count / 1e6, 2)} MB` : `${fixed(count / 1e3, 1)} kB`;
}
