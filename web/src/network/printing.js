// How each operator is printed as GLSL: from values to values (`glsl.js`).

import { BOOL, FLOAT } from "../format/tensors.js";
import { arrangement, axisOf, choices, groups, lines, spread } from "./arrange.js";
import { Bounds } from "./bounds.js";
import { blocks, paddedRows } from "./store.js";
import { kindOf, number, Value } from "./writer.js";

const LEAST_VECTOR = 8; // Elements from which an operation is written as a loop over vec4.
const SPARSE = 48; // Weights up to which a product is written out.
const TERMS = 8; // Of a sum in one line; browsers bound how deep an expression is.
// Least and largest floats that are whole numbers of a kind.
const RANGES = { int: [-2147483648, 2147483520], long: [-(2 ** 63), 9223371487098961920] };
const WIDE_ROW = 8; // Texels of a table's row from which a lookup is a loop.

// Elementwise operations by name and kind; {0} stands for the first operand.
const CALLS = {
  Abs: { float: "abs({0})", int: "abs({0})", long: "pl_long_abs({0})" },
  Add: { float: "{0} + {1}", int: "{0} + {1}", long: "pl_long_add({0}, {1})" },
  And: { bool: "{0} && {1}" },
  Asin: { float: "pl_asin({0})" },
  Atan: { float: "pl_atan({0})" },
  Cos: { float: "pl_cos({0})" },
  Div: { float: "{0} / {1}", int: "pl_quotient({0}, {1})", long: "pl_long_quotient({0}, {1})" },
  Equal: { float: "{0} == {1}", int: "{0} == {1}", long: "{0} == {1}", bool: "{0} == {1}" },
  Exp: { float: "exp({0})" },
  Floor: { float: "floor({0})" },
  Greater: { float: "{0} > {1}", int: "{0} > {1}", long: "pl_long_less({1}, {0})" },
  GreaterOrEqual: { float: "{0} >= {1}", int: "{0} >= {1}", long: "!pl_long_less({0}, {1})" },
  Less: { float: "{0} < {1}", int: "{0} < {1}", long: "pl_long_less({0}, {1})" },
  LessOrEqual: { float: "{0} <= {1}", int: "{0} <= {1}", long: "!pl_long_less({1}, {0})" },
  Log: { float: "log({0})" },
  Max: { float: "max({0}, {1})", int: "max({0}, {1})", long: "pl_long_max({0}, {1})" },
  Min: { float: "min({0}, {1})", int: "min({0}, {1})", long: "pl_long_min({0}, {1})" },
  Mod: { float: "pl_rest({0}, {1})", int: "pl_modulo({0}, {1})", long: "pl_long_modulo({0}, {1})" },
  Mul: { float: "{0} * {1}", int: "{0} * {1}", long: "pl_long_mul({0}, {1})" },
  Neg: { float: "-{0}", int: "-{0}", long: "pl_long_neg({0})" },
  Not: { bool: "!{0}" },
  Or: { bool: "{0} || {1}" },
  Reciprocal: { float: "1.0 / {0}" },
  Relu: { float: "max({0}, 0.0)" },
  Sigmoid: { float: "1.0 / (1.0 + exp(-{0}))" },
  Sign: { float: "sign({0})", int: "sign({0})", long: "pl_long_sign({0})" },
  Sin: { float: "pl_sin({0})" },
  Sqrt: { float: "sqrt({0})" },
  Sub: { float: "{0} - {1}", int: "{0} - {1}", long: "pl_long_sub({0}, {1})" },
  Where: { float: "{0} ? {1} : {2}", int: "{0} ? {1} : {2}", long: "{0} ? {1} : {2}" },
};

// Those of which GLSL has the same on vectors.
const ON_VECTORS = new Set(["Abs", "Add", "Div", "Exp", "Floor", "Log", "Max", "Min", "Mul", "Neg",
  "Reciprocal", "Relu", "Sigmoid", "Sign", "Sqrt", "Sub"]);

const CONVERSIONS = {
  "bool float": "({0} ? 1.0 : 0.0)",
  "bool int": "({0} ? 1 : 0)",
  "bool long": "uvec2({0} ? 1u : 0u, 0u)",
  "float bool": "({0} != 0.0)",
  "int bool": "({0} != 0)",
  "int float": "float({0})",
  "int long": "pl_to_long({0})",
  "long bool": "({0} != uvec2(0u))",
  "long float": "pl_long_to_float({0})",
  "long int": "pl_to_int({0})",
};

