// Operations (conformance.md): from arrays by name, and parameters, to arrays by name.

import { mapValues, toRows } from "./arrays.mjs";
import { NETWORKS } from "./lamp.mjs";
import {
  areaToSolidAngle,
  cap,
  capToDirection,
  directionToCap,
  diskToSquare,
  frame,
  solidAngle,
  squareToDisk,
  uniformPdf,
} from "./measures.mjs";
import { Placement } from "./placement.mjs";
import { meet } from "./surface.mjs";
import { dot, scaled, sum } from "./vectors.mjs";

const LUMINANCE = [0.2126, 0.7152, 0.0722];
const SIDE = 16; // Cells of the radiance map along a side.
const NOTHING = [0, 0, 0];

// Pure geometry, one row at a time.

function frameOf({ axis }) {
  return frame(axis);
}

function diskOf({ u }) {
  return { disk: squareToDisk(u) };
}

function squareOf({ disk }) {
  return { u: diskToSquare(disk) };
}

function capOf({ point }, { bounding_sphere: sphere }) {
  const { axis, oneMinusCos, outside } = cap(point, sphere);
  return { axis, one_minus_cos: oneMinusCos, outside: Number(outside) };
}

function directionOf({ point, u }, { bounding_sphere: sphere }) {
  const view = cap(point, sphere);
  return { toward: capToDirection(u, view), pdf_solid_angle: uniformPdf(view) };
}

function squareOfDirection({ point, toward }, { bounding_sphere: sphere }) {
  const { u, inside } = directionToCap(toward, cap(point, sphere));
  return { u, inside: Number(inside) };
}

function pdfOfArea({ point, position, normal, pdf_area: [pdfArea] }) {
  return { pdf_solid_angle: areaToSolidAngle(pdfArea, point, position, normal) };
}

/** An operation on all rows by one on a row, which gives the names of its `outputs`. */
function eachRow(outputs, operation) {
  return (_, inputs, parameters) => {
    const first = Object.values(inputs)[0];
    const row = (n) => mapValues(inputs, (column) => column[n]);
    const results = first.map((_, n) => operation(row(n), parameters));
    return Object.fromEntries(outputs.map((name) => [name, results.map((result) => result[name])]));
  };
}

// The lamp in the world.

/** Eq. 11. */
async function instanceRadiance(lamp, { position, normal, outgoing }, parameters) {
  const place = new Placement(parameters);
  const facing = normal.map((n, k) => scaled(n, dot(n, outgoing[k]) < 0 ? -1 : 1));
  const { radiance } = await lamp.ask("appearance", {
    position: position.map((x) => place.point(x)),
    normal: facing.map((n) => place.direction(n)),
    outgoing: outgoing.map((v) => place.direction(v)),
  });
  return { radiance: radiance.map((rgb) => scaled(rgb, place.dimmer)) };
}

async function instanceSample(lamp, { point, u }, parameters) {
  const place = new Placement(parameters);
  const drawn = await lamp.ask("sampler", { point: point.map((p) => place.point(p)), u });
  return { ...drawn, toward: drawn.toward.map((v) => place.outward(v)) };
}

/** Where rays of the world meet the lamp, in its own frame. */
function meetAll(lamp, place, origin, direction) {
  return origin.map((o, k) => meet(lamp.triangles, place.point(o), place.direction(direction[k])));
}

/** What a network says where rays meet the surface, nothing where they miss it. */
async function seen(lamp, network, hits) {
  const met = hits.filter(Boolean);
  const outputs = await lamp.ask(network, {
    position: met.map((hit) => hit.position),
    normal: met.map((hit) => hit.normal),
    outgoing: met.map((hit) => hit.outgoing),
  });
  const [answers] = Object.values(outputs);
  return hits.map((hit) => (hit ? answers.shift() : NOTHING));
}

async function view(lamp, { origin, direction }, parameters) {
  const place = new Placement(parameters);
  const hits = meetAll(lamp, place, origin, direction);
  const light = await seen(lamp, "appearance", hits);
  const opaque = hits.map(() => NOTHING);
  const clear = lamp.has("transparency") ? await seen(lamp, "transparency", hits) : opaque;
  const radiance = hits.map((hit, k) => {
    const behind = parameters.background.map((b, i) => (hit ? b * clear[k][i] : b));
    return sum(behind, scaled(light[k], place.dimmer));
  });
  return { radiance };
}

/** Eq. 10 with a brdf of 1: the irradiance by one direction of the sampler. */
async function estimate(lamp, { point, normal, u }, parameters) {
  const place = new Placement(parameters);
  const { toward, pdf_solid_angle: pdf } = await instanceSample(lamp, { point, u }, parameters);
  const light = await seen(lamp, "appearance", meetAll(lamp, place, point, toward));
  const irradiance = light.map((rgb, k) => {
    const [density] = pdf[k];
    const cosine = Math.max(0, dot(toward[k], normal[k]));
    return scaled(rgb, density > 0 ? (place.dimmer * cosine) / density : 0);
  });
  return { irradiance };
}

/** Eq. 13: the irradiance by one direction of the radiance map. */
async function mapEstimate(lamp, { point, normal, u }, parameters) {
  const place = new Placement(parameters);
  const local = point.map((p) => place.point(p));
  const { radiance_map: maps } = await lamp.ask("fast_map", { point: local });
  const irradiance = maps.map((map, k) => {
    const { toward, weight, radiance } = drawFromMap(map, cap(local[k], lamp.sphere), u[k]);
    const cosine = Math.max(0, dot(toward, place.direction(normal[k])));
    return scaled(radiance, place.dimmer * weight * cosine);
  });
  return { irradiance };
}

/** A direction through a cell drawn by its luminance, one over its density, the cell's radiance. */
function drawFromMap(map, view, [first, second]) {
  const cells = toRows([SIDE * SIDE, 3], Float64Array.from(map));
  const power = cells.map((rgb) => dot(rgb, LUMINANCE));
  const total = power.reduce((a, b) => a + b);
  let chosen = 0;
  let before = 0;
  while (chosen < power.length - 1 && before + power[chosen] <= first * total) {
    before += power[chosen++];
  }
  const lit = view.outside && power[chosen] > 0;
  const column = (chosen % SIDE) + (lit ? (first * total - before) / power[chosen] : 0);
  const row = Math.floor(chosen / SIDE) + second;
  return {
    toward: capToDirection([column / SIDE, row / SIDE], view),
    weight: lit ? (total * solidAngle(view)) / (power.length * power[chosen]) : 0,
    radiance: cells[chosen],
  };
}

export const OPERATIONS = {
  frame: eachRow(["tangent", "bitangent"], frameOf),
  square_to_disk: eachRow(["disk"], diskOf),
  disk_to_square: eachRow(["u"], squareOf),
  cap: eachRow(["axis", "one_minus_cos", "outside"], capOf),
  cap_to_direction: eachRow(["toward", "pdf_solid_angle"], directionOf),
  direction_to_cap: eachRow(["u", "inside"], squareOfDirection),
  area_to_solid_angle: eachRow(["pdf_solid_angle"], pdfOfArea),
  instance_radiance: instanceRadiance,
  instance_sample: instanceSample,
  view,
  estimate,
  map_estimate: mapEstimate,
};
for (const network of NETWORKS) {
  OPERATIONS[network] = (lamp, inputs) => lamp.ask(network, inputs);
}
