// The networks in plain JavaScript, float32 between operators: what a file is vetted with.
//
// It is slow and knows no graphics card. Whole numbers of 64 bits are kept as float64 as long as
// that is exact, as BigInts beyond.

import { ARRAYS, BOOL, FLOAT, INT32, INT64 } from "../format/tensors.js";
import { arrangement, axisOf, choices, groups, lines, spread } from "./arrange.js";

const ELEMENTS = 1 << 24; // At a time, so that a network at every limit fits into memory.
const SAFE = Number.MAX_SAFE_INTEGER;

/** A network that cannot be evaluated: an index beyond its table. */
export class BrokenNetwork extends Error {}

/** Outputs by name of `count` rows, from a vetted network and its inputs by name. */
export function evaluate(network, inputs, count) {
  const step = Math.max(1, Math.min(count, Math.floor(ELEMENTS / Math.max(network.floats, 1))));
  const parts = [];
  for (let start = 0; start < count; start += step) {
    const rows = Math.min(step, count - start);
    const part = {};
    for (const name of network.inputs) {
      const { size } = network.values.get(name);
      part[name] = Float32Array.from(inputs[name].subarray(start * size, (start + rows) * size));
    }
    parts.push(run(network, part, rows));
  }
  const join = (name) => Float32Array.from(parts.flatMap((part) => Array.from(part[name])));
  return Object.fromEntries(network.outputs.map((name) => [name, join(name)]));
}

function run(network, inputs, rows) {
  const values = new Map(Object.entries(inputs));
  for (const [name, tensor] of network.values) {
    if (tensor.isConstant) {
      values.set(name, constant(tensor));
    }
  }
  const last = lastUses(network);
  for (const [k, { node, inputs: names, outputs }] of network.nodes.entries()) {
    const data = names.map((name) => (name === "" ? null : values.get(name)));
    const tensors = outputs.map((name) => network.values.get(name));
    const results = OPERATIONS[node.op](new Call(node, data, tensors, rows));
    outputs.forEach((name, i) => values.set(name, results[i]));
    for (const name of [...names, ...outputs]) {
      if (last.get(name) === k && !network.outputs.includes(name)) {
        values.delete(name);
      }
    }
  }
  return Object.fromEntries(network.outputs.map((name) => [name, values.get(name)]));
}

function lastUses({ nodes }) {
  const last = new Map();
  nodes.forEach(({ inputs, outputs }, k) => {
    [...outputs, ...inputs].forEach((name) => last.set(name, k));
  });
  return last;
}

/** The elements of a constant as they are calculated with. */
export function constant({ type, value }) {
  if (type === BOOL) {
    return value.map((bit) => (bit ? 1 : 0));
  }
  return type === INT64 ? narrowed(value) : value;
}

function widened(numbers) {
  return BigInt64Array.from(numbers, BigInt);
}

/** Whole numbers of 64 bits as float64 where that is exact. */
function narrowed(numbers) {
  const floats = Float64Array.from(numbers, Number);
  return floats.every((x) => Math.abs(x) <= SAFE) ? floats : BigInt64Array.from(numbers, BigInt);
}

/** A node with its data: what an operation works on. */
class Call {
  constructor(node, data, outputs, rows) {
    Object.assign(this, { node, data, outputs, rows });
  }

  get type() {
    return this.node.inputs[0].type;
  }

  /** Room for an output. */
  make(k = 0) {
    const { type, size } = this.outputs[k];
    const Kind = type === INT64 ? Float64Array : ARRAYS[type];
    return new Kind(size * this.rows);
  }

  /** An elementwise operation of one, two or three operands. */
  each(operation, out = this.make(), data = this.data) {
    const { size, shape } = this.outputs[0];
    const operands = this.node.inputs.map((tensor, i) => ({
      data: data[i],
      map: spread(tensor, shape),
      step: tensor.isConstant ? 0 : tensor.size,
    }));
    LOOPS[data.length](operation, out, operands, this.rows, size);
    return [out];
  }

