// A vetted network as a function of GLSL ES 3.00: straight-line code, weights and tables in textures.
//
// A tensor is a list of texts, one for each element of a row, so moving elements about costs nothing.
// What a matrix product gives lies in an array of vec4, and stays there through elementwise
// operations. No text of the file gets into the code: names are ours, the rest is numbers.

import { KINDS } from "../format/tables.js";
import { Bounds, boundsOf } from "./bounds.js";
import { RULES } from "./printing.js";
import { fours, Literal, Value, Writer } from "./writer.js";

const COMPONENTS = "xyzw";
const VECTORS = { 2: "vec2", 3: "vec3", 4: "vec4" };
// Operands whose bounds are found on the numbers themselves.
const WEIGHTS = { Gemm: 1, MatMul: 1, Gather: 0 };

/**
 * The text of a function of the network's name; it takes vectors and gives its outputs as `out`.
 *
 * `store` takes the constants.
 */
export function printNetwork(network, name, store) {
  const writer = new Writer(store);
  const values = new Map();
  for (const [key, tensor] of network.values) {
    if (tensor.isConstant) {
      values.set(key, new Literal(tensor));
    }
  }
  for (const input of network.inputs) {
    values.set(input, argument(input, network.values.get(input).size));
  }
  for (const { node, inputs, outputs } of network.nodes) {
    const given = inputs.map((key) => (key === "" ? null : values.get(key)));
    const tensors = outputs.map((key) => network.values.get(key));
    const skipped = (value, k) => WEIGHTS[node.op] === k && value instanceof Literal;
    const known = given.map((value, k) => (skipped(value, k) ? null : value?.bounds));
    const bounds = boundsOf(node, tensors, known);
    const made = RULES[node.op]({ writer, node, given, tensors, bounds });
    outputs.forEach((key, k) => values.set(key, made[k]));
  }
  const results = network.outputs.flatMap((key) => result(key, KINDS[name].outputs[key],
    values.get(key)));
  return [`void ${name}(${parameters(network, name)}) {`, ...writer.lines, ...results, "}\n"]
    .join("\n");
}

function argument(name, size) {
  const elements = Array.from({ length: size }, (_, k) => `${name}.${COMPONENTS[k]}`);
  return new Value("float", elements, Bounds.filled(size, -Number.MAX_VALUE, Number.MAX_VALUE));
}

// Parameters and results

function parameters(network, name) {
  const inputs = network.inputs.map((key) => `${VECTORS[network.values.get(key).size]} ${key}`);
  const outputs = Object.entries(KINDS[name].outputs).map(([key, shape]) => {
    const size = shape.reduce((a, b) => a * b, 1);
    const type = size === 1 ? "float" : VECTORS[size] ?? `vec4`;
    return `out ${type} ${key}${size > 4 ? `[${Math.ceil(size / 4)}]` : ""}`;
  });
  return [...inputs, ...outputs].join(", ");
}

function result(name, shape, { elements }) {
  const size = elements.length;
  if (size <= 4) {
    const values = elements.join(", ");
    return [`${name} = ${size === 1 ? values : `${VECTORS[size]}(${values})`};`];
  }
  return fours(elements).map((four, k) => `${name}[${k}] = ${four};`);
}
