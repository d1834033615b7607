// What printing a network takes: values as texts of their elements, and the lines so far.

import { BOOL, FLOAT, INT32, INT64 } from "../format/tensors.js";
import { Bounds } from "./bounds.js";
import { constant } from "./evaluate.js";

const MOST_LINES = 12_000;
const MOST_FOURS = 3_584; // Of arrays; graphics cards have room for 4,096 in a shader.
const COMPONENTS = "xyzw";
const TYPES = { float: "float", int: "int", long: "uvec2", bool: "bool" };

/** A network that is valid, but too large to be written as one function. */
export class TooComplex extends Error {}

/** A tensor of one row: the text of each element; `array` if they fill an array of vec4. */
export class Value {
  constructor(kind, elements, bounds, array = null) {
    Object.assign(this, { kind, elements, bounds, array });
  }

  get size() {
    return this.elements.length;
  }

  get isVector() {
    return this.array !== null;
  }
}

/** A constant; its elements are written as numbers where an operation asks for them. */
export class Literal {
  constructor(tensor) {
    this.tensor = tensor;
    this.size = tensor.size;
    this.array = null;
  }

  get bounds() {
    return (this.known ??= Bounds.of(constant(this.tensor)));
  }

  get kind() {
    return kindOf(this.tensor.type, this.tensor.type === INT64 ? this.bounds : null);
  }

  get elements() {
    const { kind } = this;
    return (this.texts ??= Array.from(this.tensor.value, (x) => number(kind, x)));
  }

  get isVector() {
    return false;
  }
}

/** What holds elements of a type: whole numbers of 64 bits only where they may be large. */
export function kindOf(type, bounds) {
  if (type === INT64) {
    return bounds.isShort ? "int" : "long";
  }
  return { [FLOAT]: "float", [INT32]: "int", [BOOL]: "bool" }[type];
}

/** A number of a kind. */
export function number(kind, value) {
  if (kind === "bool") {
    return value ? "true" : "false";
  }
  if (kind === "long") {
    const bits = BigInt.asUintN(64, BigInt(value));
    return `uvec2(${bits & 0xffffffffn}u, ${bits >> 32n}u)`;
  }
  if (kind === "int") {
    return Number(value) === -(2 ** 31) ? "(-2147483647 - 1)" : signed(String(value));
  }
  const text = String(Number(value.toPrecision(9)));
  return signed(/[.e]/.test(text) ? text : `${text}.0`);
}

function signed(text) {
  return text.startsWith("-") ? `(${text})` : text;
}

/** Elements as texts of vec4, the last one filled up with zeros. */
export function fours(elements) {
  const result = [];
  for (let k = 0; k < elements.length; k += 4) {
    const four = elements.slice(k, k + 4);
    const [base] = four[0].split(".");
    const whole = four.length === 4 && four.every((text, i) => text === `${base}.${COMPONENTS[i]}`);
    const padded = [...four, "0.0", "0.0", "0.0"].slice(0, 4);
    result.push(whole ? base : `vec4(${padded.join(", ")})`);
  }
  return result;
}

/** Collects lines, and gives names. */
export class Writer {
  constructor(store) {
    Object.assign(this, { store, lines: [], count: 0, fours: 0 });
  }

  add(line) {
    if (this.lines.push(line) > MOST_LINES) {
      throw new TooComplex(`more than ${MOST_LINES.toLocaleString("en")} steps`);
    }
  }

  name() {
    return `v${this.count++}`;
  }

  /** Writes an element down, and gives its name; what is a name or a number already stays. */
  element(kind, text) {
    const name = this.name();
    this.add(`${TYPES[kind]} ${name} = ${text};`);
    return name;
  }

  /** A value of elements that are written down. */
  scalars(kind, texts, bounds) {
    return new Value(kind, texts.map((text) => this.element(kind, text)), bounds);
  }

  /** Declares an array of vec4 that holds `size` floats. */
  array(size, start = "") {
    const length = Math.ceil(size / 4);
    this.fours += length;
    if (this.fours > MOST_FOURS) {
      throw new TooComplex(`layers of ${(4 * this.fours).toLocaleString("en")} numbers and more`);
    }
    const name = this.name();
    this.add(`vec4 ${name}[${length}]${start};`);
    return name;
  }

  /** The value that an array of vec4 holds. */
  vector(array, size, bounds) {
    const element = (_, k) => `${array}[${k >> 2}].${COMPONENTS[k & 3]}`;
    return new Value("float", Array.from({ length: size }, element), bounds, array);
  }

  /** The array of vec4 that holds a value, with zeros behind its end. */
  packed(value) {
    if (value.isVector && value.size % 4 === 0) {
      return value.array;
    }
    if (!value.packed) {
      const parts = fours(value.elements);
      value.packed = this.array(value.size, ` = vec4[${parts.length}](${parts.join(", ")})`);
    }
    return value.packed;
  }
}
