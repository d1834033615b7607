// What a node costs (onnx_profile.md, N14): nanoseconds a row on one core, by a table.

import { COST } from "./tables.js";
import { FLOAT, INDEX } from "./tensors.js";

/** Work of a node for one row. */
export function nanoseconds(node, outputs) {
  const names = node.inputs.length + outputs.length;
  return COST.call + COST.name * names + products(node) * COST.product
    + rate(node) * elements(node, outputs);
}

/** Multiply-adds of a matrix product for one row: one for each weight. */
export function products(node) {
  return node.op === "Gemm" || node.op === "MatMul" ? node.constant(1, [FLOAT]).size : 0;
}

function rate(node) {
  const [first] = node.inputs;
  if (node.op === "Mod" && node.attribute("fmod", 0)) {
    return COST.float_remainder;
  }
  if (node.op === "Mod" || (node.op === "Div" && INDEX.includes(first?.type))) {
    return COST.integer_division;
  }
  if (node.op === "Gather" && first?.isConstant && first.size > COST.large_table) {
    return COST.distant;
  }
  return COST.element[node.op] ?? 0;
}

/** How often a node does its work for one row. */
function elements(node, outputs) {
  const written = outputs.reduce((sum, tensor) => sum + tensor.size, 0);
  if (COST.combining.includes(node.op)) {
    return Math.max(1, node.inputs.length - 1) * written;
  }
  return COST.folding.includes(node.op) ? node.rows().size : written;
}
