// A maker's verdict (plux.md, M15): whether its figures are in form.

import { isNumbers, toNumber } from "./json.js";
import { VERDICT } from "./tables.js";

/** Whether a manifest's verdict can be read; fields that are not known are ignored. */
export function isVerdict(value, group = VERDICT.groups.Verdict) {
  return value instanceof Map && group.every(([name, inner, optional]) => {
    const given = value.get(name);
    if (given === undefined || given === null) {
      return optional;
    }
    return inner ? isVerdict(given, VERDICT.groups[inner]) : isFigure(name, given);
  });
}

function isFigure(name, value) {
  const least = VERDICT.signed.includes(name) ? -VERDICT.largest : 0;
  return isNumbers([value], 1) && toNumber(value) >= least && toNumber(value) <= VERDICT.largest;
}