  /** The same on numbers of any type; `whole` calculates with BigInts. */
  numbers(operation, whole = operation) {
    const { type, size } = this.outputs[0];
    if (type === FLOAT) {
      return this.each(operation);
    }
    if (!this.data.some((data) => data instanceof BigInt64Array)) {
      const [exact] = this.each(operation, new Float64Array(this.rows * size));
      if (exact.every((x) => Math.abs(x) <= SAFE)) {
        return [type === INT32 ? Int32Array.from(exact, (x) => x | 0) : exact];
      }
    }
    const [wide] = this.each(whole, new BigInt64Array(this.rows * size), this.data.map(widened));
    return [type === INT32 ? Int32Array.from(wide, (x) => Number(BigInt.asIntN(32, x)))
      : narrowed(wide)];
  }

  /** Calculates with float64, or with BigInts where whole numbers of 64 bits demand it. */
  exactly(calculate) {
    const [x] = this.data;
    const out = calculate(x);
    const inexact = out instanceof Float64Array && !out.every((value) => Math.abs(value) <= SAFE);
    return [inexact ? narrowed(calculate(widened(x))) : out];
  }

  /** Elements of a row of an input. */
  row(n, k = 0, data = this.data[k]) {
    const { size } = this.node.inputs[k];
    return data.subarray(n * size, (n + 1) * size);
  }
}

/** Loops over rows and elements by the number of operands. */
const LOOPS = {
  1(operation, out, [a], rows, size) {
    for (let n = 0; n < rows; n++) {
      for (let k = 0; k < size; k++) {
        out[n * size + k] = operation(a.data[n * a.step + a.map[k]]);
      }
    }
  },
  2(operation, out, [a, b], rows, size) {
    for (let n = 0; n < rows; n++) {
      for (let k = 0; k < size; k++) {
        const [x, y] = [n * a.step + a.map[k], n * b.step + b.map[k]];
        out[n * size + k] = operation(a.data[x], b.data[y]);
      }
    }
  },
  3(operation, out, [a, b, c], rows, size) {
    for (let n = 0; n < rows; n++) {
      for (let k = 0; k < size; k++) {
        const [x, y, z] = [a, b, c].map((operand) => n * operand.step + operand.map[k]);
        out[n * size + k] = operation(a.data[x], b.data[y], c.data[z]);
      }
    }
  },
};

// Operations

/** An operation whose result no number can be too large for. */
function plain(operation) {
  return (call) => call.each(operation);
}

function cast(call) {
  const { type } = call.outputs[0];
  const convert = {
    [FLOAT]: Number,
    [BOOL]: (x) => Number(x) !== 0,
    [INT32]: (x) => Number(BigInt.asIntN(32, whole(x))),
    [INT64]: whole,
  }[type];
  if (type !== INT64) {
    return call.each(convert);
  }
  const [wide] = call.each(convert, new BigInt64Array(call.rows * call.outputs[0].size));
  return [narrowed(wide)];
}

/** A number without its fraction, the least one where it is none of 64 bits. */
function whole(x) {
  if (typeof x === "bigint") {
    return x;
  }
  return Math.abs(x) < 2 ** 63 ? BigInt(Math.trunc(x)) : -(2n ** 63n);
}

/** Clip is a Max and a Min, whose bounds may be left out. */
function clip(call) {
  const [x, low, high] = call.data;
  const number = x instanceof BigInt64Array ? BigInt : (value) => value;
  const bound = (given) => (given ? number(given[0]) : undefined);
  const [least, greatest] = [bound(low), bound(high)];
  const inside = (value) => {
    const raised = least === undefined ? value : larger(value, least);
    return greatest === undefined ? raised : smaller(raised, greatest);
  };
  return [x.map(inside)];
}