function filled(template, operands) {
  return template.replace(/\{(\d)\}/g, (_, k) => operands[k]);
}

/** The text of an element as one of another kind. */
function converted(text, from, to) {
  return from === to ? text : filled(CONVERSIONS[`${from} ${to}`], [text]);
}

// Elementwise

function elementwise({ writer, node, given, tensors, bounds }) {
  return [apply(writer, node.op, given, node.inputs, tensors[0], bounds[0])];
}

/** An operation on the elements of operands, broadcast as ONNX does. */
function apply(writer, op, given, inputs, tensor, bounds) {
  if (isVectorial(op, given, inputs, tensor)) {
    return loop(writer, op, given, inputs, tensor, bounds);
  }
  const kind = kindOf(tensor.type, bounds);
  const numbers = given.filter((value) => value.kind !== "bool" || tensor.type === BOOL);
  const wide = [...numbers.map((value) => value.kind), kind].includes("long");
  const work = wide ? "long" : numbers[0].kind;
  const template = CALLS[op][work];
  const maps = inputs.map((input) => spread(input, tensor.shape));
  const texts = Array.from({ length: tensor.size }, (_, k) => {
    const operands = given.map((value, i) => {
      const text = value.elements[maps[i][k]];
      return value.kind === "bool" ? text : converted(text, value.kind, work);
    });
    const text = filled(template, operands);
    return tensor.type === BOOL ? text : converted(wide ? `(${text})` : text, work, kind);
  });
  return writer.scalars(kind, texts, bounds);
}

function isVectorial(op, given, inputs, tensor) {
  if (tensor.type !== FLOAT || tensor.size < LEAST_VECTOR || !ON_VECTORS.has(op)) {
    return false;
  }
  const fits = (value, input) => value.size === 1 || (value.size === tensor.size
    && (value.isVector || input.isConstant));
  return given.every((value, k) => fits(value, inputs[k])) && given.some((v) => v.isVector);
}

/** The same as a loop over an array of vec4. */
function loop(writer, op, given, inputs, tensor, bounds) {
  const operands = given.map((value, k) => {
    if (value.size === 1) {
      return `vec4(${value.elements[0]})`;
    }
    if (value.isVector) {
      return `${value.array}[i]`;
    }
    return `pl_four(${plainPlace(writer, inputs[k].value)} + i)`;
  });
  const array = writer.array(tensor.size);
  const length = Math.ceil(tensor.size / 4);
  const text = filled(CALLS[op].float, operands);
  writer.add(`for (int i = 0; i < ${length}; i++) { ${array}[i] = ${text}; }`);
  return writer.vector(array, tensor.size, bounds);
}

/** Any number of operands, two at a time. */
function folded({ writer, node, given, tensors, bounds }) {
  const [tensor] = tensors;
  if (given.length === 1) {
    return [repeated(given[0], node.inputs[0], tensor, bounds[0])];
  }
  const choose = node.op === "Max" ? Math.max : Math.min;
  let [value, input] = [given[0], node.inputs[0]];
  for (const [k, other] of given.slice(1).entries()) {
    const both = [value, other].map(({ bounds: b }, i) =>
      b.pick(spread([input, node.inputs[k + 1]][i], tensor.shape)));
    const end = (name) => both[0][name].map((x, i) => choose(x, both[1][name][i]));
    const found = new Bounds(end("low"), end("high"));
    value = apply(writer, node.op, [value, other], [input, node.inputs[k + 1]], tensor, found);
    input = tensor;
  }
  return [value];
}

function repeated(value, input, tensor, bounds) {
  const map = spread(input, tensor.shape);
  return new Value(value.kind, Array.from(map, (k) => value.elements[k]), bounds, value.array);
}

function clip({ writer, node, given, tensors, bounds }) {
  let [value] = given;
  const [tensor] = tensors;
  for (const [k, op] of [[1, "Max"], [2, "Min"]]) {
    if (given[k]) {
      const choose = op === "Max" ? Math.max : Math.min;
      const limit = given[k].bounds.low[0];
      const found = new Bounds(value.bounds.low.map((x) => choose(x, limit)),
        value.bounds.high.map((x) => choose(x, limit)));
      value = apply(writer, op, [value, given[k]], [tensor, node.inputs[k]], tensor, found);
    }
  }
  return [new Value(value.kind, value.elements, bounds[0], value.array)];
}

