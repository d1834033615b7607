// Protocol buffers, as far as a ModelProto needs them: bounded, by a table of fields, nothing else.

import { fail } from "./issues.js";

const [VARINT, FIXED64, BYTES, OPEN, CLOSE, FIXED32] = [0, 1, 2, 3, 4, 5];
const DEEPEST = 100; // Nested messages, as protobuf itself has it.
const WHOLE = 1n << 64n;

/**
 * A message's fields by name: numbers, bytes, messages; repeated ones as lists, absent ones undefined.
 *
 * A schema gives { number: [name, kind, options] }: kind is "int" (a number, a BigInt where it is
 * not exact), "int32", "float", "bytes", or a function that gives the schema of a message; options
 * are `many`, `oneof` with the names that exclude each other, and `known` values of an enum.
 */
export function decodeMessage(bytes, schema, where, depth = 0) {
  const message = { given: new Set() };
  readInto(message, bytes, schema, where, depth);
  return message;
}

function readInto(message, bytes, schema, where, depth) {
  if (depth > DEEPEST) {
    fail("PLX_ONNX_PARSE", where);
  }
  const walk = new Walk(bytes, where);
  while (walk.more()) {
    const { number, kind, value } = walk.field(depth);
    const entry = schema[number];
    if (entry) {
      store(message, entry, kind, value, where, depth);
    }
  }
}

function store(message, [name, kind, options = {}], wire, value, where, depth) {
  const values = valuesOf(kind, wire, value, where, options);
  if (!values?.length || (options.known && !options.known.includes(values[0]))) {
    return; // Empty, or of another type on the wire: a field that is not known.
  }
  for (const other of options.oneof ?? []) {
    if (other !== name) {
      delete message[other];
      message.given.delete(other);
    }
  }
  message.given.add(name);
  if (typeof kind === "function") {
    storeMessage(message, name, kind(), values[0], options, where, depth);
  } else if (options.many) {
    (message[name] ??= []).push(...values);
  } else {
    message[name] = values.at(-1);
  }
}

/** A message that occurs twice is one, as protobuf has it. */
function storeMessage(message, name, schema, bytes, { many }, where, depth) {
  if (many) {
    (message[name] ??= []).push(decodeMessage(bytes, schema, where, depth + 1));
  } else {
    message[name] ??= { given: new Set() };
    readInto(message[name], bytes, schema, where, depth + 1);
  }
}

function valuesOf(kind, wire, value, where, { many }) {
  if (kind === "bytes" || typeof kind === "function") {
    return wire === BYTES ? [value] : undefined;
  }
  if (kind === "float") {
    return wire === FIXED32 ? [floatOf(value)] : many && wire === BYTES ? [value] : undefined;
  }
  if (kind === "fixed64") {
    return wire === FIXED64 || (many && wire === BYTES) ? [value] : undefined;
  }
  if (wire === VARINT) {
    return [integer(kind, value)];
  }
  return many && wire === BYTES ? packed(kind, value, where) : undefined;
}

function floatOf(bytes) {
  return new DataView(bytes.buffer, bytes.byteOffset, 4).getFloat32(0, true);
}

function packed(kind, bytes, where) {
  const walk = new Walk(bytes, where);
  const values = [];
  while (walk.more()) {
    values.push(integer(kind, walk.varint()));
  }
  return values;
}

/** A varint as a signed number, a BigInt where a number is not exact. */
function integer(kind, value) {
  if (kind === "int32") {
    return Number(BigInt.asIntN(32, BigInt(value)));
  }
  if (typeof value === "number") {
    return value;
  }
  const signed = BigInt.asIntN(64, value % WHOLE);
  return Number.isSafeInteger(Number(signed)) ? Number(signed) : signed;
}

/** Steps over fields. */
export class Walk {
  constructor(bytes, where, start = 0, end = bytes.length) {
    Object.assign(this, { bytes, where, at: start, end });
  }

  more() {
    return this.at < this.end;
  }

  /** The next field: its number, its type on the wire, a number or a view of its bytes. */
  field(depth = 0) {
    const tag = this.varint();
    const [number, kind] = [Math.floor(Number(tag) / 8), Number(tag) % 8];
    if (Number(tag) > 0xffffffff || number === 0) {
      this.broken();
    }
    if (kind === VARINT) {
      return { number, kind, value: this.varint() };
    }
    if (kind === OPEN) {
      this.skipGroup(number, depth + 1);
      return { number, kind };
    }
    return { number, kind, value: this.content(kind) };
  }

  content(kind) {
    const fixed = { [FIXED64]: 8, [FIXED32]: 4 }[kind];
    if (kind !== BYTES && !fixed) {
      this.broken();
    }
    const size = fixed ?? Number(this.varint());
    if (this.at + size > this.end) {
      this.broken();
    }
    this.at += size;
    return this.bytes.subarray(this.at - size, this.at);
  }

  skipGroup(number, depth) {
    if (depth > DEEPEST) {
      this.broken();
    }
    for (;;) {
      const before = this.at;
      const tag = Number(this.varint());
      if (tag % 8 === CLOSE) {
        return Math.floor(tag / 8) === number ? undefined : this.broken();
      }
      this.at = before;
      this.field(depth);
    }
  }

  /** A number, a BigInt from 2^49 on. */
  varint() {
    let value = 0;
    for (let k = 0; k < 10; k++) {
      if (this.at >= this.end) {
        break;
      }
      const byte = this.bytes[this.at++];
      const part = byte & 127;
      value = k < 7 ? value + part * 2 ** (7 * k) : BigInt(value) + (BigInt(part) << BigInt(7 * k));
      if (byte < 128) {
        return value;
      }
    }
    return this.broken();
  }

  broken() {
    fail("PLX_ONNX_PARSE", this.where);
  }
}
