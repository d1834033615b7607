// Points of the exit surface, drawn by how much light leaves its triangles.

import { LUMINANCE } from "../format/tables.js";
import { corner, crossOf, normalOf } from "./lamp.js";

// Steps of an evenly spread sequence in three dimensions: powers of one over the root of x^4 = x + 1.
const STEPS = [0.8191725133961645, 0.6710436067037893, 0.5497004779019703];
const EVEN = 0.05; // Part of the points that are drawn by area, so that none is out of reach.

export class SurfaceSamples {
  constructor({ surface, sphere }) {
    Object.assign(this, { surface, sphere });
    const { triangles, triangle_flux: flux } = surface;
    this.areas = Float64Array.from({ length: triangles.length / 3 }, (_, t) => this.area(t));
    const power = Float64Array.from(this.areas, (area, t) =>
      (area > 0 ? LUMINANCE.reduce((sum, w, c) => sum + w * flux[3 * t + c], 0) : 0));
    const [light, extent] = [power, this.areas].map((values) => values.reduce((a, b) => a + b, 0));
    const share = light > 0 ? EVEN : 1;
    this.parts = power.map((value, t) => (light > 0 ? (1 - share) * (value / light) : 0)
      + share * (extent > 0 ? this.areas[t] / extent : 0));
    let sum = 0;
    this.reached = this.parts.map((part) => (sum += part));
  }

  corners(t) {
    const { positions, triangles } = this.surface;
    return [0, 1, 2].map((k) => corner(positions, triangles[3 * t + k], this.sphere));
  }

  /** Area of a triangle in square radii. */
  area(t) {
    return Math.hypot(...crossOf(this.corners(t))) / 2;
  }

  /** Point number `index`: its place in radii, its normal, one over its density per area. */
  point(index) {
    const [first, second, third] = STEPS.map((step) => (0.5 + (index + 1) * step) % 1);
    const t = this.choose(first * this.reached.at(-1));
    const corners = this.corners(t);
    const root = Math.sqrt(second);
    const weights = [1 - root, root * (1 - third), root * third];
    const place = [0, 1, 2].map((axis) =>
      weights.reduce((sum, weight, k) => sum + weight * corners[k][axis], 0));
    const weight = this.parts[t] > 0 ? this.areas[t] / this.parts[t] : 0;
    return { place, normal: normalOf(corners), weight };
  }

  /** The first triangle up to which so much is reached. */
  choose(wanted) {
    let [low, high] = [0, this.reached.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.reached[middle] > wanted) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  }
}
