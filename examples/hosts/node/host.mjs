// A PureLight host in Node.js for the conformance suite, written from spec/ alone.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import * as ort from "onnxruntime-node";

const refuse = (reason) => { throw new Error(reason); };
const mapped = (object, change) => Object.fromEntries(Object.entries(object).map(([k, v]) => [k, change(v, k)]));
// An array is a list of rows, a row a flat list of numbers: three, unless its name is one of these.
const SHAPES = { u: [2], disk: [2], radiance_map: [16, 16, 3], pdf_solid_angle: [], pdf_area: [],
  one_minus_cos: [], outside: [], inside: [] };
const TYPES = { "<f4": Float32Array, "<f8": Float64Array, "<u4": Uint32Array };
const shapeOf = (name, rows) => [rows.length, ...(SHAPES[name] ?? [3])];
function rowsOf([count, ...shape], data) {
  const width = shape.reduce((a, b) => a * b, 1);
  return Array.from({ length: count }, (_, n) => Array.from(data.subarray(n * width, (n + 1) * width)));
}
const fromBytes = (type, shape, bytes) => // Copied, because a typed array wants to be aligned.
  rowsOf(shape, new TYPES[type](new Uint8Array(bytes).buffer));
// The bundle (plux.md): a stored zip, walked from its first byte.
function readMembers(file) {
  const members = {};
  for (let at = 0, end; file.readUInt32LE(at) === 0x04034b50; at = end) {
    const begin = at + 30 + file.readUInt16LE(at + 26), start = begin + file.readUInt16LE(at + 28);
    end = start + file.readUInt32LE(at + 18);
    members[file.toString("latin1", at + 30, begin)] = file.subarray(start, end);
  }
  return members;
}
function readNpy(member) {
  const start = 10 + member.readUInt16LE(8);
  const [, type, sizes] = /'descr': '(.*?)'.*'shape': \((.*?),?\)/.exec(member.toString("latin1", 10, start));
  return fromBytes(type, sizes.split(",").map(Number), member.subarray(start));
}
const NETWORKS = ["appearance", "transparency", "sampler", "sampler_pdf", "fast_map"];
let lamp = null;
async function open(path) {
  const members = readMembers(readFileSync(path)), manifest = JSON.parse(members["manifest.json"]);
  if (manifest.format_version.split(".")[0] !== "1") refuse("another major version of the format");
  const digest = (name) => createHash("sha256").update(members[name]).digest("hex");
  mapped(manifest.members, ({ sha256 }, name) => digest(name) === sha256 || refuse(`${name} is damaged`));
  const networks = {};
  for (const name of NETWORKS.filter((network) => network in manifest.networks)) {
    const golden = (tensor) => readNpy(members[`vectors/${name}.${tensor}.npy`]);
    const session = await ort.InferenceSession.create(members[`networks/${name}.onnx`]);
    const inputs = Object.fromEntries(session.inputNames.map((input) => [input, golden(input)]));
    for (const [output, rows] of Object.entries(await evaluate(session, inputs))) {
      const [wanted, allowed] = [output, `${output}.tolerance`].map((tensor) => golden(tensor).flat());
      if (!rows.flat().every((y, k) => Math.abs(y - wanted[k]) <= allowed[k])) refuse(`${name} is wrong here`);
    }
    networks[name] = session;
  }
  const [positions, corners] = ["positions", "triangles"].map((name) => readNpy(members[`surface/${name}.npy`]));
  lamp = { networks, sphere: manifest.bounding_sphere, triangles: corners.map((t) => t.map((k) => positions[k])) };
  return {};
}
const tensor = (rows, name) => new ort.Tensor("float32", Float32Array.from(rows.flat()), shapeOf(name, rows));
async function evaluate(session, inputs) {
  return mapped(await session.run(mapped(inputs, tensor)), ({ dims, data }) => rowsOf(dims, data));
}
const ask = (network, inputs) =>
  (lamp?.networks[network] ? evaluate(lamp.networks[network], inputs) : refuse(`no ${network} network is open`));
