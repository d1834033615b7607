// Vetting of a network (onnx_profile.md): a walk over the graph that computes nothing but shapes.

import { decode } from "./bytes.js";
import { nanoseconds, products } from "./cost.js";
import { fail, issue } from "./issues.js";
import { typed } from "./npy.js";
import { readModel, tooLarge } from "./onnx.js";
import { Node, OPERATORS } from "./operators.js";
import { FLAGS, KINDS, LIMITS, PROFILE } from "./tables.js";
import { ARRAYS, FLOAT, product, Tensor, TYPES } from "./tensors.js";
import { bytesText, isPrintable, list, repr, tuple } from "./text.js";

const [FLOAT_ATTRIBUTE, INT, GRAPH, INTS, GRAPHS] = [1, 2, 5, 7, 10]; // As in AttributeProto.
const VALUES = { [FLOAT_ATTRIBUTE]: "f", [INT]: "i", [INTS]: "ints" };
const OTHER_DATA = ["float_data", "int32_data", "int64_data", "double_data", "uint64_data",
  "string_data"];

/**
 * A vetted network.
 *
 * Gives { macs, floats, nanoseconds, bytes, warnings, inputs, outputs, values, nodes }: its cost,
 * names in order, tensors by name, and nodes as { node, inputs, outputs } with names.
 */
export function inspect(bytes, network, where, limits = LIMITS) {
  const model = readModel(bytes, where, limits);
  const graph = model.graph ?? { given: new Set() };
  requireHeader(model, where);
  requireFeatures(model, graph, where);
  requireCounts(graph, where, limits);
  const { inputs, outputs } = KINDS[network];
  requireSignature(graph.input ?? [], inputs, `${where}:inputs`);
  requireSignature(graph.output ?? [], outputs, `${where}:outputs`);
  const values = new Map();
  for (const [name, shape] of Object.entries(inputs)) {
    values.set(name, new Tensor(FLOAT, shape));
  }
  for (const tensor of graph.initializer ?? []) {
    const name = asName(tensor.name);
    define(values, name, initializer(tensor, `${where}:${cut(name)}`, limits), where);
  }
  const walked = walk(graph.node ?? [], values, where, limits);
  requireOutputs(values, outputs, where);
  const warnings = [...warningsOf(model, graph, where)];
  const names = { inputs: Object.keys(inputs), outputs: Object.keys(outputs) };
  return { ...walked, ...names, bytes: bytes.length, warnings, values };
}

// Texts of a model, which protobuf leaves as bytes

/** A name, or nothing where the bytes are no UTF-8. */
function asName(bytes) {
  return bytes === undefined ? "" : decode(bytes);
}

/** A text, or what Python shows of bytes that are no UTF-8. */
function asText(bytes) {
  return asName(bytes) ?? bytesText(bytes.subarray(0, 80));
}

function asRepr(bytes) {
  const name = asName(bytes);
  return name === undefined ? bytesText(bytes.subarray(0, 80)) : repr(cut(name));
}

function cut(name) {
  return Array.from((name ?? "").slice(0, 160)).slice(0, 80).join("");
}

// The model around the graph

function requireHeader(model, where) {
  if (!model.given.has("graph")) {
    fail("PLX_ONNX_PARSE", where);
  }
  const version = model.ir_version ?? 0;
  if (version !== PROFILE.ir_version) {
    fail("PLX_ONNX_IR_VERSION", where, { version, expected: PROFILE.ir_version });
  }
  const imports = model.opset_import ?? [];
  imports.forEach((opset) => requireDomain(asText(opset.domain), where));
  const versions = imports.map((opset) => opset.version ?? 0);
  if (versions.length !== 1 || versions[0] !== PROFILE.opset) {
    const found = { version: list(versions.slice(0, 4)), expected: PROFILE.opset };
    fail("PLX_ONNX_OPSET", where, found);
  }
}

function requireDomain(domain, where) {
  if (domain !== "" && domain !== "ai.onnx") {
    fail("PLX_ONNX_FOREIGN_DOMAIN", where, { domain: cut(domain) });
  }
}

/** What ONNX can hold besides nodes and initializers has no place here. */
function requireFeatures(model, graph, where) {
  const features = {
    "local functions": model.functions,
    "training graphs": model.training_info,
    "sparse initializers": graph.sparse_initializer,
    "quantization annotations": graph.quantization_annotation,
    "stated shapes of intermediates": graph.value_info,
  };
  for (const [feature, found] of Object.entries(features)) {
    if (found?.length) {
      fail("PLX_ONNX_FEATURE", where, { feature });
    }
  }
}

