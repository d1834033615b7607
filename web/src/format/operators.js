// The operators of the profile (onnx_profile.md, N10 to N13): how shapes follow from the inputs.

import { fail } from "./issues.js";
import { LIMITS, OPERATORS as SIZES } from "./tables.js";
import {
  ANY, BOOL, broadcast, FLOAT, INDEX, INT64, NUMBER, product, rowShape, Tensor, TYPES, wholeNumbers,
} from "./tensors.js";
import { list, tuple } from "./text.js";

/** An operator and its inputs, `null` for one left out. */
export class Node {
  constructor(op, where, inputs, attributes, outputs) {
    Object.assign(this, { op, where, inputs, attributes, outputs });
  }

  badShape(what) {
    fail("PLX_ONNX_SHAPE", this.where, { op: this.op, what });
  }

  badType(what) {
    fail("PLX_ONNX_TYPE", this.where, { op: this.op, what });
  }

  attribute(name, otherwise) {
    return this.attributes.get(name) ?? otherwise;
  }

  /** All inputs, none of which may be left out. */
  given() {
    if (this.inputs.some((tensor) => tensor === null)) {
      this.badShape("an input is missing");
    }
    return this.inputs;
  }

  /** An input that must have rows. */
  rows(index = 0) {
    const tensor = this.inputs[index];
    if (tensor === null || tensor.isConstant) {
      this.badShape(`input ${index} must depend on the network's inputs`);
    }
    return tensor;
  }

  /** An input that must be an initializer. */
  constant(index, types) {
    const tensor = this.inputs[index] ?? null;
    if (tensor === null || !tensor.isConstant) {
      this.badShape(`input ${index} must be an initializer`);
    }
    if (!types.includes(tensor.type)) {
      this.badType(`input ${index} is ${tensor.type}`);
    }
    return tensor;
  }

  /** The numbers of an input that must be a one-dimensional initializer. */
  numbers(index) {
    const tensor = this.constant(index, [INT64]);
    if (tensor.shape.length !== 1 || tensor.size > LIMITS.node_outputs) {
      this.badShape(`input ${index} must be a short list`);
    }
    return wholeNumbers(tensor);
  }

  /** The same as they are stated, to the last digit. */
  stated(index) {
    return Array.from(this.inputs[index].value);
  }

  /** Axes given as an initializer, counted without the rows; never the rows, none twice. */
  axes(index, rank) {
    this.numbers(index);
    const axes = this.stated(index).map((axis) => this.axis(axis, rank));
    if (new Set(axes).size !== axes.length) {
      this.badShape("an axis is named twice");
    }
    return axes;
  }

  /** An axis of a tensor of `rank` axes besides the rows, counted without the rows. */
  axis(given, rank) {
    const axis = Number(given);
    if (!(axis >= -rank - 1 && axis <= rank)) {
      this.badShape(`axis ${given} does not exist`);
    }
    const found = (axis + rank + 1) % (rank + 1);
    if (found === 0) {
      this.badShape("the rows may not be mixed");
    }
    return found - 1;
  }
}

// Elementwise operators

function broadcastRows(node, inputs) {
  const ranks = new Set(inputs.filter((t) => !t.isConstant).map((t) => t.shape.length));
  if (ranks.size > 1) {
    node.badShape("tensors with rows must have the same number of axes");
  }
  const [rank] = ranks;
  const shapes = inputs.map((tensor) => {
    const { shape } = tensor;
    if (tensor.isConstant && shape.length > rank && (shape.length > rank + 1 || shape[0] !== 1)) {
      node.badShape(`a constant of shape ${tuple(shape)} would be spread over the rows`);
    }
    return rowShape(tensor, rank);
  });
  return broadcast(shapes) ?? node.badShape(`${shapes.map(tuple).join(" and ")} do not fit`);
}

/** Inputs of one type, broadcast; the result has that type or the one given. */
function elementwise(types, result) {
  return (node) => {
    const inputs = node.given();
    requireOneType(node, inputs, types);
    return [new Tensor(result ?? inputs[0].type, broadcastRows(node, inputs))];
  };
}

