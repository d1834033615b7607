// Issues (spec/ISSUES.md): what is wrong with a file, in the words of `purelight-validate`.

import { CODES, LIMITS, LONGEST } from "./tables.js";
import { general, plain, repr } from "./text.js";

const FIELD = /\{(\w+)(!r)?(?::\.(\d+))?\}/g;

/** A fault in a file, with its issue. */
export class FormatError extends Error {
  constructor(found) {
    super(`${found.code} at ${found.location}: ${found.message}`);
    this.issue = found;
  }
}

/** An issue; the file's own words in it are made fit to be shown. */
export function issue(code, location, values = {}) {
  const [severity, template, rule] = CODES[code];
  const message = template.replace(FIELD, (_, name, quoted, digits) => {
    if (digits) {
      return general(values[name], Number(digits), true);
    }
    const text = plain(values[name], LONGEST);
    return quoted ? repr(text) : text;
  });
  return { code, severity, location: plain(location, LONGEST), message, rule };
}

/** Ends the work on a part of a file. */
export function fail(code, location, values = {}) {
  throw new FormatError(issue(code, location, values));
}

/** Issues in the order found, no more of each severity than a report holds and one. */
export class Findings {
  constructor(most = LIMITS.issues) {
    this.most = most;
    this.errors = [];
    this.warnings = [];
  }

  add(found) {
    if (!this.isFull(found.code)) {
      this.ofKind(found.code).push(found);
    }
  }

  /** Whether there are enough issues as severe as a code. */
  isFull(code) {
    return this.ofKind(code).length > this.most;
  }

  ofKind(code) {
    return CODES[code][0] === "error" ? this.errors : this.warnings;
  }

  /** Errors, then warnings, up to the limit; and whether there were more. */
  report() {
    const ranked = [...this.errors, ...this.warnings];
    return { issues: ranked.slice(0, this.most), truncated: ranked.length > this.most };
  }
}
