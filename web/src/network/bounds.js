// How large each element of a row may be, so that whole numbers of 64 bits can be told from those
// that fit into the 32 bits of a graphics card.

import { BOOL, FLOAT, INT32, INT64 } from "../format/tensors.js";
import { arrangement, choices, groups, spread } from "./arrange.js";

const MOST = Number.MAX_VALUE;
const LONG = 2 ** 63;
const INT = 2 ** 31;

/** Least and largest of each element. */
export class Bounds {
  constructor(low, high) {
    Object.assign(this, { low, high });
  }

  static filled(size, low, high) {
    return new Bounds(new Float64Array(size).fill(low), new Float64Array(size).fill(high));
  }

  static of(numbers) {
    const values = Float64Array.from(numbers, Number);
    return new Bounds(values, values);
  }

  /** Whether all elements fit into whole numbers of 32 bits. */
  get isShort() {
    return this.low.every((x) => x >= -INT) && this.high.every((x) => x < INT);
  }

  pick(map) {
    return new Bounds(Float64Array.from(map, (k) => this.low[k]),
      Float64Array.from(map, (k) => this.high[k]));
  }
}

/** The bounds of what a node gives, from those of its inputs. */
export function boundsOf(node, outputs, inputs) {
  if (["Concat", "Slice", "Split", "Transpose", "Identity", "Reshape", "Squeeze", "Unsqueeze"]
    .includes(node.op)) {
    return arranged(node, outputs, inputs);
  }
  const rule = RULES[node.op];
  const found = typeof rule === "function" ? rule(node, outputs[0], inputs)
    : each(node, outputs[0], inputs, rule.ends);
  return [held(found, outputs[0].type)];
}

/** What no type can hold is wrapped or cut, so nothing is known of it. */
function held({ low, high }, type) {
  const most = { [FLOAT]: MOST, [INT64]: LONG, [INT32]: INT, [BOOL]: 1 }[type];
  const wraps = type === INT32 || type === INT64;
  for (let k = 0; k < low.length; k++) {
    const inside = low[k] >= -most && (wraps ? high[k] < most : high[k] <= most);
    if (!inside && wraps) {
      [low[k], high[k]] = [-most, most - 1];
    } else if (!inside) {
      low[k] = low[k] >= -most ? Math.min(low[k], most) : -most;
      high[k] = high[k] <= most ? Math.max(high[k], -most) : most;
    }
  }
  return new Bounds(low, high);
}

function arranged(node, outputs, inputs) {
  return arrangement(node, outputs).map(({ source, from }) => {
    if (source === 0) {
      return inputs[0].pick(from);
    }
    const take = (end) => Float64Array.from(from, (at, k) => inputs[source[k]][end][at]);
    return new Bounds(take("low"), take("high"));
  });
}

/** Elementwise: `ends` gives least and largest from pairs of least and largest. */
function each(node, output, inputs, ends) {
  const maps = node.inputs.map((tensor) => spread(tensor, output.shape));
  const result = Bounds.filled(output.size, 0, 0);
  for (let k = 0; k < output.size; k++) {
    const given = inputs.map((bounds, i) => [bounds.low[maps[i][k]], bounds.high[maps[i][k]]]);
    [result.low[k], result.high[k]] = ends(...given);
  }
  return result;
}

const always = (low, high) => ({ ends: () => [low, high] });
const rising = (f) => ({ ends: ([low, high]) => [number(f(low), -MOST), number(f(high), MOST)] });

function number(value, otherwise) {
  return Number.isNaN(value) ? otherwise : value;
}

/** Of a function that is monotonous in either operand. */
function corners(f) {
  return {
    ends: ([a, b], [c, d]) => {
      const found = [f(a, c), f(a, d), f(b, c), f(b, d)].map((x) => number(x, Infinity));
      return found.includes(Infinity) ? [-Infinity, Infinity]
        : [Math.min(...found), Math.max(...found)];
    },
  };
}

function quotient(a, [c, d]) {
  return c <= 0 && d >= 0 ? [-Infinity, Infinity] : corners((x, y) => x / y).ends(a, [c, d]);
}

function remainder(node, output, inputs) {
  const whole = !node.attribute("fmod", 0);
  return each(node, output, inputs, ([a, b], [c, d]) => {
    if (whole) {
      return [0, a >= 0 ? Math.min(b, d - 1) : d - 1];
    }
    const size = Math.min(Math.max(Math.abs(a), Math.abs(b)), Math.max(Math.abs(c), Math.abs(d)));
    return [a >= 0 ? 0 : -size, b <= 0 ? 0 : size];
  });
}

function fold(choose) {
  return { ends: (...pairs) => [0, 1].map((end) => choose(...pairs.map((pair) => pair[end]))) };
}

function clip(_, output, [x, low, high]) {
  const [least, most] = [low?.low[0] ?? -Infinity, high?.low[0] ?? Infinity];
  const cut = (value) => Math.min(Math.max(value, least), most);
  return new Bounds(x.low.map(cut), x.high.map(cut));
}

