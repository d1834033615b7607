// How faithful a lamp is, in words: the figures that purelight-export writes into a manifest.

import { isNumbers, toNumber } from "./json.js";
import { fixed, general } from "./text.js";

const FLUX = ["student_flux", "student_flux_error", "flux_error"];
const NAMES = ["networks", "traced light"];

/** The known figures in words, and those that are left, a Map. */
export function fidelityWords({ fidelity, flux }) {
  const left = new Map(fidelity);
  const said = fluxWords(left, flux);
  for (const [key, words] of [["held_out_gain_nats", gainWords], ["onnx_error", networkWords]]) {
    const text = words(left.get(key));
    if (text) {
      said.push(text);
      left.delete(key);
    }
  }
  return { said, left };
}

/** How much more or less light the networks give than was traced, and how sure that is. */
function fluxWords(figures, flux) {
  const [student, ...errors] = FLUX.map((key) => takeThree(figures, key));
  const parts = errors.map((error) => error && largestPart(error, flux));
  const known = NAMES.flatMap((name, k) => (parts[k] === undefined ? []
    : [`${name} ${percent(parts[k])}`]));
  const lines = student ? [brightness(student, flux)] : [];
  if (student && known.length === 2) {
    lines[0] += `; up to ${percent(2 * Math.hypot(...parts))} may be chance,`;
    lines.push(`as both are measured with random rays (standard errors: ${known.join(", ")})`);
  } else if (known.length) {
    lines.push(`standard error, relative to the lamp's flux: ${known.join(", ")}`);
  }
  return lines;
}

function takeThree(figures, key) {
  const value = figures.get(key);
  if (!isNumbers(value, 3)) {
    return undefined;
  }
  figures.delete(key);
  return value.map(toNumber);
}

function brightness(student, flux) {
  const more = student.map((x, k) => (flux[k] ? difference(x / flux[k]) : "none"));
  return `brightness against the traced light: ${more.join(", ")} % (R, G, B)`;
}

/** A ratio as per cent more or less, with its sign. */
function difference(ratio) {
  const text = general(Number(fixed(100 * (ratio - 1), 2)));
  return text.startsWith("-") ? text : `+${text}`;
}

/** The largest standard error in W, relative to the lamp's flux in that channel. */
function largestPart(error, flux) {
  const parts = error.map((x, k) => x / flux[k]).filter((_, k) => flux[k]);
  return parts.length ? Math.max(...parts) : 0;
}

function percent(part) {
  return `${general(100 * part, 2)} %`;
}

function gainWords(value) {
  if (!isNumbers([value], 1)) {
    return "";
  }
  const times = Math.exp(Math.min(toNumber(value), 99));
  return `unseen light is ${general(times, 3)} times likelier than under an even glow`;
}

function networkWords(values) {
  const numbers = values instanceof Map ? [...values.values()] : [];
  if (!numbers.length || !isNumbers(numbers, numbers.length)) {
    return "";
  }
  const most = Math.max(...numbers.map(toNumber));
  return `networks equal the trained ones within ${general(most, 2)}`;
}
