// A verdict in words, as `purelight_format.verdict.words` has them; every threshold is its.

import { toNumber } from "./json.js";
import { VERDICT } from "./tables.js";
import { fixed, general } from "./text.js";

const { bars, larger: LARGER, where: WHERE } = VERDICT;

/** The figures of a verdict in good form as an object; what was not measured is null. */
function figures(value, group = VERDICT.groups.Verdict) {
  return Object.fromEntries(group.map(([name, inner]) => {
    const given = value.get(name) ?? null;
    return [name, given === null ? null : inner ? figures(given, VERDICT.groups[inner])
      : toNumber(given)];
  }));
}

/** Sentences on light, look and fast mode, and what would help. */
export function verdictLines(value, provenance) {
  const verdict = figures(value);
  const [light, look] = [lightWord(verdict.accurate.within), lookWord(verdict)];
  const help = [...advice(verdict, light, look, provenance)];
  return [
    lightLine(verdict, light),
    ...(look ? [lookLine(verdict, look)] : []),
    ...(verdict.fast ? [fastLine(verdict)] : []),
    ...(help.length ? [`would help: ${help.join("; ")}`] : []),
  ];
}

function lightWord(within) {
  return within <= bars.good ? "good" : within <= bars.fair ? "fair" : "poor";
}

function lightLine(verdict, light) {
  const { accurate, near } = verdict;
  const parts = [`light in the room within ±${percent(accurate.within)} (${light})`,
    inTheMean(accurate), ...zones(verdict)];
  if (near) {
    parts.push(`within ±${percent(near.within)} between its own parts`);
  }
  return parts.join(", ");
}

function inTheMean({ mean }) {
  return Math.abs(mean) < 0.005 ? "right in the mean" : `${signed(mean)} in the mean`;
}

/** Where light is off by more than in general. */
function zones({ accurate, share }) {
  const least = Math.max(bars.zone, accurate.within);
  const worth = (zone) => Math.abs(accurate.zones[zone]) > least && share[zone] >= bars.faint;
  return Object.entries(WHERE).filter(([zone]) => worth(zone))
    .map(([zone, words]) =>
      `${signed(accurate.zones[zone])} ${words} (${percent(share[zone])} of it)`);
}

function lookWord({ look: seen }) {
  if (!seen) {
    return "";
  }
  if (seen.detail < bars.resolved || seen.haze > bars.foggy) {
    return "hazy";
  }
  const surely = seen.detail - seen.detail_noise >= bars.kept && seen.error <= bars.fair;
  return surely && seen.haze <= bars.clear ? "crisp" : "soft";
}

function lookLine({ look: seen }, look) {
  const size = seen.size > 1e-6 ? `1/${fixed(1 / seen.size, 0)}` : "any size";
  const kept = percent(Math.min(Math.max(seen.detail, 0), 1));
  return `look: ${look}, keeps ${kept} of details of ${size} of its width, ${haze(seen.haze)}, `
    + `pictures ${percent(seen.error)} off (their truth's noise ${percent(seen.noise)})`;
}

function haze(value) {
  return Math.abs(value) < 0.02 ? "dark parts right"
    : `dark parts ${percent(Math.abs(value))} too ${value > 0 ? "bright" : "dark"}`;
}

/** What speaks against fast mode. */
function whyNot({ fast, accurate, pattern }) {
  const found = [];
  if (pattern >= bars.pattern && fast.pattern < bars.resolved * Math.min(accurate.pattern, 1)) {
    found.push(`loses its patterns (keeps ${percent(Math.max(fast.pattern, 0))} of their contrast)`);
  }
  if (fast.within > Math.max(bars.smooth, bars.alike * accurate.within)) {
    found.push("makes its light blotchy");
  }
  return found;
}

function fastLine(verdict) {
  const why = whyNot(verdict);
  const said = `within ±${percent(verdict.fast.within)}, ${inTheMean(verdict.fast)}`;
  return why.length ? `fast mode: not recommended, it ${why.join(" and ")}; ${said}`
    : `fast mode: recommended, ${said}`;
}

/** Advice, each with what it follows from. */
function* advice({ near, accurate, by_heart: byHeart, grain }, light, look, provenance) {
  const dim = look === "soft" || look === "hazy";
  const tried = provenance.get("tried_anchors");
  if (dim && provenance.get("anchor") === "none" && !(Array.isArray(tried) && tried.length)) {
    yield "--anchor auto, for a picture seen through glass";
  }
  if (light !== "good" || dim) {
    const preset = provenance.get("preset");
    const known = typeof preset === "string" && Object.hasOwn(LARGER, preset);
    yield known ? `a longer training (--preset ${LARGER[preset]})` : "a longer training";
  }
  if (byHeart !== null && byHeart > bars.by_heart) {
    yield "more photons, as it knows those that it learned from by heart";
  }
  if (grain !== null && grain > bars.grain) {
    yield "many samples per pixel in accurate mode, as its light is hard to aim at";
  }
  if (near && near.within > Math.max(bars.fair, 2 * accurate.within)) {
    yield "no walls or tables within its bounding sphere";
  }
}

function percent(part) {
  const digits = Math.abs(part) < 0.1 ? general(100 * part, 2) : fixed(100 * part, 0);
  return `${digits} %`;
}

function signed(part) {
  return `${part > 0 ? "+" : "-"}${percent(Math.abs(part))}`;
}
