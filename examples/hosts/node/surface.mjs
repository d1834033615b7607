// The exit surface: every ray against every triangle, which is simple, and slow.

import { cross, difference, dot, scaled, sum } from "./vectors.mjs";

/** Where a ray first meets the triangles: what the networks are asked there, or nothing. */
export function meet(triangles, origin, direction) {
  let first;
  for (const triangle of triangles) {
    const hit = meetOne(triangle, origin, direction);
    if (hit && hit.depth < (first?.depth ?? Infinity)) {
      first = hit;
    }
  }
  return first && { ...first, outgoing: scaled(direction, -1) };
}

/** Depth, point and normal toward the viewer where a ray meets a triangle. */
function meetOne([a, b, c], origin, direction) {
  const ab = difference(b, a);
  const ac = difference(c, a);
  const normal = cross(ab, ac);
  const speed = dot(normal, direction);
  const depth = dot(normal, difference(a, origin)) / speed;
  const at = difference(sum(origin, scaled(direction, depth)), a);
  const square = dot(normal, normal);
  const v = dot(cross(at, ac), normal) / square;
  const w = dot(cross(ab, at), normal) / square;
  const inside = v >= 0 && w >= 0 && v + w <= 1;
  if (!(inside && depth > 0)) {
    return undefined; // Also where numbers are NaN: beside a triangle without area.
  }
  const facing = -Math.sign(speed) / Math.sqrt(square);
  return { depth, position: sum(a, at), normal: scaled(normal, facing) };
}