function requireOneType(node, inputs, types) {
  const found = new Set(inputs.map((tensor) => tensor.type));
  if (found.size > 1 || !types.includes(inputs[0].type)) {
    node.badType(`inputs are ${inputs.map((tensor) => tensor.type).join(", ")}`);
  }
}

function requireType(node, tensor, types) {
  if (!types.includes(tensor.type)) {
    node.badType(`the input is ${tensor.type}`);
  }
}

function cast(node) {
  const to = node.attribute("to", null);
  if (!(to in TYPES)) {
    node.badType(`cannot convert to element type ${to === null ? "None" : to}`);
  }
  return [new Tensor(TYPES[to], node.rows().shape)];
}

function clip(node) {
  const x = node.rows();
  requireType(node, x, NUMBER);
  for (const [index, bound] of node.inputs.entries()) {
    if (index && bound !== null && node.constant(index, [x.type]).shape.length) {
      node.badShape("bounds must be scalars");
    }
  }
  return [x];
}

function divide(types) {
  return (node) => {
    requireDivisor(node);
    return elementwise(types)(node);
  };
}

function mod(node) {
  return divide(node.attribute("fmod", 0) ? [FLOAT] : INDEX)(node);
}

/** Integers are divided by positive constants; hardware traps 0, and the least by -1. */
function requireDivisor(node) {
  const [first] = node.given();
  if (INDEX.includes(first.type) && node.constant(1, INDEX).value.some((number) => number < 1)) {
    node.badType("integers may only be divided by positive numbers");
  }
}

function where(node) {
  const [condition, ...choices] = node.given();
  if (condition.type !== BOOL) {
    node.badType("the condition is not bool");
  }
  requireOneType(node, choices, NUMBER);
  return [new Tensor(choices[0].type, broadcastRows(node, node.inputs))];
}

// Products and sums

function gemm(node) {
  const x = node.rows();
  const [weight, bias] = [node.constant(1, [FLOAT]), node.constant(2, [FLOAT])];
  const fixed = { transB: 1, transA: 0, alpha: 1, beta: 1 };
  const given = { ...fixed, transB: 0, ...Object.fromEntries(node.attributes) };
  if (Object.keys(given).some((name) => given[name] !== fixed[name])) {
    node.badShape("must be x weight' + bias (transB 1, no other factor)");
  }
  requireType(node, x, [FLOAT]);
  const [out, size] = weight.shape;
  if (weight.shape.length !== 2 || !same(x.shape, [size]) || !same(bias.shape, [out])) {
    const [a, b, c] = [x, weight, bias].map(({ shape }) => tuple(shape));
    node.badShape(`input ${a}, weight ${b} and bias ${c} do not fit`);
  }
  return [new Tensor(FLOAT, [out])];
}

function matmul(node) {
  const [x, weight] = [node.rows(), node.constant(1, [FLOAT])];
  requireType(node, x, [FLOAT]);
  if (weight.shape.length !== 2 || !same(x.shape, [weight.shape[0]])) {
    node.badShape(`input ${tuple(x.shape)} and weight ${tuple(weight.shape)} do not fit`);
  }
  return [new Tensor(FLOAT, [weight.shape[1]])];
}

function reduce(node) {
  const x = node.rows();
  requireType(node, x, NUMBER);
  const axes = node.axes(1, x.shape.length);
  if (!axes.length || node.attribute("noop_with_empty_axes", 0)) {
    node.badShape("axes must be given");
  }
  const keep = node.attribute("keepdims", 1);
  const sizes = x.shape.map((size, k) => (axes.includes(k) ? 1 : size));
  return [new Tensor(x.type, sizes.filter((_, k) => keep || !axes.includes(k)))];
}

