// Bytes: UTF-8 as Python reads it, checksums, little-endian numbers.

import { sha256 } from "@noble/hashes/sha2.js";
import { bytesToHex } from "@noble/hashes/utils.js";

const DECODER = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });
const CRC = Uint32Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit++) {
    value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  }
  return value;
});

/** CRC-32 of a zip. */
export function crc32(bytes) {
  let value = 0xffffffff;
  for (let i = 0; i < bytes.length; i++) {
    value = CRC[(value ^ bytes[i]) & 255] ^ (value >>> 8);
  }
  return (value ^ 0xffffffff) >>> 0;
}

/** SHA-256 in hexadecimal. */
export function digest(bytes) {
  return bytesToHex(sha256(bytes));
}

/** The text of UTF-8 bytes, or nothing where they are none. */
export function decode(bytes) {
  try {
    return DECODER.decode(bytes);
  } catch {
    return undefined;
  }
}

/** Where bytes stop being UTF-8, -1 if they do not. */
export function badUtf8(bytes) {
  for (let at = 0; at < bytes.length; ) {
    const length = sequence(bytes, at);
    if (!length) {
      return at;
    }
    at += length;
  }
  return -1;
}

/** Length of the UTF-8 sequence at an offset, 0 if there is none (RFC 3629). */
function sequence(bytes, at) {
  const [first, second] = [bytes[at], bytes[at + 1]];
  if (first < 0x80) {
    return 1;
  }
  const length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  const least = { 0xe0: 0xa0, 0xf0: 0x90 }[first] ?? 0x80;
  const most = { 0xed: 0x9f, 0xf4: 0x8f }[first] ?? 0xbf;
  if (first < 0xc2 || first > 0xf4 || !(second >= least && second <= most)) {
    return 0;
  }
  const rest = bytes.subarray(at + 2, at + length);
  return rest.length === length - 2 && rest.every((byte) => (byte & 0xc0) === 0x80) ? length : 0;
}

/** Each byte as a character of its own, for patterns; only those of ASCII mean anything. */
export function asciiText(bytes) {
  return new TextDecoder("latin1").decode(bytes);
}

/** A view of little-endian numbers. */
export function view(bytes) {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

export function sameBytes(a, b) {
  return a.length === b.length && a.every((byte, i) => byte === b[i]);
}

export function startsWith(bytes, start) {
  return bytes.length >= start.length && sameBytes(bytes.subarray(0, start.length), start);
}