function requireCounts(graph, where, limits) {
  for (const [what, field] of [["nodes", "node"], ["initializers", "initializer"]]) {
    const count = graph[field]?.length ?? 0;
    if (count > limits[what]) {
      tooLarge(where, what, count, limits[what]);
    }
  }
  const given = (graph.node ?? []).map((node) => node.name).filter((name) => name?.length);
  const named = given.map(asName);
  if (!named.every((name) => name && isPrintable(name))) {
    fail("PLX_ONNX_NAME_INVALID", where);
  }
  if (new Set(named).size !== named.length) {
    fail("PLX_ONNX_DUPLICATE_NAME", where, { name: "of a node" });
  }
}

/** Names in order, float32, rows named N, and fixed sizes. */
function requireSignature(values, expected, where) {
  const wanted = Object.entries(expected);
  const fits = wanted.every(([name, shape], k) => {
    const type = values[k]?.type?.tensor_type ?? {};
    const sizes = (type.shape?.dim ?? []).map(sizeOf);
    return values[k] && asText(values[k].name) === name && (type.elem_type ?? 0) === 1
      && sizes.length === shape.length + 1
      && [PROFILE.rows, ...shape].every((size, i) => size === sizes[i]);
  });
  if (values.length !== wanted.length || !fits) {
    const text = wanted.map(([name, shape]) => `${name}[${[PROFILE.rows, ...shape].join()}]`);
    const about = { what: "inputs and outputs", expected: `${text.join(", ")} float32` };
    fail("PLX_ONNX_IO_SIGNATURE", where, about);
  }
}

function sizeOf(dimension) {
  const isNumber = dimension.given.has("dim_value");
  return isNumber ? dimension.dim_value : asText(dimension.dim_param);
}

function* warningsOf(model, graph, where) {
  const [nodes, tensors] = [graph.node ?? [], graph.initializer ?? []];
  const read = new Set(nodes.flatMap((node) => (node.input ?? []).map(asName)));
  for (const tensor of tensors) {
    const name = asName(tensor.name);
    if (!read.has(name)) {
      yield issue("PLX_ONNX_UNUSED_INITIALIZER", `${where}:${cut(name)}`);
    }
  }
  const parts = [model, graph, ...nodes, ...tensors];
  if (parts.some((part) => part.metadata_props?.length || part.doc_string?.length)) {
    yield issue("PLX_ONNX_METADATA", where);
  }
}

// Initializers

/** A constant; only raw data of the declared size is accepted. */
function initializer(tensor, where, limits) {
  if (tensor.data_location || tensor.external_data?.length) {
    fail("PLX_ONNX_EXTERNAL_DATA", where);
  }
  const type = TYPES[tensor.data_type ?? 0];
  if (!type) {
    fail("PLX_ONNX_TENSOR_TYPE", where, { type: tensor.data_type ?? 0 });
  }
  const shape = tensor.dims ?? [];
  if (shape.length > limits.tensor_rank || shape.some((size) => size < 1)) {
    const what = `sizes ${tuple(shape.slice(0, 8))} are not allowed`;
    fail("PLX_ONNX_TENSOR_DATA", where, { what });
  }
  const raw = tensor.raw_data ?? new Uint8Array(0);
  const other = OTHER_DATA.some((name) => tensor[name]?.length) || tensor.given.has("segment");
  if (product(shape) * ARRAYS[type].BYTES_PER_ELEMENT !== raw.length || other) {
    fail("PLX_ONNX_TENSOR_DATA", where, { what: "raw data of the declared size is required" });
  }
  const value = typed(ARRAYS[type], raw);
  if (type === FLOAT && !value.every(Number.isFinite)) {
    fail("PLX_ONNX_NON_FINITE_WEIGHT", where);
  }
  return new Tensor(type, shape, value);
}

// Nodes

function define(values, name, tensor, where) {
  if (!name || !isPrintable(name)) {
    fail("PLX_ONNX_NAME_INVALID", where);
  }
  if (values.has(name)) {
    fail("PLX_ONNX_DUPLICATE_NAME", where, { name: cut(name) });
  }
  values.set(name, tensor);
}

/** Gives every value its shape: the nodes, and what they cost per row. */
function walk(protos, values, where, limits) {
  const nodes = [];
  let [macs, floats, work] = [0, 0, 0];
  for (const [index, proto] of protos.entries()) {
    const { node, inputs } = readNode(proto, values, `${where}:node ${index}`, limits);
    if (node.inputs.every((tensor) => tensor === null || tensor.isConstant)) {
      node.badShape("no input depends on the network's inputs");
    }
    const tensors = OPERATORS.get(node.op).rule(node);
    const outputs = (proto.output ?? []).map(asName);
    if (tensors.length !== outputs.length) {
      const what = `${node.op} has ${tensors.length} outputs`;
      fail("PLX_ONNX_ATTRIBUTE", node.where, { what });
    }
    for (const [k, tensor] of tensors.entries()) {
      requireSize(tensor, node, limits);
      define(values, outputs[k], new Tensor(tensor.type, tensor.shape), node.where);
      floats += tensor.size;
    }
    macs += products(node);
    work += nanoseconds(node, tensors);
    requireCost(node.where, macs, floats, work, limits);
    nodes.push({ node, inputs, outputs });
  }
  return { macs, floats, nanoseconds: work, nodes };
}

