// Where a lamp hangs (measures.md, "Instances"): world = scale · rotation · local + translation.

import { refuse } from "./refusal.mjs";
import { cross, difference, dot, scaled } from "./vectors.mjs";

const HERE = [
  [1, 0, 0, 0],
  [0, 1, 0, 0],
  [0, 0, 1, 0],
  [0, 0, 0, 1],
];
const STRAIGHT = 1e-8; // What its last row may differ.
const UNEVEN = 1e-4; // What a transform may differ from a rotation and a uniform scale.

export class Placement {
  /** Takes a matrix apart; refuses one that mirrors, shears or scales unevenly. */
  constructor({ to_world: matrix = HERE, dimmer = 1 }) {
    const rows = matrix.slice(0, 3).map((row) => row.slice(0, 3));
    const volume = dot(rows[0], cross(rows[1], rows[2]));
    if (!(volume > 0)) {
      refuse("to_world mirrors or flattens the lamp");
    }
    if (!matrix[3].every((x, k) => Math.abs(x - HERE[3][k]) <= STRAIGHT)) {
      refuse("to_world projects");
    }
    this.dimmer = dimmer;
    this.scale = Math.cbrt(volume);
    this.rotation = rows.map((row) => scaled(row, 1 / this.scale));
    this.translation = matrix.slice(0, 3).map((row) => row[3]);
    if (!isRotation(this.rotation)) {
      refuse("to_world shears the lamp or scales its axes differently");
    }
  }

  /** A point of the world in the luminaire frame. */
  point(world) {
    return scaled(this.direction(difference(world, this.translation)), 1 / this.scale);
  }

  /** A direction of the world in the luminaire frame. */
  direction(world) {
    const column = (k) => this.rotation.map((row) => row[k]);
    return [0, 1, 2].map((k) => dot(world, column(k)));
  }

  /** A direction of the luminaire frame in the world. */
  outward(local) {
    return this.rotation.map((row) => dot(row, local));
  }
}

function isRotation(rows) {
  const unit = (i, j) => (i === j ? 1 : 0);
  return rows.every((a, i) =>
    rows.every((b, j) => Math.abs(dot(a, b) - unit(i, j)) <= UNEVEN),
  );
}
