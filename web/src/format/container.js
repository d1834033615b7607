// The stored zip that a bundle is: accepted exactly as its one writer makes it (plux.md, C1 to C10).

import { crc32, sameBytes, view } from "./bytes.js";
import { fail } from "./issues.js";
import { LIMITS } from "./tables.js";

const ALIGNMENT = 64;
const PADDING_ID = 0x1986;
const PART = /^(?!(?:aux|con|nul|prn|com[0-9]|lpt[0-9])(?:\.|$))[a-z0-9_](?:[a-z0-9_.-]*[a-z0-9_-])?$/;
const LOCAL_SIZE = 30;
const CENTRAL_SIZE = 46;
const END_SIZE = 22;
const [LOCAL, CENTRAL, END] = [0x04034b50, 0x02014b50, 0x06054b50];
const [NEEDED, MADE_BY, DATE, MODE] = [10, 0x0314, 0x0021, 0o100644 * 65536];
const [ENCRYPTED, DESCRIPTOR] = [1, 8];
const ZIP64 = 0xffffffff;

// Fields of a directory record: name, bytes.
const RECORD = [
  ["signature", 4], ["version made by", 2], ["version", 2], ["flags", 2], ["method", 2],
  ["time", 2], ["date", 2], ["CRC-32", 4], ["compressed size", 4], ["size", 4], ["name", 2],
  ["extra field", 2], ["comment", 2], ["disk", 2], ["internal attributes", 2], ["attributes", 4],
  ["offset", 4],
];

/**
 * Members of a bundle in their order: name -> { name, header, start, size, crc }.
 *
 * The walk goes from the first byte to the last, so nothing can hide between members.
 */
export function scan(data, limits = LIMITS) {
  if (data.length > limits.file_bytes) {
    fail("PLX_FILE_TOO_LARGE", "file", { size: data.length, limit: limits.file_bytes });
  }
  const { count, offset } = readEnd(data);
  const entries = new Map();
  const folders = new Set();
  for (let position = 0; position < offset; ) {
    const entry = readLocal(data, position, offset);
    requireName(entry.name, entries, folders, limits);
    entries.set(entry.name, entry);
    position = entry.start + entry.size;
    if (entries.size > limits.members) {
      fail("PLX_ZIP_TOO_MANY_MEMBERS", "file", { count: entries.size, limit: limits.members });
    }
  }
  readDirectory(data, offset, [...entries.values()], count);
  for (const entry of entries.values()) {
    if (crc32(member(data, entry)) !== entry.crc) {
      fail("PLX_ZIP_CRC", entry.name);
    }
  }
  return entries;
}

/** The bytes of a member, without a copy. */
export function member(data, entry) {
  return data.subarray(entry.start, entry.start + entry.size);
}

// The end record

function readEnd(data) {
  const start = data.length - END_SIZE;
  if (start < 0 || view(data).getUint32(start, true) !== END) {
    explainEnd(data);
  }
  const record = view(data.subarray(start));
  const [disk, first, here, count] = [4, 6, 8, 10].map((at) => record.getUint16(at, true));
  const [size, offset] = [12, 16].map((at) => record.getUint32(at, true));
  const where = `byte ${start}`;
  if (record.getUint16(20, true)) {
    fail("PLX_ZIP_COMMENT", where);
  }
  if (size === ZIP64 || offset === ZIP64 || here === 0xffff || count === 0xffff) {
    fail("PLX_ZIP_ZIP64", where);
  }
  if (disk || first || here !== count) {
    fail("PLX_ZIP_HEADER_MISMATCH", where, { field: "several disks" });
  }
  if (offset + size !== start) {
    fail("PLX_ZIP_HEADER_MISMATCH", where, { field: "place of the directory" });
  }
  return { count, offset };
}

/** Says why the file does not end with an end record. */
function explainEnd(data) {
  const first = data.length < 4 ? 0 : view(data).getUint32(0, true);
  if (first !== LOCAL && first !== END) {
    fail("PLX_ZIP_BAD_SIGNATURE", "byte 0");
  }
  const found = lastEnd(data);
  if (found < 0 || found + END_SIZE > data.length) {
    fail("PLX_ZIP_TRUNCATED", `byte ${data.length}`);
  }
  const extra = data.length - found - END_SIZE;
  if (view(data).getUint16(found + END_SIZE - 2, true) === extra) {
    fail("PLX_ZIP_COMMENT", `byte ${found}`);
  }
  fail("PLX_ZIP_TRAILING_DATA", `byte ${found + END_SIZE}`, { size: extra });
}

function lastEnd(data) {
  const bytes = view(data);
  for (let at = data.length - 4; at >= 0; at--) {
    if (data[at] === 0x50 && bytes.getUint32(at, true) === END) {
      return at;
    }
  }
  return -1;
}

// Members