function cast({ writer, given, tensors, bounds }) {
  const [value] = given;
  const [tensor] = tensors;
  const kind = kindOf(tensor.type, bounds[0]);
  if (kind === value.kind) {
    return [new Value(kind, value.elements, bounds[0], value.array)];
  }
  if (value.kind !== "float" || tensor.type === BOOL) {
    const texts = value.elements.map((text) => converted(text, value.kind, kind));
    return [writer.scalars(kind, texts, bounds[0])];
  }
  const [least, most] = RANGES[kind].map((value) => number("float", value));
  const cut = (text) => `clamp(${text}, ${least}, ${most})`;
  const texts = value.elements.map((text) =>
    kind === "int" ? `int(${cut(text)})` : `pl_float_to_long(${cut(text)})`);
  return [writer.scalars(kind, texts, bounds[0])];
}

// Products

function gemm({ writer, node, given, bounds }) {
  const [, weight, bias] = node.inputs;
  return [multiplied(writer, given[0], weight, bias, true, bounds[0])];
}

function matmul({ writer, node, given, bounds }) {
  return [multiplied(writer, given[0], node.inputs[1], null, false, bounds[0])];
}

function multiplied(writer, value, weight, bias, transposed, bounds) {
  const [size, out] = [value.size, weight.size / value.size];
  const at = (o, i) => weight.value[transposed ? o * size + i : i * out + o];
  const filledIn = weight.value.reduce((count, w) => count + (w !== 0 ? 1 : 0), 0);
  if (filledIn <= Math.max(SPARSE, out)) {
    const texts = Array.from({ length: out }, (_, o) => terms(value, size, (i) => at(o, i),
      bias ? bias.value[o] : 0));
    return new Value("float", texts.map((parts) => sum(writer, parts)), bounds);
  }
  const x = writer.packed(value);
  const [rows, columns] = [Math.ceil(out / 4), Math.ceil(size / 4)];
  const layout = transposed ? "blocks of rows" : "blocks of columns";
  const start = writer.store.add("four", weight.value, layout, () =>
    blocks(weight.value, out, size, transposed));
  const y = writer.array(out);
  const first = bias ? `pl_four(${plainPlace(writer, bias.value)} + o)` : "vec4(0.0)";
  const place = `${start} + (o * ${columns} + i) * 4`;
  writer.add(`for (int o = 0; o < ${rows}; o++) {
  vec4 sum = ${first};
  for (int i = 0; i < ${columns}; i++) {
    int w = ${place};
    sum += mat4(pl_four(w), pl_four(w + 1), pl_four(w + 2), pl_four(w + 3)) * ${x}[i];
  }
  ${y}[o] = sum;
}`);
  return writer.vector(y, out, bounds);
}

/** Where numbers lie one after the other, in fours. */
function plainPlace(writer, numbers) {
  return writer.store.add("four", numbers, "as they are", () => numbers);
}

/** Terms of a sum that is written out. */
function terms(value, size, weight, bias) {
  const parts = bias === 0 ? [] : [number("float", bias)];
  for (let i = 0; i < size; i++) {
    const w = weight(i);
    if (w !== 0) {
      parts.push(w === 1 ? value.elements[i] : `${number("float", w)} * ${value.elements[i]}`);
    }
  }
  return parts.length ? parts : ["0.0"];
}

/** The name of a sum, a few terms in each line. */
function sum(writer, parts) {
  let name = writer.element("float", parts.slice(0, TERMS).join(" + "));
  for (let k = TERMS; k < parts.length; k += TERMS) {
    name = writer.element("float", [name, ...parts.slice(k, k + TERMS)].join(" + "));
  }
  return name;
}

// Along an axis

function softmax({ writer, node, given, tensors, bounds }) {
  const [{ elements }] = given;
  const results = new Array(elements.length);
  for (const line of lines(tensors[0].shape, axisOf(node, node.attribute("axis", -1)))) {
    const peak = line.map((k) => elements[k]).reduce((a, b) => {
      return writer.element("float", `max(${a}, ${b})`);
    });
    const powers = line.map((k) => writer.element("float", `exp(${elements[k]} - ${peak})`));
    const total = sum(writer, powers);
    line.forEach((k, i) => (results[k] = writer.element("float", `${powers[i]} / ${total}`)));
  }
  return [new Value("float", results, bounds[0])];
}