function cumsum(node) {
  const [x, axis] = [node.rows(), node.constant(1, INDEX)];
  requireType(node, x, NUMBER);
  if (axis.shape.length) {
    node.badShape("the axis must be a scalar");
  }
  node.axis(axis.value[0], x.shape.length);
  return [x];
}

function softmax(node) {
  const x = node.rows();
  requireType(node, x, [FLOAT]);
  node.axis(node.attribute("axis", -1), x.shape.length);
  return [x];
}

// Selection and arrangement

/** Rows of a constant table by computed indices, or constant columns of computed rows. */
function gather(node) {
  const [data, index] = node.given();
  if (!INDEX.includes(index.type)) {
    node.badType(`the index is ${index.type}`);
  }
  if (data.isConstant && !index.isConstant) {
    if (Number(node.attribute("axis", 0)) !== 0 || !data.shape.length) {
      node.badShape("a table is read along its first axis");
    }
    return [new Tensor(data.type, [...index.shape, ...data.shape.slice(1)])];
  }
  const columns = node.constant(1, INDEX);
  const axis = node.axis(node.attribute("axis", 0), data.shape.length);
  const size = data.shape[axis];
  if (!wholeNumbers(columns).every((column) => column >= -size && column < size)) {
    node.badShape("an index is out of range");
  }
  return [new Tensor(data.type, data.shape.toSpliced(axis, 1, ...columns.shape))];
}

function gatherElements(node) {
  const [x, index] = [node.rows(0), node.rows(1)];
  if (!INDEX.includes(index.type)) {
    node.badType(`the index is ${index.type}`);
  }
  const axis = node.axis(node.attribute("axis", 0), x.shape.length);
  if (!same(x.shape.toSpliced(axis, 1, index.shape[axis]), index.shape)) {
    node.badShape(`index ${tuple(index.shape)} does not fit ${tuple(x.shape)}`);
  }
  return [new Tensor(x.type, index.shape)];
}

function concat(node) {
  const inputs = node.inputs.map((_, k) => node.rows(k));
  requireOneType(node, inputs, ANY);
  const first = inputs[0].shape;
  const axis = node.axis(node.attribute("axis", 0), first.length);
  const fits = ({ shape }) => same(shape.toSpliced(axis, 1), first.toSpliced(axis, 1));
  if (!inputs.every((tensor) => tensor.shape.length === first.length && fits(tensor))) {
    node.badShape("the inputs do not fit");
  }
  const width = inputs.reduce((sum, { shape }) => sum + shape[axis], 0);
  return [new Tensor(inputs[0].type, first.toSpliced(axis, 1, width))];
}

function split(node) {
  const [x, sizes] = [node.rows(), node.numbers(1)];
  const axis = node.axis(node.attribute("axis", 0), x.shape.length);
  const sum = sizes.reduce((a, b) => a + b, 0);
  const empty = sizes.some((size) => size < 1) || !sizes.length;
  if (empty || sum !== x.shape[axis] || sizes.length !== node.outputs) {
    node.badShape(`sizes ${list(node.stated(1))} do not make up ${x.shape[axis]}`);
  }
  return sizes.map((size) => new Tensor(x.type, x.shape.toSpliced(axis, 1, size)));
}

/** Starts, ends, axes and steps of a Slice, as positions that exist. */
export function slices(node) {
  const { shape } = node.rows();
  const [starts, ends, axes] = [node.numbers(1), node.numbers(2), node.axes(3, shape.length)];
  const steps = node.inputs.length > 4 ? node.numbers(4) : axes.map(() => 1);
  if (new Set([starts, ends, axes, steps].map((numbers) => numbers.length)).size > 1) {
    node.badShape("starts, ends, axes and steps do not fit");
  }
  return axes.map((axis, k) => {
    if (steps[k] < 1) {
      node.badShape("steps must be positive");
    }
    const place = (at) => Math.min(shape[axis], Math.max(0, at < 0 ? at + shape[axis] : at));
    const [start, end, step] = [place(starts[k]), place(ends[k]), steps[k]];
    return { axis, start, step, count: Math.max(0, Math.ceil((end - start) / step)) };
  });
}

