// Golden vectors (conformance.md, G1 to G6): by them a host proves that it evaluates a network.

import { fail, issue } from "./issues.js";
import { readNpy, requireShape } from "./npy.js";
import { KINDS, LIMITS, LOOSE } from "./tables.js";
import { product } from "./tensors.js";

const GROUPS = [["inputs", "<f4", ""], ["outputs", "<f8", ""], ["tolerances", "<f8", ".tolerance"]];
const TINY = 2.2250738585072014e-308;

/** Members of a network's vectors: name -> { group, name, type, shape }. */
export function layout(network) {
  const shapes = { ...KINDS[network], tolerances: KINDS[network].outputs };
  return new Map(
    GROUPS.flatMap(([group, type, ending]) =>
      Object.entries(shapes[group]).map(([name, shape]) => [
        `vectors/${network}.${name}${ending}.npy`,
        { group, name, type, shape },
      ]),
    ),
  );
}

/** Golden vectors as { network, count, inputs, outputs, tolerances }: flat arrays by name. */
export function readVectors(network, read, limits = LIMITS) {
  const vectors = { network, count: null, inputs: {}, outputs: {}, tolerances: {} };
  for (const [member, { group, name, type, shape }] of layout(network)) {
    const array = readNpy(read(member), member, type, limits);
    requireShape(array, member, [vectors.count, ...shape]);
    vectors[group][name] = array.data;
    vectors.count = array.shape[0];
  }
  const where = `vectors/${network}`;
  if (!(vectors.count >= 1 && vectors.count <= limits.vectors)) {
    fail("PLX_GOLDEN_SHAPE", where, { count: vectors.count, limit: limits.vectors });
  }
  for (const [name, tolerance] of Object.entries(vectors.tolerances)) {
    if (tolerance.some((value) => value < 0)) {
      fail("PLX_GOLDEN_TOLERANCE_INVALID", `${where}.${name}`);
    }
  }
  return vectors;
}

/** Outputs that no network can give, and tolerances that would let a wrong host pass. */
export function* doubts(vectors, { channels, radiance_scale: radianceScale }) {
  const { network, count, outputs, tolerances } = vectors;
  for (const [name, [fixed, scaled]] of Object.entries(KINDS[network].units)) {
    yield* beyond(vectors, name, channels);
    const unit = fixed + scaled * radianceScale;
    const width = product(KINDS[network].outputs[name]);
    let ratio = -Infinity;
    for (let n = 0; n < count; n++) {
      const row = (array) => array.subarray(n * width, (n + 1) * width);
      const size = row(outputs[name]).reduce((most, y) => Math.max(most, Math.abs(y)), 0);
      const wide = row(tolerances[name]).reduce((most, t) => Math.max(most, t), 0);
      ratio = Math.max(ratio, wide / Math.max(size + unit, TINY));
    }
    if (ratio > LOOSE) {
      yield issue("PLX_GOLDEN_TOLERANCE_LOOSE", `vectors/${network}.${name}`, { ratio });
    }
  }
}

/** What an output cannot be but for its tolerance. */
function* beyond({ network, outputs, tolerances }, name, channels) {
  const { ranges, shining } = KINDS[network];
  const [least, most] = ranges[name].map((limit, k) => limit ?? [-Infinity, Infinity][k]);
  const [output, slack] = [outputs[name], tolerances[name]];
  const where = `vectors/${network}.${name}`;
  const outside = (y, i) => y < least - slack[i] || y > most + slack[i];
  let count = output.filter(outside).length;
  if (count) {
    const expected = `at least ${least}${most === Infinity ? "" : `, at most ${most}`}`;
    yield issue("PLX_GOLDEN_RANGE", where, { count, expected });
  }
  const lit = (y, i) => Math.abs(y) > slack[i] && !channels[i % 3];
  count = shining.includes(name) ? output.filter(lit).length : 0;
  if (count) {
    yield issue("PLX_GOLDEN_CHANNEL", where, { count });
  }
}

/**
 * Compares results with golden vectors.
 *
 * Gives how many vectors are missed, and the largest error in units of the tolerances: a vector
 * is met where it is at most one. What is not finite is not met.
 */
export function compare({ network, count, outputs, tolerances }, results) {
  const missed = new Uint8Array(count);
  let worst = 0;
  for (const [name, expected] of Object.entries(outputs)) {
    const width = product(KINDS[network].outputs[name]);
    expected.forEach((right, i) => {
      const error = Math.abs(results[name][i] - right);
      const allowed = tolerances[name][i];
      const units = error === 0 ? 0 : error / allowed; // Infinite where nothing is allowed.
      worst = Number.isFinite(error) ? Math.max(worst, units) : Infinity;
      missed[Math.floor(i / width)] |= !(error <= allowed);
    });
  }
  return { missed: missed.reduce((sum, bit) => sum + bit, 0), worst };
}

/** The largest error as a validator tells it: of radiance in log1p(radiance / scale). */
export function largestError({ network, outputs }, results, radianceScale) {
  let most = 0;
  for (const [name, expected] of Object.entries(outputs)) {
    const [fixed, scaled] = KINDS[network].units[name];
    const measure = scaled ? logarithmic(radianceScale) : fixed ? plain : relative;
    expected.forEach((right, i) => {
      const error = Math.abs(measure(results[name][i], right));
      most = Number.isFinite(results[name][i]) ? Math.max(most, error) : Infinity;
    });
  }
  return most;
}

function logarithmic(scale) {
  const log = (value) => Math.log1p(Math.max(value, -0.5 * scale) / scale);
  return (result, right) => log(result) - log(right);
}

function plain(result, right) {
  return result - right;
}

function relative(result, right) {
  return (result - right) / (right === 0 ? 1 : right);
}