/** Max and Min of any number of operands, two at a time. */
function folded(choose) {
  return (call) => {
    const { node, outputs, rows, data } = call;
    const [result] = outputs;
    const [first] = new Call({ inputs: node.inputs.slice(0, 1) }, data.slice(0, 1), outputs, rows)
      .numbers((x) => x);
    return node.inputs.slice(1).reduce(([values], tensor, k) => {
      const pair = new Call({ inputs: [result, tensor] }, [values, data[k + 1]], outputs, rows);
      return pair.numbers(choose);
    }, [first]);
  };
}

function divide(call) {
  const quotient = call.type === FLOAT ? (a, b) => a / b : (a, b) => Math.trunc(a / b);
  return call.numbers(quotient, (a, b) => a / b);
}

function mod(call) {
  if (call.type === FLOAT) {
    return call.each((a, b) => a % b);
  }
  return call.numbers((a, b) => ((a % b) + b) % b, (a, b) => ((a % b) + b) % b);
}

function product(transposed) {
  return (call) => {
    const [x, weight, bias] = call.data;
    const [inner, outer] = [call.node.inputs[0].size, call.outputs[0].size];
    const [along, across] = transposed ? [1, inner] : [outer, 1];
    const out = call.make();
    for (let n = 0; n < call.rows; n++) {
      for (let o = 0; o < outer; o++) {
        let sum = bias ? bias[o] : 0;
        for (let i = 0; i < inner; i++) {
          sum += x[n * inner + i] * weight[o * across + i * along];
        }
        out[n * outer + o] = sum;
      }
    }
    return [out];
  };
}

function softmax(call) {
  const { node } = call;
  const all = lines(node.inputs[0].shape, axisOf(node, node.attribute("axis", -1)));
  const out = call.make();
  for (let n = 0; n < call.rows; n++) {
    const [row, result] = [call.row(n), call.row(n, 0, out)];
    for (const line of all) {
      const peak = line.map((k) => row[k]).reduce(larger);
      const powers = line.map((k) => Math.exp(row[k] - peak));
      const sum = powers.reduce(add);
      line.forEach((k, i) => (result[k] = powers[i] / sum));
    }
  }
  return [out];
}

function cumsum(call) {
  const { node } = call;
  const all = lines(node.inputs[0].shape, axisOf(node, node.inputs[1].value[0]));
  const [reverse, exclusive] = ["reverse", "exclusive"].map((name) => node.attribute(name, 0));
  const sums = (row, out, line) => {
    let sum = typeof row[0] === "bigint" ? 0n : 0;
    for (const k of reverse ? line.toReversed() : line) {
      out[k] = exclusive ? sum : sum + row[k];
      sum = sum + row[k];
    }
  };
  return call.exactly((x) => {
    const out = new x.constructor(x.length);
    for (let n = 0; n < call.rows; n++) {
      all.forEach((line) => sums(call.row(n, 0, x), call.row(n, 0, out), line));
    }
    return out;
  });
}

function reduce(combine) {
  return (call) => {
    const all = groups(call.node);
    return call.exactly((x) => {
      const out = new x.constructor(call.rows * all.length);
      for (let n = 0; n < call.rows; n++) {
        const row = call.row(n, 0, x);
        all.forEach((group, k) => {
          out[n * all.length + k] = group.map((i) => row[i]).reduce(combine);
        });
      }
      return out;
    });
  };
}

function arrange(call) {
  const wide = call.node.op === "Concat" && call.data.some((d) => d instanceof BigInt64Array);
  const data = wide ? call.data.map(widened) : call.data;
  const maps = arrangement(call.node, call.outputs);
  return call.outputs.map(({ size }, o) => {
    const { source, from } = maps[o];
    const out = new data[0].constructor(call.rows * size);
    for (let n = 0; n < call.rows; n++) {
      for (let k = 0; k < size; k++) {
        const input = source === 0 ? 0 : source[k];
        out[n * size + k] = data[input][n * call.node.inputs[input].size + from[k]];
      }
    }
    return out;
  });
}

