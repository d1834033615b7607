// Arrays as rows: a list with a flat list of numbers for each point, direction or map.

const TYPES = { "<f4": Float32Array, "<f8": Float64Array, "<u4": Uint32Array };

// What a row holds by the name of its array (conformance.md); what is not named here is a vector.
const SHAPES = {
  u: [2],
  disk: [2],
  radiance_map: [16, 16, 3],
  pdf_solid_angle: [],
  pdf_area: [],
  one_minus_cos: [],
  outside: [],
  inside: [],
};

/** An object with the same names whose values are changed. */
export function mapValues(object, change) {
  const entries = Object.entries(object);
  return Object.fromEntries(entries.map(([name, value]) => [name, change(value, name)]));
}

/** The shape of an array of this name. */
export function shapeOf(name, rows) {
  return [rows.length, ...(SHAPES[name] ?? [3])];
}

/** Rows of a typed array. */
export function toRows([count, ...shape], data) {
  const width = shape.reduce((product, size) => product * size, 1);
  const row = (n) => Array.from(data.subarray(n * width, (n + 1) * width));
  return Array.from({ length: count }, (_, n) => row(n));
}

/** Rows of little-endian bytes, which are copied because a typed array wants to be aligned. */
export function fromBytes(type, shape, bytes) {
  return toRows(shape, new TYPES[type](new Uint8Array(bytes).buffer));
}

/** Rows of an array of the protocol (H5). */
export function decode({ dtype, shape, data }) {
  return fromBytes(dtype, shape, Buffer.from(data, "base64"));
}

/** An array of the protocol (H5). */
export function encode(rows, name) {
  const bytes = Buffer.from(Float64Array.from(rows.flat()).buffer);
  return { dtype: "<f8", shape: shapeOf(name, rows), data: bytes.toString("base64") };
}
