// Measures (measures.md), on one point or direction at a time.

import { clip, difference, dot, scaled, sum } from "./vectors.mjs";

const QUARTER = Math.PI / 4;

/** Eq. 1: completes a unit axis to a right-handed frame. */
export function frame([x, y, z]) {
  const rho = x * x + y * y;
  if (z < 0 && rho < 1e-20) {
    return { tangent: [-1, 0, -x], bitangent: [0, 1, -y] };
  }
  const k = z >= 0 ? 1 / (1 + z) : (1 - z) / rho;
  return {
    tangent: [1 - k * x * x, -k * x * y, -x],
    bitangent: [-k * x * y, 1 - k * y * y, -y],
  };
}

/** Eq. 2: the concentric map. */
export function squareToDisk(u) {
  const [a, b] = u.map((x) => 2 * x - 1);
  if (Math.abs(a) > Math.abs(b)) {
    return onCircle(a, QUARTER * (b / a));
  }
  return onCircle(b, 2 * QUARTER - QUARTER * (a / (b || 1)));
}

function onCircle(radius, angle) {
  return [radius * Math.cos(angle), radius * Math.sin(angle)];
}

/** Eq. 3: its inverse. */
export function diskToSquare([x, y]) {
  const wide = Math.abs(x) > Math.abs(y);
  const [larger, smaller] = wide ? [x, y] : [y, x];
  const r = Math.sign(larger) * Math.hypot(x, y);
  const t = (r * Math.atan(smaller / (larger || 1))) / QUARTER;
  return (wide ? [r, t] : [t, r]).map((side) => clip((side + 1) / 2, 0, 1));
}

/** Eq. 4: the cap of directions in which a sphere is seen. */
export function cap(point, { center, radius }) {
  const offset = difference(center, point).map((x) => clip(x / radius, -1e15, 1e15));
  const distance = Math.sqrt(dot(offset, offset));
  const sine = Math.min(1, 1 / distance);
  return {
    axis: distance > 0 ? scaled(offset, 1 / distance) : [0, 0, 1],
    oneMinusCos: (sine * sine) / (1 + Math.sqrt(1 - sine * sine)),
    outside: distance > 1 + 1e-6,
  };
}

/** Density of directions spread evenly over a cap, 0 where its point is not outside. */
export function uniformPdf(view) {
  return view.outside ? 1 / solidAngle(view) : 0;
}

export function solidAngle({ oneMinusCos }) {
  return 2 * Math.PI * oneMinusCos;
}

/** Eq. 5: the square onto the cap. */
export function capToDirection(u, { axis, oneMinusCos }) {
  const [x, y] = squareToDisk(u);
  const { tangent, bitangent } = frame(axis);
  const m = (x * x + y * y) * oneMinusCos;
  const q = Math.sqrt(oneMinusCos * (2 - m));
  const aside = sum(scaled(tangent, q * x), scaled(bitangent, q * y));
  return sum(scaled(axis, 1 - m), aside);
}

/** Eq. 6: its inverse. */
export function directionToCap(toward, { axis, oneMinusCos }) {
  const offset = difference(toward, axis);
  const m = dot(offset, offset) / 2;
  const q = Math.sqrt(Math.max(1e-30, oneMinusCos * (2 - m)));
  const { tangent, bitangent } = frame(axis);
  const disk = [dot(offset, tangent) / q, dot(offset, bitangent) / q];
  const reach = Math.hypot(...disk);
  return {
    u: diskToSquare(scaled(disk, 1 / Math.max(1, reach))),
    inside: reach <= 1 && m <= 1.5,
  };
}

/** Eq. 8: a density per area of the surface as one per solid angle at the point. */
export function areaToSolidAngle(pdfArea, point, position, normal) {
  const offset = difference(position, point);
  const distance = Math.hypot(...offset);
  const cosine = Math.abs(dot(offset, normal)) / distance;
  return (pdfArea * distance ** 2) / cosine;
}
