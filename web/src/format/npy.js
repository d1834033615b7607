// Arrays (plux.md, A1 to A4): one canonical header, and nothing else.

import { asciiText, startsWith, view } from "./bytes.js";
import { fail } from "./issues.js";
import { LIMITS } from "./tables.js";
import { tuple } from "./text.js";

const MAGIC = Uint8Array.from([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0]); // \x93NUMPY, 1.0
const HEADER =
  /^\{'descr': '(<f4|<f8|<u4|\|u1)', 'fortran_order': False, 'shape': \(([0-9, ]{0,64})\), \} *\n$/;
const START = MAGIC.length + 2;
const TYPES = { "<f4": Float32Array, "<f8": Float64Array, "<u4": Uint32Array, "|u1": Uint8Array };

/** An array as { shape, data }; nothing is allocated before the header fits the data. */
export function readNpy(bytes, where, type, limits = LIMITS) {
  if (bytes.length > limits.array_bytes) {
    fail("PLX_NPY_TOO_LARGE", where, { size: bytes.length, limit: limits.array_bytes });
  }
  if (!startsWith(bytes, MAGIC) || bytes.length < START) {
    fail("PLX_NPY_HEADER", where, { what: "version 1.0 is required" });
  }
  const end = START + view(bytes).getUint16(MAGIC.length, true);
  const header = asciiText(bytes.subarray(START, end));
  const match = HEADER.exec(header);
  const sizes = match ? match[2].split(",").map((size) => size.trim()).filter(Boolean) : [];
  const stated = sizes.filter((size) => /^[0-9]+$/.test(size)).map(BigInt);
  if (!match || header !== canonical(match[1], stated) || end > bytes.length) {
    fail("PLX_NPY_HEADER", where, { what: "the header is not in canonical form" });
  }
  return contents(bytes.subarray(end), where, type, match[1], stated);
}

function canonical(type, shape) {
  const text = `{'descr': '${type}', 'fortran_order': False, 'shape': ${tuple(shape)}, }`;
  const fill = (64 - ((START + text.length + 1) % 64)) % 64;
  return `${text}${" ".repeat(fill)}\n`;
}

function contents(bytes, where, type, stored, stated) {
  if (stored !== type) {
    fail("PLX_NPY_TYPE", where, { dtype: stored, expected: type });
  }
  const Kind = TYPES[type];
  const expected = stated.reduce((a, b) => a * b, 1n) * BigInt(Kind.BYTES_PER_ELEMENT);
  const most = BigInt(LIMITS.array_bytes);
  if (BigInt(bytes.length) !== expected || stated.some((size) => size > most)) {
    fail("PLX_NPY_SIZE", where, { size: bytes.length, expected });
  }
  const data = typed(Kind, bytes);
  if (type.includes("f") && !data.every(Number.isFinite)) {
    fail("PLX_NPY_NON_FINITE", where);
  }
  return { shape: stated.map(Number), data };
}

/** Bytes as numbers, copied only where they are not aligned. */
export function typed(Kind, bytes) {
  const size = Kind.BYTES_PER_ELEMENT;
  const aligned = bytes.byteOffset % size ? bytes.slice() : bytes;
  return new Kind(aligned.buffer, aligned.byteOffset, bytes.length / size);
}

/** Compares a shape; null stands for any size. */
export function requireShape({ shape }, where, expected) {
  const fits = (wanted, k) => wanted === null || wanted === shape[k];
  if (shape.length !== expected.length || !expected.every(fits)) {
    const wanted = expected.map((size) => size ?? "any").join(", ");
    fail("PLX_NPY_SHAPE", where, { shape: tuple(shape), expected: `(${wanted})` });
  }
}
