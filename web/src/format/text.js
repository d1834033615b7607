// Texts as Python writes them, so that a report here reads as `purelight-validate` prints it.

const PRINTABLE = /^(?:[^\p{C}\p{Z}]| )*$/u;
const SHORT = { "\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t" };

/** Whether a text can be shown in one line: nothing in it controls, hides or turns it. */
export function isPrintable(text) {
  return PRINTABLE.test(text);
}

/** A text that is fit to be shown in one line, at most `longest` characters of it. */
export function plain(value, longest) {
  const characters = Array.from(String(value).slice(0, 2 * longest + 2));
  const cut = characters.length > longest ? [...characters.slice(0, longest - 1), "…"] : characters;
  const text = cut.join("");
  return isPrintable(text) ? text : cut.map(escaped).join("");
}

/** A character by Python's codec `unicode_escape`. */
function escaped(character) {
  const code = character.codePointAt(0);
  if (character in SHORT) {
    return SHORT[character];
  }
  if (code >= 32 && code < 127) {
    return character;
  }
  const hexadecimal = code.toString(16);
  if (code < 256) {
    return `\\x${hexadecimal.padStart(2, "0")}`;
  }
  return code < 65536 ? `\\u${hexadecimal.padStart(4, "0")}` : `\\U${hexadecimal.padStart(8, "0")}`;
}

/** Python's repr of a printable text. */
export function repr(text) {
  const mark = text.includes("'") && !text.includes('"') ? '"' : "'";
  return mark + text.replaceAll("\\", "\\\\").replaceAll(mark, `\\${mark}`) + mark;
}

/** Python's repr of bytes. */
export function bytesText(bytes) {
  return `b'${Array.from(bytes, (byte) => escaped(String.fromCharCode(byte))).join("")}'`;
}

/** Python's repr of a list of whole numbers. */
export function list(numbers) {
  return `[${numbers.join(", ")}]`;
}

/** Python's repr of a tuple of whole numbers. */
export function tuple(numbers) {
  return numbers.length === 1 ? `(${numbers[0]},)` : `(${Array.from(numbers).join(", ")})`;
}

/**
 * A number by Python's format code `.{digits}g`; with `point`, by `.{digits}` alone.
 *
 * general(1234.5, 3) is "1.23e+03", general(2, 3, true) is "2.0".
 */
export function general(value, digits = 6, point = false) {
  if (!Number.isFinite(value)) {
    return Number.isNaN(value) ? "nan" : value < 0 ? "-inf" : "inf";
  }
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  const most = point ? digits - 1 : digits;
  if (value !== 0 && (exponent < -4 || exponent >= most)) {
    const size = String(Math.abs(exponent)).padStart(2, "0");
    return `${trimmed(mantissa)}e${exponent < 0 ? "-" : "+"}${size}`;
  }
  const text = trimmed(value.toFixed(Math.max(0, digits - 1 - exponent)));
  return point && !text.includes(".") ? `${text}.0` : text;
}

function trimmed(digits) {
  return digits.includes(".") ? digits.replace(/\.?0+$/, "") : digits;
}

/** A whole number with commas between thousands. */
export function grouped(value) {
  return String(value).replace(/\B(?=(\d{3})+$)/g, ",");
}

/** A number by Python's format code `.{digits}f`, ties to even where they are exact. */
export function fixed(value, digits) {
  const text = value.toFixed(digits);
  const scaled = Math.abs(value) * 10 ** digits;
  if (Math.floor(scaled) + 0.5 !== scaled || Math.floor(scaled) % 2) {
    return text;
  }
  return (Math.sign(value) * Math.floor(scaled) / 10 ** digits).toFixed(digits);
}
