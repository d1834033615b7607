// Finishes (plux.md, F1 to F3): of what the sides of the exit surface are made.

import { fail } from "./issues.js";
import { FINISHES } from "./tables.js";

export const FINISH_MEMBER = FINISHES.member;
const BLACK = [0, 0, 0];
const WHITE = [1, 1, 1];

/** The finishes of a manifest; none where it says nothing of any. */
export function readFinishes(reader, limits) {
  return reader.listed("finishes", limits.finishes, "PLX_MANIFEST_FINISH_COUNT").map(readFinish);
}

function readFinish(reader) {
  const finish = {
    name: reader.text("name", 200),
    base_color: reader.color("base_color"),
    metalness: reader.within("metalness", 0, 1, 0),
    specular_color: reader.color("specular_color", WHITE),
    roughness: reader.within("roughness", 0, 1, 0.5),
    ior: reader.within("ior", FINISHES.least_ior, FINISHES.largest_ior, 1.5),
    opacity: reader.within("opacity", 0, 1, 1),
    thin_walled: reader.flag("thin_walled", false),
    smooth: reader.flag("smooth", false),
    spread: reader.within("spread", 0, 1, 0),
    scattered_ahead: reader.color("scattered_ahead", BLACK),
    ahead_exponent: reader.within("ahead_exponent", 0, FINISHES.largest_exponent, 1),
    scattered_back: reader.color("scattered_back", BLACK),
    back_exponent: reader.within("back_exponent", 0, FINISHES.largest_exponent, 0),
  };
  const total = Math.max(...finish.base_color.map((value, k) =>
    value * (1 - finish.metalness) + finish.scattered_ahead[k] + finish.scattered_back[k]));
  if (total > 1 + FINISHES.slack) {
    reader.add("PLX_MANIFEST_FINISH_ENERGY", "base_color", { total });
  }
  reader.rest();
  return finish;
}

/** Compares the finishes of fronts and backs with the triangles and finishes there are. */
export function requireFinishes({ shape, data }, triangles, count) {
  if (shape.length !== 2 || shape[0] !== triangles || shape[1] !== 2) {
    const found = shape.length === 1 ? `(${shape[0]},)` : `(${shape.join(", ")})`;
    fail("PLX_NPY_SHAPE", FINISH_MEMBER, { shape: found, expected: `(${triangles}, 2)` });
  }
  const bad = data.findIndex((index) => index >= count && index !== FINISHES.none);
  if (bad >= 0) {
    fail("PLX_SURFACE_FINISH", FINISH_MEMBER, { triangle: Math.floor(bad / 2), count });
  }
}