function cumsum({ writer, node, given, tensors, bounds }) {
  const kind = kindOf(tensors[0].type, bounds[0]);
  const texts = given[0].elements.map((text) => converted(text, given[0].kind, kind));
  const [reverse, exclusive] = ["reverse", "exclusive"].map((name) => node.attribute(name, 0));
  const results = new Array(texts.length);
  for (const line of lines(tensors[0].shape, axisOf(node, node.inputs[1].value[0]))) {
    const order = reverse ? line.toReversed() : line;
    let total = exclusive ? number(kind, kind === "long" ? 0n : 0) : texts[order[0]];
    order.forEach((k, i) => {
      results[k] = total;
      const next = texts[exclusive ? k : order[i + 1]];
      if (i + 1 < order.length) {
        total = writer.element(kind, filled(CALLS.Add[kind], [total, next]));
      }
    });
  }
  return [new Value(kind, results, bounds[0])];
}

function reduce(op) {
  return ({ writer, node, given, tensors, bounds }) => {
    const kind = kindOf(tensors[0].type, bounds[0]);
    const wide = given[0].kind === "long" ? "long" : kind;
    const texts = given[0].elements.map((text) => converted(text, given[0].kind, wide));
    const results = groups(node).map((group) => {
      const parts = group.map((k) => texts[k]);
      const made = op === "Add" && wide !== "long" ? total(writer, wide, parts)
        : parts.reduce((a, b) => writer.element(wide, filled(CALLS[op][wide], [a, b])));
      return converted(made, wide, kind);
    });
    return [new Value(kind, results, bounds[0])];
  };
}

function total(writer, kind, parts) {
  if (kind === "float") {
    return sum(writer, parts);
  }
  return parts.reduce((a, b) => writer.element(kind, `${a} + ${b}`));
}

// Lookup and arrangement

function arrange({ writer, node, given, tensors, bounds }) {
  const kinds = new Set(given.filter((value, k) => !node.inputs[k]?.isConstant).map((v) => v.kind));
  const kind = kinds.size > 1 ? "long" : [...kinds][0];
  return arrangement(node, tensors).map(({ source, from }, o) => {
    const element = (at, k) => {
      const value = given[source === 0 ? 0 : source[k]];
      return converted(value.elements[at], value.kind, kind);
    };
    const elements = Array.from(from, element);
    const same = given[0].isVector && from.length === given[0].size && source === 0
      && from.every((at, k) => at === k);
    const array = same ? given[0].array : arrayOf(elements);
    return narrowed(writer, new Value(kind, elements, bounds[o], array), tensors[o]);
  });
}

/** The array of vec4 whose elements these are from the first to the last, if they are. */
function arrayOf(elements) {
  const found = /^(v\d+)\[0\]\.x$/.exec(elements[0]);
  if (!found || elements.length < LEAST_VECTOR) {
    return null;
  }
  const fits = (text, k) => text === `${found[1]}[${k >> 2}].${"xyzw"[k & 3]}`;
  return elements.every(fits) ? found[1] : null;
}

/** Whole numbers of 64 bits in 32, where only they are left. */
function narrowed(writer, value, tensor) {
  const kind = kindOf(tensor.type, value.bounds);
  if (kind === value.kind || value.kind === "float" || value.kind === "bool") {
    return value;
  }
  return new Value(kind, value.elements.map((text) => converted(text, value.kind, kind)),
    value.bounds);
}

function gather(given) {
  const { writer, node, tensors, bounds } = given;
  const [table, index] = node.inputs;
  if (!table.isConstant) {
    return arrange({ ...given, given: given.given.slice(0, 1) });
  }
  const width = table.size / table.shape[0];
  const places = given.given[1].elements.map((text, k) =>
    place(writer, text, given.given[1], k, table.shape[0]));
  const read = table.type === FLOAT ? floats : wholes;
  const kind = kindOf(tensors[0].type, bounds[0]);
  const value = read(writer, table, width, places, kind);
  return [new Value(kind, value.elements, bounds[0], index.size === 1 ? value.array : null)];
}

/** The name of an index that is inside a table, whatever was computed. */
function place(writer, text, { kind, bounds }, k, size) {
  if (kind === "long") {
    return writer.element("int", `pl_long_place(${text}, ${size})`);
  }
  const inside = bounds.low[k] >= 0 ? `clamp(${text}, 0, ${size - 1})` : `pl_place(${text}, ${size})`;
  return writer.element("int", inside);
}

