// The part of USD text that a bundle's layer may use (usd.md, U2), read by its own grammar.

import { asciiText, decode, startsWith } from "./bytes.js";
import { fail } from "./issues.js";
import { LIMITS, USD } from "./tables.js";
import { repr } from "./text.js";

const HEADER = new TextEncoder().encode("#usda 1.0\n");
const NAME = /^[A-Za-z_][A-Za-z0-9_]*$/;
const TYPES = new Set(USD.types);
const [LAYER_FIELDS, PRIM_FIELDS, PROPERTY_FIELDS] = [
  USD.layer_fields, USD.prim_fields, USD.property_fields,
].map((fields) => new Set(fields));
const SPECIAL = new Map([["asset", "path"], ["rel", "target"], ["dictionary", "dictionary"]]);
const SPECIAL_KINDS = [...SPECIAL.values()];
const NUMERIC = new Set(Array.from("0123456789.+-eE,()[] \t\ninfa", (c) => c.charCodeAt(0)));
const BRACKETS = new Map(Array.from("([)]", (c, k) => [c.charCodeAt(0), k < 2 ? 1 : -1]));

// Tokens of the grammar; every character stands for a byte.
const TOKENS = [
  ["word", /[A-Za-z_][A-Za-z0-9_:]{0,255}(?![A-Za-z0-9_:])/y],
  ["number", /(?:[-+]?\.?[0-9][-+0-9.eE]{0,63}|-inf)(?![-+0-9.A-Za-z_:])/y],
  ["text", /"""[^"\\]{0,65535}"""(?!")/y],
  ["text", /"[^"\\\x00-\x1f\x7f]{0,4095}(?:\\[ -~][^"\\\x00-\x1f\x7f]{0,4095}){0,255}"(?!")/y],
  ["path", /@[^@\x00-\x1f\x7f]{0,1023}@(?!@)/y],
  ["target", /<[A-Za-z0-9_:./]{0,1023}>/y],
  ["mark", /[\][(){}=,;.]/y],
];

/**
 * Reads a layer: a prim { name, metadata, properties, children } whose name is empty.
 *
 * Metadata and properties are { name, value, metadata }; a value is { kind, items, entries }.
 */
export function readLayer(bytes, name, limits = LIMITS) {
  if (bytes.length > limits.layer_bytes) {
    fail("PLX_MEMBER_TOO_LARGE", name, { size: bytes.length, limit: limits.layer_bytes });
  }
  if (!startsWith(bytes, HEADER) || bytes.includes(0)) {
    fail("PLX_USD_SYNTAX", name, { what: "this is no layer of USD text" });
  }
  if (decode(bytes) === undefined) {
    fail("PLX_USD_SYNTAX", name, { what: "the text is not UTF-8" });
  }
  return new LayerReader(bytes, name, limits).layer();
}

/** Steps through the tokens; each is looked at once. */
class LayerReader {
  constructor(bytes, name, limits) {
    Object.assign(this, { bytes, name, limits, left: limits.layer_words, level: 0 });
    this.text = asciiText(bytes);
    this.next = HEADER.length;
    this.step();
  }

  // Tokens

  /** Goes on to the next token: `kind`, empty at the end, `word` and `place`. */
  step() {
    this.place = this.skipSpace(this.next);
    this.kind = "";
    this.word = "";
    if (this.place === this.bytes.length) {
      return;
    }
    this.left -= 1;
    if (this.left < 0) {
      fail("PLX_USD_TOO_COMPLEX", this.name, { limit: this.limits.layer_words });
    }
    for (const [kind, pattern] of TOKENS) {
      pattern.lastIndex = this.place;
      if (pattern.test(this.text)) {
        this.kind = kind;
        this.next = pattern.lastIndex;
        this.word = decode(this.bytes.subarray(this.place, this.next)) ?? "";
        return;
      }
    }
    this.broken("no word, number, quotation or path of the grammar");
  }

  /** Where the next token begins, behind spaces and comments. */
  skipSpace(at) {
    for (;;) {
      const byte = this.bytes[at];
      if (byte === 32 || byte === 9 || byte === 10) {
        at += 1;
      } else if (byte === 35) {
        const end = this.bytes.indexOf(10, at);
        at = end < 0 ? this.bytes.length : end;
      } else {
        return at;
      }
    }
  }

  /** The next token, which must be of a kind. */
  take(kind, what) {
    if (this.kind !== kind) {
      this.broken(`expected ${what}`);
    }
    const { word } = this;
    this.step();
    return word;
  }

  /** The next token if it is one of these words or marks, else nothing. */
  accept(...words) {
    if ((this.kind !== "word" && this.kind !== "mark") || !words.includes(this.word)) {
      return "";
    }
    const { word } = this;
    this.step();
    return word;
  }

  require(mark) {
    if (!this.accept(mark)) {
      this.broken(`expected ${mark}`);
    }
  }

  broken(what) {
    fail("PLX_USD_SYNTAX", `${this.name}:byte ${this.place}`, { what });
  }

  /** A word that the grammar does not name; one that composes is told as such. */
  refuse(word, place) {
    const where = `${this.name}:byte ${place}`;
    const composing = USD.composing.find((part) => word.includes(part));
    if (composing) {
      fail("PLX_USD_COMPOSITION", where, { word: composing });
    }
    fail("PLX_USD_NOT_ALLOWED", where, { word });
  }

  // Layer and prims

  layer() {
    const prim = makePrim("");
    if (this.accept("(")) {
      prim.metadata = this.metadata(LAYER_FIELDS);
    }
    while (this.accept(...USD.specifiers)) {
      prim.children.push(this.prim());
    }
    if (this.kind === "word") {
      this.refuse(this.word, this.place);
    }
    if (this.kind) {
      this.broken("expected a prim");
    }
    return prim;
  }

  /** What follows def, over or class. */
  prim() {
    if (this.kind === "word") {
      this.step(); // The prim's type; unknown ones mean nothing.
    }
    const name = this.take("text", "the name of a prim").slice(1, -1);
    if (!NAME.test(name)) {
      this.broken(`${repr(name)} names no prim`);
    }
    const prim = makePrim(name);
    if (this.accept("(")) {
      prim.metadata = this.metadata(PRIM_FIELDS);
    }
    this.require("{");
    this.enter();
    while (!this.accept("}")) {
      this.statement(prim);
    }
    this.level -= 1;
    return prim;
  }

  enter() {
    this.level += 1;
    if (this.level > this.limits.layer_depth) {
      fail("PLX_USD_TOO_DEEP", this.name, { limit: this.limits.layer_depth });
    }
  }

  statement(prim) {
    if (this.accept(...USD.specifiers)) {
      prim.children.push(this.prim());
    } else if (!this.accept(";")) {
      prim.properties.push(this.property());
    }
  }

  property() {
    while (this.accept("custom", "uniform", "varying"));
    let place = this.place;
    let kind = this.take("word", "a property or a prim");
    if (kind !== "rel") {
      this.type(kind, place);
    }
    place = this.place;
    const name = this.take("word", "the name of a property");
    if (this.accept(".")) {
      const suffix = this.take("word", "connect");
      if (suffix !== "connect") {
        this.refuse(`${name}.${suffix}`, place);
      }
      kind = "rel";
    }
    const value = this.accept("=") ? this.value(kind) : undefined;
    const metadata = this.accept("(") ? this.metadata(PROPERTY_FIELDS) : [];
    return { name, value, metadata };
  }

  type(word, place) {
    if (!TYPES.has(word)) {
      this.refuse(word, place);
    }
    if (this.accept("[")) {
      this.require("]");
    }
  }

  // Metadata and dictionaries

  metadata(fields) {
    const found = [];
    while (!this.accept(")")) {
      if (this.kind === "text") {
        this.step(); // A comment.
      } else if (!this.accept(";")) {
        found.push(this.field(fields));
      }
    }
    return found;
  }

  field(fields) {
    this.accept("prepend", "append", "add");
    const { place } = this;
    const name = this.take("word", "a field of metadata");
    if (!fields.has(name)) {
      this.refuse(name, place);
    }
    this.require("=");
    return { name, value: this.value(""), metadata: [] };
  }

  dictionary() {
    this.enter();
    const entries = [];
    while (!this.accept("}")) {
      if (!this.accept(";")) {
        entries.push(this.entry());
      }
    }
    this.level -= 1;
    return { kind: "dictionary", items: [], entries };
  }

  entry() {
    const { place } = this;
    const kind = this.take("word", "a type");
    if (kind !== "dictionary") {
      this.type(kind, place);
    }
    const name = this.word;
    this.take(this.kind === "text" ? "text" : "word", "a key");
    this.require("=");
    return { name, value: this.value(kind), metadata: [] };
  }

  // Values

  /** A value for a type, `rel` or `dictionary`; of any kind for a field of metadata. */
  value(kind) {
    const { place } = this;
    const value = this.anyValue();
    const wanted = SPECIAL.get(kind) ?? "";
    const found = SPECIAL_KINDS.includes(value.kind) ? value.kind : "";
    if (found === wanted || (!kind && found !== "path")) {
      return value;
    }
    if (value.kind === "none" && kind !== "dictionary") {
      return value;
    }
    if (found === "path" || wanted === "path") {
      const path = Array.from(value.items[0] ?? value.kind).slice(0, 200).join("");
      fail("PLX_USD_PATH", `${this.name}:byte ${place}`, { path });
    }
    return this.broken(`the value of ${kind} may not be a ${value.kind}`);
  }

  anyValue() {
    if (this.accept("{")) {
      return this.dictionary();
    }
    if (this.kind === "mark" && (this.word === "(" || this.word === "[")) {
      return this.bracket();
    }
    if (!["word", "number", "text", "path", "target"].includes(this.kind)) {
      this.broken("expected a value");
    }
    const kind = this.kind === "word" && this.word === "None" ? "none" : this.kind;
    const value = { kind, items: [contents(kind, this.word)], entries: [] };
    this.step();
    return value;
  }

  /** A list of texts, paths or targets, or numbers. */
  bracket() {
    const opening = this.place;
    this.next = opening + 1;
    if (this.word === "[") {
      this.step();
      if (["text", "path", "target"].includes(this.kind)) {
        return this.list(this.kind);
      }
      if (this.accept("]")) {
        return { kind: "none", items: [], entries: [] };
      }
    }
    this.next = this.closing(opening);
    this.step();
    return { kind: "numbers", items: [], entries: [] };
  }

  list(kind) {
    const items = [];
    while (!this.accept("]")) {
      items.push(contents(kind, this.take(kind, `a ${kind}`)));
      if (!this.accept(",")) {
        this.require("]");
        break;
      }
    }
    return { kind, items, entries: [] };
  }

  /** Where brackets around numbers end. */
  closing(start) {
    let level = 0;
    for (let at = start; at < this.bytes.length; at++) {
      const byte = this.bytes[at];
      if (!NUMERIC.has(byte)) {
        break;
      }
      level += BRACKETS.get(byte) ?? 0;
      if (level === 0) {
        return at + 1;
      }
      if (level > USD.brackets) {
        break;
      }
    }
    return this.broken("brackets hold something else than numbers, or do not close");
  }
}

function makePrim(name) {
  return { name, metadata: [], properties: [], children: [] };
}

function contents(kind, text) {
  return ["text", "path", "target"].includes(kind) ? text.slice(1, -1) : text;
}