function slice(node) {
  const x = node.rows();
  const shape = [...x.shape];
  for (const { axis, count } of slices(node)) {
    shape[axis] = count;
  }
  return [new Tensor(x.type, shape)];
}

function reshape(node) {
  const [x, target] = [node.rows(), node.numbers(1)];
  if (node.attribute("allowzero", 0) || (target[0] !== -1 && target[0] !== 0)) {
    node.badShape("the first size must stand for the rows (-1)");
  }
  const sizes = target.slice(1);
  if (sizes.some((size) => size < 1) || product(sizes) !== x.size) {
    node.badShape(`a row of ${tuple(x.shape)} cannot become ${list(node.stated(1).slice(1))}`);
  }
  return [new Tensor(x.type, sizes)];
}

function transpose(node) {
  const [x, order] = [node.rows(), node.attribute("perm", [])];
  const sorted = order.map(Number).sort((a, b) => a - b);
  if (!same(sorted, [0, ...x.shape.map((_, k) => k + 1)]) || Number(order[0]) !== 0) {
    node.badShape(`order ${list(order)} is none that leaves the rows in front`);
  }
  return [new Tensor(x.type, order.slice(1).map((k) => x.shape[k - 1]))];
}

function squeeze(node) {
  const x = node.rows();
  const axes = node.axes(1, x.shape.length);
  if (axes.some((axis) => x.shape[axis] !== 1)) {
    const sorted = axes.toSorted((a, b) => a - b);
    node.badShape(`axes ${list(sorted)} of ${tuple(x.shape)} are not all 1`);
  }
  return [new Tensor(x.type, x.shape.filter((_, k) => !axes.includes(k)))];
}

function unsqueeze(node) {
  const x = node.rows();
  const rank = x.shape.length + node.numbers(1).length;
  const axes = new Set(node.axes(1, rank));
  const sizes = x.shape.values();
  const shape = Array.from({ length: rank }, (_, k) => (axes.has(k) ? 1 : sizes.next().value));
  return [new Tensor(x.type, shape)];
}

function same(a, b) {
  return a.length === b.length && a.every((size, k) => size === b[k]);
}

// The allow-list

const FLOATS = elementwise([FLOAT]);
const NUMBERS = elementwise(NUMBER);
const COMPARISON = elementwise(NUMBER, BOOL);
const LOGIC = elementwise([BOOL]);
const RULES = {
  Abs: NUMBERS, Add: NUMBERS, And: LOGIC, Asin: FLOATS, Atan: FLOATS, Cast: cast, Clip: clip,
  Concat: concat, Cos: FLOATS, CumSum: cumsum, Div: divide(NUMBER), Equal: elementwise(ANY, BOOL),
  Exp: FLOATS, Floor: FLOATS, Gather: gather, GatherElements: gatherElements, Gemm: gemm,
  Greater: COMPARISON, GreaterOrEqual: COMPARISON, Identity: elementwise(ANY), Less: COMPARISON,
  LessOrEqual: COMPARISON, Log: FLOATS, MatMul: matmul, Max: NUMBERS, Min: NUMBERS, Mod: mod,
  Mul: NUMBERS, Neg: NUMBERS, Not: LOGIC, Or: LOGIC, Reciprocal: FLOATS, ReduceMax: reduce,
  ReduceSum: reduce, Relu: FLOATS, Reshape: reshape, Sigmoid: FLOATS, Sign: NUMBERS, Sin: FLOATS,
  Slice: slice, Softmax: softmax, Split: split, Sqrt: FLOATS, Squeeze: squeeze, Sub: NUMBERS,
  Transpose: transpose, Unsqueeze: unsqueeze, Where: where,
};

/** By name: the rule, the least and most inputs, the attributes. */
export const OPERATORS = new Map(
  Object.entries(RULES).map(([name, rule]) => {
    const [least, most, attributes] = SIZES[name];
    return [name, { rule, least, most, attributes }];
  }),
);

