// The exit surface (plux.md, S1 to S5).

import { FINISH_MEMBER, requireFinishes } from "./finishes.js";
import { fail, issue } from "./issues.js";
import { readNpy, requireShape } from "./npy.js";
import { LIMITS, SURFACE } from "./tables.js";

export const SURFACE_MEMBERS = {
  positions: ["surface/positions.npy", "<f4"],
  triangles: ["surface/triangles.npy", "<u4"],
  triangle_flux: ["surface/triangle_flux.npy", "<f4"],
};
const [POSITIONS, TRIANGLES, FLUX] = Object.values(SURFACE_MEMBERS).map(([member]) => member);

/** Reads a surface: flat arrays `positions` and `triangle_flux`, and indices `triangles`. */
export function readSurface(read, limits = LIMITS, finishes = 0) {
  const arrays = {};
  for (const [field, [member, type]] of Object.entries(SURFACE_MEMBERS)) {
    arrays[field] = readNpy(read(member), member, type, limits);
  }
  const { positions, triangles, triangle_flux: flux } = arrays;
  requireShape(positions, POSITIONS, [null, 3]);
  requireShape(triangles, TRIANGLES, [null, 3]);
  requireShape(flux, FLUX, [triangles.shape[0], 3]);
  const finish = finishes ? readNpy(read(FINISH_MEMBER), FINISH_MEMBER, "|u1", limits) : null;
  requireIndices(triangles, positions.shape[0]);
  if (finish) {
    requireFinishes(finish, triangles.shape[0], finishes);
  }
  if (flux.data.some((value) => value < 0)) {
    fail("PLX_SURFACE_FLUX", FLUX);
  }
  return { positions: positions.data, triangles: triangles.data, triangle_flux: flux.data };
}

function requireIndices({ shape, data }, vertices) {
  if (!shape[0]) {
    fail("PLX_SURFACE_EMPTY", TRIANGLES);
  }
  const bad = data.findIndex((index) => index >= vertices);
  if (bad >= 0) {
    fail("PLX_SURFACE_INDEX", TRIANGLES, { triangle: Math.floor(bad / 3) });
  }
}

/** Compares a surface with the manifest's bounding sphere and flux. */
export function* surfaceIssues(surface, { bounding_sphere: sphere, flux }, limits = LIMITS) {
  const distance = farthest(surface.positions, sphere);
  if (distance > 1 + SURFACE.slack) {
    yield issue("PLX_SURFACE_OUTSIDE_SPHERE", POSITIONS, { distance });
  }
  const count = crowding(surface, sphere.radius);
  if (count > limits.crowding) {
    const values = { count: Math.round(count), limit: limits.crowding };
    yield issue("PLX_SURFACE_CROWDED", TRIANGLES, values);
  }
  for (const [channel, sum] of fluxSums(surface).entries()) {
    const stated = flux[channel];
    if (Math.abs(sum - stated) > SURFACE.closure * stated) {
      const ratio = stated ? sum / stated : Infinity;
      yield issue("PLX_SURFACE_FLUX_CLOSURE", FLUX, { channel, ratio });
    }
  }
}

/** Distance of the farthest vertex from the centre, in radii. */
function farthest(positions, { center, radius }) {
  let most = 0;
  for (let i = 0; i < positions.length; i += 3) {
    const [x, y, z] = [0, 1, 2].map((k) => positions[i + k] - center[k]);
    most = Math.max(most, x * x + y * y + z * z);
  }
  return Math.sqrt(most) / radius;
}

/** How many triangles a ray through the sphere may have to be tested against. */
function crowding({ positions, triangles }, radius) {
  let total = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => {
      const at = [0, 1, 2].map((corner) => positions[3 * triangles[t + corner] + k]);
      return (Math.max(...at) - Math.min(...at)) / (2 * radius);
    });
    total += (a * b + b * c + c * a) / 3;
  }
  return total;
}

function fluxSums({ triangle_flux: flux }) {
  const sums = [0, 0, 0];
  for (let i = 0; i < flux.length; i++) {
    sums[i % 3] += flux[i];
  }
  return sums;
}

/** Area of each triangle in m². */
export function triangleAreas({ positions, triangles }) {
  const areas = new Float64Array(triangles.length / 3);
  for (let t = 0; t < areas.length; t++) {
    const corner = (k, axis) => positions[3 * triangles[3 * t + k] + axis];
    const edge = (k) => [0, 1, 2].map((axis) => corner(k, axis) - corner(0, axis));
    const [[a, b, c], [x, y, z]] = [edge(1), edge(2)];
    areas[t] = Math.hypot(b * z - c * y, c * x - a * z, a * y - b * x) / 2;
  }
  return areas;
}