function gather(call) {
  const [table, index] = call.node.inputs;
  if (!table.isConstant) {
    return arrange(call);
  }
  const width = table.size / table.shape[0];
  const out = new call.data[0].constructor(call.rows * call.outputs[0].size);
  for (let k = 0; k < call.rows * index.size; k++) {
    const row = within(Number(call.data[1][k]), table.shape[0], "Gather", 0);
    out.set(call.data[0].subarray(row * width, (row + 1) * width), k * width);
  }
  return [out];
}

function gatherElements(call) {
  const { first, step, size, axis } = choices(call.node);
  const out = new call.data[0].constructor(call.rows * first.length);
  for (let n = 0; n < call.rows; n++) {
    const [row, index] = [call.row(n), call.row(n, 1)];
    first.forEach((start, k) => {
      const chosen = within(Number(index[k]), size, "GatherElements", axis + 1);
      out[n * first.length + k] = row[start + chosen * step];
    });
  }
  return [out];
}

/** An index, counted from the end where it is negative. */
function within(index, size, op, axis) {
  if (!(index >= -size && index < size)) {
    const what = `index ${index} is out of bounds for axis ${axis} with size ${size}`;
    throw new BrokenNetwork(`${op}: ${what}; the network is broken`);
  }
  return index < 0 ? index + size : index;
}

function sign(x) {
  return typeof x === "bigint" ? BigInt(Number(x > 0n) - Number(x < 0n)) : Math.sign(x);
}

function absolute(x) {
  return x < 0 ? -x : typeof x === "bigint" ? x : Math.abs(x);
}

const negate = (x) => -x;
const larger = (a, b) => (a >= b || a !== a ? a : b);
const smaller = (a, b) => (a <= b || a !== a ? a : b);
const add = (a, b) => a + b;
const subtract = (a, b) => a - b;
const multiply = (a, b) => a * b;

function where(call) {
  if (!call.data.some((data) => data instanceof BigInt64Array)) {
    return call.each((c, a, b) => (c ? a : b));
  }
  const room = new BigInt64Array(call.rows * call.outputs[0].size);
  return [narrowed(call.each((c, a, b) => BigInt(c ? a : b), room)[0])];
}

/** By name: from a call to a typed array for each output. */
const OPERATIONS = {
  Abs: (call) => call.numbers(absolute),
  Add: (call) => call.numbers(add),
  And: plain((a, b) => a & b),
  Asin: plain(Math.asin),
  Atan: plain(Math.atan),
  Cast: cast,
  Clip: clip,
  Concat: arrange,
  Cos: plain(Math.cos),
  CumSum: cumsum,
  Div: divide,
  Equal: plain((a, b) => a == b), // Also of a BigInt and a number.
  Exp: plain(Math.exp),
  Floor: plain(Math.floor),
  Gather: gather,
  GatherElements: gatherElements,
  Gemm: product(true),
  Greater: plain((a, b) => a > b),
  GreaterOrEqual: plain((a, b) => a >= b),
  Identity: arrange,
  Less: plain((a, b) => a < b),
  LessOrEqual: plain((a, b) => a <= b),
  Log: plain(Math.log),
  MatMul: product(false),
  Max: folded(larger),
  Min: folded(smaller),
  Mod: mod,
  Mul: (call) => call.numbers(multiply),
  Neg: (call) => call.numbers(negate),
  Not: plain((a) => 1 - a),
  Or: plain((a, b) => a | b),
  Reciprocal: plain((a) => 1 / a),
  ReduceMax: reduce(larger),
  ReduceSum: reduce(add),
  Relu: plain((a) => (a < 0 ? 0 : a)),
  Reshape: arrange,
  Sigmoid: plain((a) => 1 / (1 + Math.exp(-a))),
  Sign: (call) => call.numbers(sign),
  Sin: plain(Math.sin),
  Slice: arrange,
  Softmax: softmax,
  Split: arrange,
  Sqrt: plain(Math.sqrt),
  Squeeze: arrange,
  Sub: (call) => call.numbers(subtract),
  Transpose: arrange,
  Unsqueeze: arrange,
  Where: where,
};