function readNode(proto, values, where, limits) {
  requireDomain(asText(proto.domain), where);
  const op = asText(proto.op_type);
  if (!OPERATORS.has(op) || proto.overload?.length) {
    fail("PLX_ONNX_OP_NOT_ALLOWED", where, { op: cut(op) });
  }
  const { least, most, attributes } = OPERATORS.get(op);
  const names = (proto.input ?? []).map(asText);
  const outputs = proto.output?.length ?? 0;
  const fits = names.length >= least && names.length <= Math.min(most, limits.node_inputs);
  if (!fits || outputs > limits.node_outputs) {
    const what = `${op} with ${names.length} inputs and ${outputs} outputs`;
    fail("PLX_ONNX_ATTRIBUTE", where, { what });
  }
  for (const name of names) {
    if (name !== "" && !values.has(name)) {
      fail("PLX_ONNX_UNDEFINED_NAME", where, { name: cut(name) });
    }
  }
  const inputs = names.map((name) => (name === "" ? null : values.get(name)));
  const given = readAttributes(proto.attribute ?? [], op, attributes, where, limits);
  return { node: new Node(op, where, inputs, given, outputs), inputs: names };
}

function readAttributes(protos, op, allowed, where, limits) {
  const attributes = new Map();
  for (const proto of protos) {
    const name = asText(proto.name);
    if ([GRAPH, GRAPHS].includes(proto.type) || proto.given.has("g") || proto.graphs?.length) {
      fail("PLX_ONNX_SUBGRAPH", where, { name: cut(name) });
    }
    if (!allowed.includes(name) || attributes.has(name) || proto.ref_attr_name?.length) {
      const what = `${op}: attribute ${asRepr(proto.name)}`;
      fail("PLX_ONNX_ATTRIBUTE", where, { what });
    }
    const stated = [...proto.given].filter((f) => !["name", "type", VALUES[proto.type]].includes(f));
    if (stated.length) {
      fail("PLX_ONNX_ATTRIBUTE", where, { what: `${op}: ${asRepr(proto.name)} holds more` });
    }
    attributes.set(name, attributeValue(proto, name, where, limits));
  }
  return attributes;
}

/** The value of an attribute of the type and range that its name has in ONNX. */
function attributeValue(proto, name, where, limits) {
  const { type } = proto;
  if (["alpha", "beta"].includes(name) && type === FLOAT_ATTRIBUTE) {
    return proto.f ?? 0;
  }
  const ints = proto.ints ?? [];
  if (name === "perm" && type === INTS && ints.length <= limits.tensor_rank) {
    return ints;
  }
  const number = proto.i ?? 0;
  if (["axis", "to"].includes(name) && type === INT) {
    return number;
  }
  if (FLAGS.includes(name) && type === INT && (number === 0 || number === 1)) {
    return number;
  }
  return fail("PLX_ONNX_ATTRIBUTE", where, { what: `${name}: wrong type or range` });
}

function requireSize(tensor, node, limits) {
  if (!tensor.size || tensor.shape.length + 1 > limits.tensor_rank) {
    node.badShape(`the result ${tuple(tensor.shape)} is empty or has too many axes`);
  }
  if (tensor.size > limits.sample_floats) {
    tooCostly(node.where, tensor.size, "elements", limits.sample_floats);
  }
}

function requireCost(where, macs, floats, work, limits) {
  if (macs > limits.sample_macs) {
    tooCostly(where, macs, "multiply-adds", limits.sample_macs);
  }
  if (floats > limits.sample_floats_sum) {
    tooCostly(where, floats, "elements in all", limits.sample_floats_sum);
  }
  if (work > limits.sample_nanoseconds) {
    tooCostly(where, Math.round(work), "nanoseconds of work", limits.sample_nanoseconds);
  }
}

function tooCostly(where, size, what, limit) {
  fail("PLX_ONNX_COST", where, { size, what, limit });
}

function requireOutputs(values, expected, where) {
  for (const [name, shape] of Object.entries(expected)) {
    const found = values.get(name);
    if (!found || found.isConstant) {
      fail("PLX_ONNX_UNDEFINED_NAME", `${where}:outputs`, { name });
    }
    if (found.type !== FLOAT || tuple(found.shape) !== tuple(shape)) {
      const what = `${name}, computed as ${found.type} ${tuple(found.shape)},`;
      const about = { what, expected: `float32 ${tuple(shape)}` };
      fail("PLX_ONNX_IO_SIGNATURE", `${where}:outputs`, about);
    }
  }
}