/** Reads a local header, which must be the one that the writer makes. */
function readLocal(data, position, limit) {
  const where = `byte ${position}`;
  const bytes = view(data);
  if (position + 4 > data.length || bytes.getUint32(position, true) !== LOCAL) {
    fail(position ? "PLX_ZIP_GAP" : "PLX_ZIP_BAD_SIGNATURE", where);
  }
  if (position + LOCAL_SIZE > limit) {
    fail("PLX_ZIP_OVERLAP", where);
  }
  const short = (at) => bytes.getUint16(position + at, true);
  const long = (at) => bytes.getUint32(position + at, true);
  const [crc, size] = [long(14), long(22)];
  requirePlain(where, short(6), short(8), long(18), size);
  requireCanonical(where, "version", short(4), NEEDED);
  requireCanonical(where, "flags", short(6), 0);
  requireCanonical(where, "time", short(10), 0);
  requireCanonical(where, "date", short(12), DATE);
  const nameStart = position + LOCAL_SIZE;
  const nameEnd = nameStart + short(26);
  const start = nameEnd + short(28);
  if (start + size > limit) {
    fail("PLX_ZIP_OVERLAP", where);
  }
  const name = String.fromCharCode(...data.subarray(nameStart, nameEnd));
  if (start % ALIGNMENT) {
    fail("PLX_ZIP_MISALIGNED", name, { offset: start });
  }
  if (!sameBytes(data.subarray(nameEnd, start), padding(position, name.length))) {
    fail("PLX_ZIP_GAP", `byte ${nameEnd}`);
  }
  return { name, header: position, start, size, crc };
}

function requirePlain(where, flags, method, packed, size) {
  if (flags & ENCRYPTED) {
    fail("PLX_ZIP_ENCRYPTED", where);
  }
  if (flags & DESCRIPTOR) {
    fail("PLX_ZIP_DATA_DESCRIPTOR", where);
  }
  if (method) {
    fail("PLX_ZIP_COMPRESSED", where, { method });
  }
  if (packed === ZIP64 || size === ZIP64) {
    fail("PLX_ZIP_ZIP64", where);
  }
  if (packed !== size) {
    const field = "compressed size of a stored member";
    fail("PLX_ZIP_HEADER_MISMATCH", where, { field });
  }
}

function requireCanonical(where, field, value, expected) {
  if (value !== expected) {
    fail("PLX_ZIP_NOT_CANONICAL", where, { field, value, expected });
  }
}

/** The extra field that moves the data of a member to a multiple of 64. */
function padding(offset, nameSize) {
  let size = (ALIGNMENT - ((offset + LOCAL_SIZE + nameSize) % ALIGNMENT)) % ALIGNMENT;
  if (size > 0 && size < 4) {
    size += ALIGNMENT;
  }
  const field = new Uint8Array(size);
  if (size) {
    view(field).setUint16(0, PADDING_ID, true);
    view(field).setUint16(2, size - 4, true);
  }
  return field;
}

function requireName(name, entries, folders, limits) {
  const parts = name.split("/");
  const longest = Math.max(...parts.map((part) => part.length));
  const bad = parts.length > limits.name_depth || longest > limits.name_part_bytes;
  if (bad || !parts.every((part) => PART.test(part))) {
    fail("PLX_ZIP_NAME_INVALID", "directory", { name: name.slice(0, 80) });
  }
  const above = parts.slice(1).map((_, k) => parts.slice(0, k + 1).join("/"));
  if (entries.has(name) || folders.has(name) || above.some((folder) => entries.has(folder))) {
    fail("PLX_ZIP_NAME_DUPLICATE", "directory", { name });
  }
  above.forEach((folder) => folders.add(folder));
}

// The directory

/** The directory must say what the local headers say, in their order. */
function readDirectory(data, offset, entries, count) {
  if (count !== entries.length) {
    fail("PLX_ZIP_HEADER_MISMATCH", "directory", { field: "number of members" });
  }
  for (const entry of entries) {
    const expected = record(entry);
    const found = data.subarray(offset, offset + expected.length);
    if (!sameBytes(found, expected)) {
      explainRecord(found, expected, entry.name);
    }
    offset += expected.length;
  }
  if (offset !== data.length - END_SIZE) {
    fail("PLX_ZIP_GAP", `byte ${offset}`);
  }
}

/** The directory record of a member. */
function record({ name, header, size, crc }) {
  const values = [
    CENTRAL, MADE_BY, NEEDED, 0, 0, 0, DATE, crc, size, size, name.length, 0, 0, 0, 0, MODE, header,
  ];
  const bytes = new Uint8Array(CENTRAL_SIZE + name.length);
  let at = 0;
  RECORD.forEach(([, width], k) => {
    view(bytes)[width === 4 ? "setUint32" : "setUint16"](at, values[k], true);
    at += width;
  });
  bytes.set(Array.from(name, (character) => character.charCodeAt(0)), CENTRAL_SIZE);
  return bytes;
}

/** Says which field of a directory record is not the member's. */
function explainRecord(found, expected, name) {
  if (found.length < CENTRAL_SIZE) {
    fail("PLX_ZIP_HEADER_MISMATCH", name, { field: "the record is missing" });
  }
  let at = 0;
  const different = RECORD.filter(([, width]) => {
    at += width;
    return !sameBytes(found.subarray(at - width, at), expected.subarray(at - width, at));
  }).map(([field]) => field);
  if (different.join() === "attributes") {
    fail("PLX_ZIP_NOT_REGULAR", name);
  }
  fail("PLX_ZIP_HEADER_MISMATCH", name, { field: different.join(", ") || "name" });
}
