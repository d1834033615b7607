// ONNX models (onnx_profile.md, N1 and N2): what they hold is counted before it is read.

import { fail } from "./issues.js";
import { decodeMessage, Walk } from "./protobuf.js";
import { LIMITS } from "./tables.js";

const [GRAPH, INITIALIZER, RAW_DATA] = [7, 5, 9]; // Of ModelProto, GraphProto, TensorProto.
const BYTES = 2;
const FIELDS_EACH = 16; // Fields of an initializer: its sizes, name, type and data.
const MANY = { many: true };
const TYPES = Array.from({ length: 15 }, (_, k) => k);

const PAIR = { 1: ["key", "bytes"], 2: ["value", "bytes"] };
const PROPERTIES = ["metadata_props", () => PAIR, MANY];
const OPSET = { 1: ["domain", "bytes"], 2: ["version", "int"] };
const SIZE = ["dim_value", "dim_param"];
const DIMENSION = {
  1: ["dim_value", "int", { oneof: SIZE }],
  2: ["dim_param", "bytes", { oneof: SIZE }],
};
const SHAPE = { 1: ["dim", () => DIMENSION, MANY] };
const TENSOR_TYPE = { 1: ["elem_type", "int32"], 2: ["shape", () => SHAPE] };
const KINDS = ["tensor_type", "sequence_type", "map_type", "sparse_tensor_type", "optional_type"];
const TYPE = {
  1: ["tensor_type", () => TENSOR_TYPE, { oneof: KINDS }],
  4: ["sequence_type", () => ({ 1: ["elem_type", () => TYPE] }), { oneof: KINDS }],
  5: ["map_type", () => ({ 2: ["value_type", () => TYPE] }), { oneof: KINDS }],
  8: ["sparse_tensor_type", () => TENSOR_TYPE, { oneof: KINDS }],
  9: ["optional_type", () => ({ 1: ["elem_type", () => TYPE] }), { oneof: KINDS }],
};
const VALUE = { 1: ["name", "bytes"], 2: ["type", () => TYPE], 4: PROPERTIES };
const TENSOR = {
  1: ["dims", "int", MANY], 2: ["data_type", "int32"], 3: ["segment", () => ({})],
  4: ["float_data", "float", MANY], 5: ["int32_data", "int", MANY],
  6: ["string_data", "bytes", MANY], 7: ["int64_data", "int", MANY], 8: ["name", "bytes"],
  9: ["raw_data", "bytes"], 10: ["double_data", "fixed64", MANY],
  11: ["uint64_data", "int", MANY], 12: ["doc_string", "bytes"],
  13: ["external_data", () => PAIR, MANY], 14: ["data_location", "int", { known: [0, 1] }],
  16: PROPERTIES,
};
const SPARSE = { 1: ["values", () => TENSOR], 2: ["indices", () => TENSOR] };
const ATTRIBUTE = {
  1: ["name", "bytes"], 2: ["f", "float"], 3: ["i", "int"], 4: ["s", "bytes"],
  5: ["t", () => TENSOR], 6: ["g", () => GRAPHS], 7: ["floats", "float", MANY],
  8: ["ints", "int", MANY], 9: ["strings", "bytes", MANY], 10: ["tensors", () => TENSOR, MANY],
  11: ["graphs", () => GRAPHS, MANY], 13: ["doc_string", "bytes"], 14: ["tp", () => TYPE],
  15: ["type_protos", () => TYPE, MANY], 20: ["type", "int", { known: TYPES }],
  21: ["ref_attr_name", "bytes"], 22: ["sparse_tensor", () => SPARSE],
  23: ["sparse_tensors", () => SPARSE, MANY],
};
const NODE = {
  1: ["input", "bytes", MANY], 2: ["output", "bytes", MANY], 3: ["name", "bytes"],
  4: ["op_type", "bytes"], 5: ["attribute", () => ATTRIBUTE, MANY], 6: ["doc_string", "bytes"],
  7: ["domain", "bytes"], 8: ["overload", "bytes"], 9: PROPERTIES,
  10: ["device_configurations", () => ({}), MANY],
};
const GRAPHS = {
  1: ["node", () => NODE, MANY], 2: ["name", "bytes"], 5: ["initializer", () => TENSOR, MANY],
  10: ["doc_string", "bytes"], 11: ["input", () => VALUE, MANY], 12: ["output", () => VALUE, MANY],
  13: ["value_info", () => VALUE, MANY], 14: ["quantization_annotation", () => ({}), MANY],
  15: ["sparse_initializer", () => SPARSE, MANY], 16: PROPERTIES,
};
const FUNCTION = { 7: ["node", () => NODE, MANY] };
const TRAINING = { 1: ["initialization", () => GRAPHS], 2: ["algorithm", () => GRAPHS] };
const MODEL = {
  1: ["ir_version", "int"], 6: ["doc_string", "bytes"], 7: ["graph", () => GRAPHS],
  8: ["opset_import", () => OPSET, MANY], 14: PROPERTIES,
  20: ["training_info", () => TRAINING, MANY], 25: ["functions", () => FUNCTION, MANY],
  26: ["configuration", () => ({}), MANY],
};

/** The fields of a model, none of which is trusted yet. */
export function readModel(bytes, where, limits = LIMITS) {
  if (bytes.length > limits.network_bytes) {
    tooLarge(where, "bytes", bytes.length, limits.network_bytes);
  }
  requireSmallStructure(bytes, where, limits);
  return decodeMessage(bytes, MODEL, where);
}

export function tooLarge(where, what, size, limit) {
  fail("PLX_ONNX_TOO_LARGE", where, { what, size, limit });
}

/** Bounds the bytes that are no weights, and the fields of model, graph and initializers. */
function requireSmallStructure(bytes, where, limits) {
  const steps = limits.nodes + FIELDS_EACH * limits.initializers;
  const count = { left: steps, steps };
  let weights = 0;
  for (const graph of find(bytes, GRAPH, where, count)) {
    for (const tensor of find(graph, INITIALIZER, where, count)) {
      for (const raw of find(tensor, RAW_DATA, where, count)) {
        weights += raw.length;
      }
    }
  }
  const [size, limit] = [bytes.length - weights, limits.network_structure_bytes];
  if (size > limit) {
    tooLarge(where, "bytes besides weights", size, limit);
  }
}

/** Contents of the fields of one number that hold bytes. */
function* find(bytes, wanted, where, count) {
  const walk = new Walk(bytes, where);
  while (walk.more()) {
    const tag = Number(walk.varint());
    count.left -= 1;
    if (count.left < 0) {
      const what = "fields of model, graph and initializers";
      tooLarge(where, what, `over ${count.steps}`, count.steps);
    }
    const value = tag % 8 === 0 ? walk.varint() : walk.content(tag % 8);
    if (tag === wanted * 8 + BYTES) {
      yield value;
    }
  }
}