/** Rows of a table of floats: ones, twos, or as many fours as they need. */
function floats(writer, table, width, places) {
  const { store } = writer;
  if (width <= 2) {
    const format = width === 1 ? "one" : "two";
    const start = store.add(format, table.value, "rows", () => table.value);
    const texts = places.map((at) => `pl_${format}(${start} + ${at})`);
    if (width === 1) {
      return writer.scalars("float", texts, null);
    }
    const names = texts.map((text) => vector(writer, "vec2", text));
    return new Value("float", names.flatMap((name) => [`${name}.x`, `${name}.y`]), null);
  }
  const start = store.add("four", table.value, "rows", () => paddedRows(table.value, width));
  const length = Math.ceil(width / 4);
  const rows = places.map((at) => (length > WIDE_ROW
    ? wideRow(writer, start, at, length, width) : shortRow(writer, start, at, length, width)));
  const [only] = rows;
  return rows.length === 1 ? only : new Value("float", rows.flatMap((row) => row.elements), null);
}

function vector(writer, type, text) {
  const name = writer.name();
  writer.add(`${type} ${name} = ${text};`);
  return name;
}

function shortRow(writer, start, at, length, width) {
  const names = Array.from({ length }, (_, k) =>
    vector(writer, "vec4", `pl_four(${start + k} + ${at} * ${length})`));
  const element = (_, k) => `${names[k >> 2]}.${"xyzw"[k & 3]}`;
  return new Value("float", Array.from({ length: width }, element), null);
}

function wideRow(writer, start, at, length, width) {
  const array = writer.array(width);
  const text = `pl_four(${start} + ${at} * ${length} + i)`;
  writer.add(`for (int i = 0; i < ${length}; i++) { ${array}[i] = ${text}; }`);
  return writer.vector(array, width, null);
}

/** Rows of a table of whole numbers or truth values; long ones take two places each. */
function wholes(writer, table, width, places, kind) {
  const long = kind === "long";
  const [step, numbers] = long ? [2, pairs] : [1, shorts];
  const start = writer.store.add("whole", table.value, "rows", () => numbers(table.value));
  const texts = places.flatMap((at) => Array.from({ length: width }, (_, k) => {
    const read = (extra) => `pl_whole(${start + k * step + extra} + ${at} * ${width * step})`;
    return long ? `uvec2(${read(0)}, ${read(1)})` : converted(read(0), "int", kind);
  }));
  return writer.scalars(kind, texts, null);
}

function shorts(values) {
  return Int32Array.from(values, Number);
}

function pairs(values) {
  return new Int32Array(BigInt64Array.from(values, BigInt).buffer);
}

/** Columns of a row by a computed index. */
function gatherElements({ writer, node, given, bounds }) {
  const { first, step, size } = choices(node);
  const [x, index] = given;
  const texts = Array.from(first, (start, k) => {
    const at = place(writer, index.elements[k], index, k, size);
    return `${lineOf(writer, x, start, step, size)}[${at}]`;
  });
  const value = writer.scalars(x.kind, texts, bounds[0]);
  return [narrowed(writer, value, { type: node.inputs[0].type })];
}

/** The name of an array that holds the elements of a line. */
function lineOf(writer, value, start, step, size) {
  value.lines ??= new Map();
  if (!value.lines.has(start)) {
    const type = { float: "float", int: "int", long: "uvec2", bool: "bool" }[value.kind];
    const elements = Array.from({ length: size }, (_, k) => value.elements[start + k * step]);
    const name = writer.name();
    writer.fours += Math.ceil(size / 4);
    writer.add(`${type} ${name}[${size}] = ${type}[${size}](${elements.join(", ")});`);
    value.lines.set(start, name);
  }
  return value.lines.get(start);
}

/** By name: from { writer, node, given, tensors, bounds } to a value for each output. */
export const RULES = {
  ...Object.fromEntries(Object.keys(CALLS).map((op) => [op, elementwise])),
  Cast: cast,
  Clip: clip,
  Concat: arrange,
  CumSum: cumsum,
  Gather: gather,
  GatherElements: gatherElements,
  Gemm: gemm,
  Identity: arrange,
  MatMul: matmul,
  Max: folded,
  Min: folded,
  ReduceMax: reduce("Max"),
  ReduceSum: reduce("Add"),
  Reshape: arrange,
  Slice: arrange,
  Softmax: softmax,
  Split: arrange,
  Squeeze: arrange,
  Transpose: arrange,
  Unsqueeze: arrange,
};
