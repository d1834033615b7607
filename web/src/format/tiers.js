// Tiers (plux.md, M13): what every network of a bundle keeps to.

import { KINDS, TIERS } from "./tables.js";
import { FLOAT, INT64, product } from "./tensors.js";

/** What keeps a vetted network from being of a tier, in a few words; empty if nothing does. */
export function tierFault(tier, found, network) {
  const answers = Object.values(KINDS[network].outputs).map(product).reduce((a, b) => a + b, 0);
  if (found.macs > (answers >= TIERS.map_cells ? tier.map_macs : tier.macs)) {
    return `${found.macs.toLocaleString("en-US")} multiply-adds`;
  }
  if (found.floats > tier.floats) {
    return `${found.floats.toLocaleString("en-US")} values`;
  }
  const constants = [...found.values.values()].filter((tensor) => tensor.isConstant)
    .reduce((sum, tensor) => sum + tensor.size, 0);
  if (constants > tier.constants) {
    return `${constants.toLocaleString("en-US")} weights`;
  }
  return found.nodes.map((step) => nodeFault(tier, step, found.values)).find(Boolean) ?? "";
}

function nodeFault(tier, { node, outputs }, values) {
  if (outputs.some((name) => values.get(name).type === INT64)) {
    return "integers of 64 bits";
  }
  const first = node.inputs[0];
  if (node.op === "Relu" && first.size > TIERS.small && first.size % tier.multiple) {
    return `a layer of ${first.size}`;
  }
  return node.op === "Gather" && first.isConstant && first.type !== FLOAT
    ? "a table of integers" : "";
}