/** A conversion: to whole numbers without the fraction. */
function cast(_, output, [x]) {
  if (output.type === BOOL) {
    return Bounds.filled(output.size, 0, 1);
  }
  const cut = output.type === FLOAT ? (value) => value : Math.trunc;
  return new Bounds(x.low.map(cut), x.high.map(cut));
}

function product(transposed) {
  return (node, output, [x, , bias]) => {
    const [inner, outer] = [x.low.length, output.size];
    const weight = node.inputs[1].value;
    const result = Bounds.filled(outer, 0, 0);
    for (let o = 0; o < outer; o++) {
      let [low, high] = bias ? [bias.low[o], bias.low[o]] : [0, 0];
      for (let i = 0; i < inner; i++) {
        const w = weight[transposed ? o * inner + i : i * outer + o];
        low += w === 0 ? 0 : w * (w > 0 ? x.low[i] : x.high[i]);
        high += w === 0 ? 0 : w * (w > 0 ? x.high[i] : x.low[i]);
      }
      [result.low[o], result.high[o]] = [number(low, -MOST), number(high, MOST)];
    }
    return result;
  };
}

function reduced(combine) {
  return (node, output, [x]) => {
    const all = groups(node);
    const ends = ["low", "high"].map((end) =>
      Float64Array.from(all, (group) => group.map((k) => x[end][k]).reduce(combine)));
    return new Bounds(...ends);
  };
}

/** A sum of some of the elements. */
function cumsum(_, output, [x]) {
  const sum = (values, choose) => values.reduce((a, b) => a + choose(b, 0), 0);
  return Bounds.filled(output.size, sum(x.low, Math.min), sum(x.high, Math.max));
}

/** Of a table, the least and largest of each column; of a row, its columns. */
function gather(node, output, inputs) {
  const [table] = node.inputs;
  if (!table.isConstant) {
    return arranged(node, [output], inputs)[0];
  }
  const width = table.size / table.shape[0];
  const columns = Bounds.filled(width, Infinity, -Infinity);
  table.value.forEach((value, k) => {
    columns.low[k % width] = Math.min(columns.low[k % width], Number(value));
    columns.high[k % width] = Math.max(columns.high[k % width], Number(value));
  });
  return columns.pick(Int32Array.from({ length: output.size }, (_, k) => k % width));
}

function gatherElements(node, output, [x]) {
  const { first, step, size } = choices(node);
  const line = (start) => Array.from({ length: size }, (_, k) => start + k * step);
  const take = (end, choose) =>
    Float64Array.from(first, (start) => line(start).map((k) => x[end][k]).reduce(choose));
  return new Bounds(take("low", (a, b) => Math.min(a, b)), take("high", (a, b) => Math.max(a, b)));
}

const RULES = {
  Abs: { ends: ([a, b]) => [a <= 0 && b >= 0 ? 0 : Math.min(Math.abs(a), Math.abs(b)),
    Math.max(Math.abs(a), Math.abs(b))] },
  Add: corners((a, b) => a + b),
  And: always(0, 1),
  Asin: always(-1.6, 1.6),
  Atan: always(-1.6, 1.6),
  Cast: cast,
  Clip: clip,
  Cos: always(-1, 1),
  CumSum: cumsum,
  Div: (node, output, inputs) => {
    const found = each(node, output, inputs, quotient);
    const whole = output.type !== FLOAT;
    return whole ? new Bounds(found.low.map(Math.floor), found.high.map(Math.ceil)) : found;
  },
  Equal: always(0, 1),
  Exp: rising(Math.exp),
  Floor: rising(Math.floor),
  Gather: gather,
  GatherElements: gatherElements,
  Gemm: product(true),
  Greater: always(0, 1),
  GreaterOrEqual: always(0, 1),
  Less: always(0, 1),
  LessOrEqual: always(0, 1),
  Log: { ends: ([a, b]) => [a > 0 ? Math.log(a) : -MOST, b > 0 ? Math.log(b) : MOST] },
  MatMul: product(false),
  Max: fold(Math.max),
  Min: fold(Math.min),
  Mod: remainder,
  Mul: corners((a, b) => (a === 0 || b === 0 ? 0 : a * b)),
  Neg: { ends: ([a, b]) => [-b, -a] },
  Not: always(0, 1),
  Or: always(0, 1),
  Reciprocal: { ends: (x) => quotient([1, 1], x) },
  ReduceMax: reduced((a, b) => Math.max(a, b)),
  ReduceSum: reduced((a, b) => a + b),
  Relu: rising((x) => Math.max(x, 0)),
  Sigmoid: always(0, 1),
  Sign: always(-1, 1),
  Sin: always(-1, 1),
  Softmax: always(0, 1),
  Sqrt: rising((x) => Math.sqrt(Math.max(x, 0))),
  Sub: corners((a, b) => a - b),
  Where: { ends: (_, [a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)] },
};
