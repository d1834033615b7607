// JSON without its loose ends (plux.md, J1 to J3).
//
// Objects become Maps, so no key of a file can mean anything to JavaScript. Whole numbers beyond
// 2^53 become BigInts, and numbers written with a point or an exponent `Real`s: a size is no 1.0.

import { badUtf8, decode } from "./bytes.js";
import { fail } from "./issues.js";
import { LIMITS } from "./tables.js";

const NUMBER = /-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?/y;
const SPACE = /[ \t\n\r]*/y;
const TEXT = /[^"\\\u0000-\u001f]*/y;
const HEX = /^[0-9a-fA-F]{4}$/;
const ESCAPES = { '"': '"', "\\": "\\", "/": "/", b: "\b", f: "\f", n: "\n", r: "\r", t: "\t" };
const NAMED = ["NaN", "Infinity", "-Infinity"];
const CONSTANTS = { null: null, true: true, false: false };
const LONE = /\p{Surrogate}/u;

/** A number that is not written as a whole one. */
export class Real {
  constructor(value) {
    this.value = value;
  }
}

/** A number as JavaScript calculates with it, nothing for other values. */
export function toNumber(value) {
  if (value instanceof Real) {
    return value.value;
  }
  return typeof value === "number" || typeof value === "bigint" ? Number(value) : undefined;
}

/** Parses strict JSON; `where` is the location that issues name. */
export function parse(bytes, where, limits = LIMITS) {
  if (bytes.length > limits.manifest_bytes) {
    const size = { size: bytes.length, limit: limits.manifest_bytes };
    fail("PLX_JSON_TOO_LARGE", where, size);
  }
  const text = decode(bytes);
  if (text === undefined) {
    fail("PLX_JSON_ENCODING", where, { offset: badUtf8(bytes) });
  }
  if (text.startsWith("\ufeff")) {
    fail("PLX_JSON_ENCODING", where, { offset: 0 });
  }
  requireDepth(text, where, limits.json_depth);
  return new Parser(text, where, limits).document();
}

/** Bounds the nesting before the recursive parser sees the text. */
function requireDepth(text, where, limit) {
  let [depth, quoted, escaped] = [0, false, false];
  for (const character of text) {
    if (quoted) {
      quoted = escaped || character !== '"';
      escaped = character === "\\" && !escaped;
    } else if (character === '"') {
      quoted = true;
    } else if (character === "[" || character === "{") {
      depth += 1;
      if (depth > limit) {
        fail("PLX_JSON_TOO_DEEP", where, { limit });
      }
    } else if (character === "]" || character === "}") {
      depth -= 1;
    }
  }
}

class Parser {
  constructor(text, where, limits) {
    Object.assign(this, { text, where, limits, at: 0, lone: false });
  }

  document() {
    this.space();
    const value = this.value();
    this.space();
    if (this.at < this.text.length) {
      this.broken("Extra data", this.at);
    }
    if (this.lone) {
      fail("PLX_JSON_ENCODING", this.where, { offset: this.lone });
    }
    return value;
  }

  value() {
    const start = this.at;
    const character = this.text[start];
    if (character === '"') {
      this.at += 1;
      return this.string();
    }
    if (character === "{" || character === "[") {
      this.at += 1;
      return character === "{" ? this.object() : this.array();
    }
    for (const [word, value] of Object.entries(CONSTANTS)) {
      if (this.text.startsWith(word, start)) {
        this.at += word.length;
        return value;
      }
    }
    return this.number(start);
  }

  number(start) {
    const named = NAMED.find((word) => this.text.startsWith(word, start));
    if (named) {
      this.nonFinite(named);
    }
    NUMBER.lastIndex = start;
    const found = NUMBER.exec(this.text);
    if (!found) {
      this.broken("Expecting value", start);
    }
    const [text, fraction, power] = found;
    this.at = start + text.length;
    if (text.length > this.limits.json_number_digits) {
      this.nonFinite(text);
    }
    const value = Number(text);
    if (fraction || power) {
      return Number.isFinite(value) ? new Real(value) : this.nonFinite(text);
    }
    return Number.isSafeInteger(value) ? value : BigInt(text);
  }

  object() {
    const pairs = [];
    this.space();
    if (this.take("}")) {
      return new Map();
    }
    for (;;) {
      const start = this.at;
      if (!this.take('"')) {
        this.broken("Expecting property name enclosed in double quotes", start);
      }
      const key = this.string();
      this.space();
      if (!this.take(":")) {
        this.broken("Expecting ':' delimiter", this.at);
      }
      this.space();
      pairs.push([key, this.value()]);
      this.space();
      if (this.take("}")) {
        return this.unique(pairs);
      }
      this.comma();
    }
  }

  array() {
    const values = [];
    this.space();
    if (this.take("]")) {
      return values;
    }
    for (;;) {
      values.push(this.value());
      this.space();
      if (this.take("]")) {
        return values;
      }
      this.comma();
    }
  }

  comma() {
    if (!this.take(",")) {
      this.broken("Expecting ',' delimiter", this.at);
    }
    this.space();
  }

  unique(pairs) {
    const result = new Map(pairs);
    if (result.size !== pairs.length) {
      const counts = new Map();
      pairs.forEach(([key]) => counts.set(key, (counts.get(key) ?? 0) + 1));
      const most = pairs.reduce((a, [b]) => (counts.get(b) > counts.get(a) ? b : a), pairs[0][0]);
      const key = Array.from(most.slice(0, 160)).slice(0, 80).join("");
      fail("PLX_JSON_DUPLICATE_KEY", this.where, { key });
    }
    return result;
  }

  /** What follows a quotation mark. */
  string() {
    const start = this.at - 1;
    const parts = [];
    for (;;) {
      TEXT.lastIndex = this.at;
      parts.push(TEXT.exec(this.text)[0]);
      this.at += parts.at(-1).length;
      if (this.take('"')) {
        break;
      }
      if (this.at >= this.text.length) {
        this.broken("Unterminated string starting at", start);
      }
      if (!this.take("\\")) {
        this.broken("Invalid control character at", this.at);
      }
      parts.push(this.escape(start));
    }
    const text = parts.join("");
    if (LONE.test(text)) {
      this.lone ||= start + 1;
    }
    return text;
  }

  escape(start) {
    const at = this.at - 1;
    const character = this.text[this.at];
    if (character === undefined) {
      this.broken("Unterminated string starting at", start);
    }
    this.at += 1;
    if (character !== "u") {
      return ESCAPES[character] ?? this.broken("Invalid \\escape: ", at);
    }
    const digits = this.text.slice(this.at, this.at + 4);
    if (!HEX.test(digits)) {
      this.broken("Invalid \\uXXXX escape", this.at);
    }
    this.at += 4;
    return String.fromCharCode(parseInt(digits, 16));
  }

  space() {
    SPACE.lastIndex = this.at;
    this.at += SPACE.exec(this.text)[0].length;
  }

  take(mark) {
    const found = this.text[this.at] === mark;
    this.at += found ? 1 : 0;
    return found;
  }

  nonFinite(number) {
    fail("PLX_JSON_NON_FINITE", this.where, { number: number.slice(0, 40) });
  }

  broken(what, at) {
    const before = this.text.slice(0, at);
    const line = before.split("\n").length;
    const column = at - before.lastIndexOf("\n");
    const error = `${what}: line ${line} column ${column} (char ${at})`.slice(0, 80);
    fail("PLX_JSON_SYNTAX", this.where, { error });
  }
}

/** Whether a value is a list of so many numbers. */
export function isNumbers(value, count) {
  const isNumber = (x) => toNumber(x) !== undefined;
  return Array.isArray(value) && value.length === count && value.every(isNumber);
}
