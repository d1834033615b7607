// What Python has written for these tests: `python -m tests.unit.web.files FOLDER`.

import { readFileSync } from "node:fs";
import { join } from "node:path";

/** The folder, nothing where it was not named. */
export const FOLDER = process.env.PURELIGHT_FILES;

/** Options of a test that needs the folder. */
export const NEEDS = {
  skip: FOLDER ? false : "PURELIGHT_FILES names no folder of `python -m tests.unit.web.files`",
};

export function path(...names) {
  return join(FOLDER, ...names);
}

export function json(name) {
  return JSON.parse(readFileSync(path(name), "utf8"));
}

export function bytes(...names) {
  return new Uint8Array(readFileSync(path(...names)));
}

/** Bytes of base64. */
export function unpacked(text) {
  return new Uint8Array(Buffer.from(text, "base64"));
}

/** The network of an entry of networks.json, and its inputs by name. */
export function inputsOf({ inputs }) {
  const entries = Object.entries(inputs);
  return Object.fromEntries(
    entries.map(([name, text]) => [name, new Float32Array(unpacked(text).buffer)]),
  );
}

/** The largest error over a thousandth of the value and a thousandth. */
export function largestError(values, { outputs }) {
  const right = new Float64Array(unpacked(outputs).buffer);
  return right.reduce((most, wanted, k) => {
    const error = Math.abs(Number(values[k]) - wanted) / (1e-3 + 1e-3 * Math.abs(wanted));
    return Number.isNaN(error) ? Infinity : Math.max(most, error);
  }, 0);
}