// Measures (measures.md).
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], mul = (a, k) => a.map((x) => x * k);
const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i]), sub = (a, b) => add(a, b, -1);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const clip = (x, low, high) => Math.min(high, Math.max(low, x));
function frame([x, y, z]) { // Eq. 1
  const rho = x * x + y * y;
  if (z < 0 && rho < 1e-20) return { tangent: [-1, 0, -x], bitangent: [0, 1, -y] };
  const k = z >= 0 ? 1 / (1 + z) : (1 - z) / rho;
  return { tangent: [1 - k * x * x, -k * x * y, -x], bitangent: [-k * x * y, 1 - k * y * y, -y] };
}
function squareToDisk(u) { // Eq. 2
  const [a, b] = u.map((x) => 2 * x - 1);
  const [r, phi] = Math.abs(a) > Math.abs(b) ? [a, b / a] : [b, 2 - a / (b || 1)]; // φ in units of π/4.
  return [Math.cos, Math.sin].map((f) => r * f((phi * Math.PI) / 4));
}
function diskToSquare([x, y]) { // Eq. 3
  const wide = Math.abs(x) > Math.abs(y), [larger, smaller] = wide ? [x, y] : [y, x];
  const r = Math.sign(larger) * Math.hypot(x, y), t = (r * Math.atan(smaller / (larger || 1))) / (Math.PI / 4);
  return (wide ? [r, t] : [t, r]).map((v) => clip((v + 1) / 2, 0, 1));
}
function cap(point, { center, radius }) { // Eq. 4
  const offset = sub(center, point).map((v) => clip(v / radius, -1e15, 1e15));
  const d = Math.sqrt(dot(offset, offset)), s = Math.min(1, 1 / d);
  return { axis: d > 0 ? mul(offset, 1 / d) : [0, 0, 1], outside: Number(d > 1 + 1e-6),
    one_minus_cos: (s * s) / (1 + Math.sqrt(1 - s * s)) };
}
function capToDirection(u, { axis, one_minus_cos: spread }) { // Eq. 5
  const [x, y] = squareToDisk(u), { tangent, bitangent } = frame(axis);
  const m = (x * x + y * y) * spread, q = Math.sqrt(spread * (2 - m));
  return add(add(mul(axis, 1 - m), tangent, q * x), bitangent, q * y);
}
function directionToCap(v, { axis, one_minus_cos: spread }) { // Eq. 6
  const delta = sub(v, axis), m = dot(delta, delta) / 2, q = Math.sqrt(Math.max(1e-30, spread * (2 - m)));
  const disk = Object.values(frame(axis)).map((side) => dot(delta, side) / q), reach = Math.hypot(...disk);
  return { u: diskToSquare(mul(disk, 1 / Math.max(1, reach))), inside: Number(reach <= 1 && m <= 1.5) };
}
function placement({ to_world: matrix, dimmer = 1 }) { // Eq. 11
  const rows = (matrix ?? [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]).slice(0, 3);
  const volume = dot(rows[0], cross(rows[1], rows[2])), scale = Math.cbrt(volume);
  if (!(volume > 0)) refuse("to_world mirrors or flattens the lamp");
  const turn = rows.map((row) => mul(row.slice(0, 3), 1 / scale));
  const uneven = (a, i) => turn.some((b, j) => Math.abs(dot(a, b) - (i === j)) > 1e-4);
  if (turn.some(uneven)) refuse("to_world shears the lamp or scales its axes differently");
  const inward = (v) => [0, 1, 2].map((j) => dot(v, turn.map((row) => row[j])));
  const local = (p) => mul(inward(p.map((x, i) => x - rows[i][3])), 1 / scale);
  return { dimmer, inward, local, outward: (v) => turn.map((row) => dot(row, v)) };
}
function meet(origin, direction) { // Where a ray first meets the exit surface: inputs of the networks.
  let first = { depth: Infinity };
  for (const [a, b, c] of lamp.triangles) {
    const ab = sub(b, a), ac = sub(c, a), normal = cross(ab, ac);
    const area = dot(normal, normal), speed = dot(normal, direction);
    const depth = dot(normal, sub(a, origin)) / speed, at = sub(add(origin, direction, depth), a);
    const v = dot(cross(at, ac), normal) / area, w = dot(cross(ab, at), normal) / area;
    if (!(depth > 0 && depth < first.depth && v >= 0 && w >= 0 && v + w <= 1)) continue;
    first = { depth, position: add(a, at), normal: mul(normal, -Math.sign(speed) / Math.sqrt(area)) };
  }
  return first.position && { ...first, outgoing: mul(direction, -1) };
}
async function seen(network, hits) { // What a network says where rays meet the surface, 0 where they miss.
  const column = (_, name) => hits.filter(Boolean).map((hit) => hit[name]);
  const [answers] = Object.values(await ask(network, mapped({ position: 0, normal: 0, outgoing: 0 }, column)));
  return hits.map((hit) => (hit ? answers.shift() : [0, 0, 0]));
}
// Operations (conformance.md): arrays by name and parameters to arrays by name.
const each = (run) => (inputs, given) => { // One row at a time; a row of zeros tells the outputs' names.
  const rows = Object.values(inputs)[0].map((_, n) => run(mapped(inputs, (column) => column[n]), given));
  return mapped(run(mapped(inputs, () => [0, 0, 1]), given), (_, name) => rows.map((row) => row[name]));
};
function pick({ point, normal, u, cells }, { dimmer, inward, local }) { // Eq. 13
  const view = cap(local(point), lamp.sphere), colours = rowsOf([256, 3], Float64Array.from(cells));
  const power = colours.map((rgb) => dot(rgb, [0.2126, 0.7152, 0.0722])), total = power.reduce((a, b) => a + b);
  let k = 0, before = 0;
  while (k < 255 && before + power[k] <= u[0] * total) before += power[k++];
  const square = [(k % 16) + (u[0] * total - before) / (power[k] || 1), Math.floor(k / 16) + u[1]];
  const share = view.outside && power[k] > 0 ? (total * 2 * Math.PI * view.one_minus_cos) / (256 * power[k]) : 0;
  const toward = capToDirection(mul(square, 1 / 16), view);
  return { irradiance: mul(colours[k], dimmer * share * Math.max(0, dot(toward, inward(normal)))) };
}
const OPERATIONS = {
  frame: each(({ axis }) => frame(axis)),
  square_to_disk: each(({ u }) => ({ disk: squareToDisk(u) })),
  disk_to_square: each(({ disk }) => ({ u: diskToSquare(disk) })),
  cap: each(({ point }, given) => cap(point, given.bounding_sphere)),
  cap_to_direction: each(({ point, u }, given, view = cap(point, given.bounding_sphere)) =>
    ({ toward: capToDirection(u, view), pdf_solid_angle: view.outside / (2 * Math.PI * view.one_minus_cos) })),
  direction_to_cap: each(({ point, toward }, given) => directionToCap(toward, cap(point, given.bounding_sphere))),
  area_to_solid_angle: each(({ point, position, normal, pdf_area }) => { // Eq. 8
    const offset = sub(position, point);
    return { pdf_solid_angle: (pdf_area[0] * Math.hypot(...offset) ** 3) / Math.abs(dot(offset, normal)) };
  }),
  async instance_radiance({ position, normal, outgoing }, given) {
    const { local, inward, dimmer } = placement(given), side = (n, k) => mul(n, dot(n, outgoing[k]) < 0 ? -1 : 1);
    const feed = { position: position.map(local), normal: normal.map(side).map(inward), outgoing: outgoing.map(inward) };
    return { radiance: (await ask("appearance", feed)).radiance.map((rgb) => mul(rgb, dimmer)) };
  },
  async instance_sample({ point, u }, given) {
    const { local, outward } = placement(given), drawn = await ask("sampler", { point: point.map(local), u });
    return { ...drawn, toward: drawn.toward.map(outward) };
  },
  async view({ origin, direction }, given) {
    const { local, inward, dimmer } = placement(given);
    const hits = origin.map((o, k) => meet(local(o), inward(direction[k])));
    const light = await seen("appearance", hits);
    const clear = lamp.networks.transparency && (await seen("transparency", hits));
    const behind = (hit, k) => given.background.map((b, i) => (hit ? b * (clear?.[k][i] ?? 0) : b));
    return { radiance: hits.map((hit, k) => add(behind(hit, k), light[k], dimmer)) };
  },
  async estimate({ point, normal, u }, given) { // Eq. 10
    const place = placement(given), drawn = await OPERATIONS.instance_sample({ point, u }, given);
    const cosine = drawn.toward.map((toward, k) => Math.max(0, dot(toward, normal[k])));
    const weight = drawn.pdf_solid_angle.map(([pdf], k) => (pdf > 0 ? (place.dimmer * cosine[k]) / pdf : 0));
    const hits = point.map((p, k) => meet(place.local(p), place.inward(drawn.toward[k])));
    return { irradiance: (await seen("appearance", hits)).map((rgb, k) => mul(rgb, weight[k])) };
  },
  async map_estimate({ point, normal, u }, given) {
    const place = placement(given), drawn = await ask("fast_map", { point: point.map(place.local) });
    return each((row) => pick(row, place))({ point, normal, u, cells: drawn.radiance_map });
  },
};
for (const name of NETWORKS) OPERATIONS[name] = (inputs) => ask(name, inputs);
// The protocol.
const encode = (rows, name) => ({ dtype: "<f8", shape: shapeOf(name, rows),
  data: Buffer.from(Float64Array.from(rows.flat()).buffer).toString("base64") });
async function answer({ do: task, bundle, operation, parameters, inputs }) {
  if (task === "hello") return { protocol: "1.0", host: "node", version: "1", operations: Object.keys(OPERATIONS) };
  if (task === "open") { lamp = null; return open(bundle); }
  if (task !== "evaluate" || !(operation in OPERATIONS)) refuse(`cannot ${task} ${operation}`);
  const arrays = mapped(inputs, ({ dtype, shape, data }) => fromBytes(dtype, shape, Buffer.from(data, "base64")));
  return { outputs: mapped(await OPERATIONS[operation](arrays, parameters), encode) };
}
for await (const line of createInterface({ input: process.stdin })) {
  const request = JSON.parse(line);
  const reply = await answer(request).catch((error) => ({ refused: String(error.message).split("\n")[0] }));
  process.stdout.write(`${JSON.stringify({ id: request.id, ...reply })}\n`);
}
