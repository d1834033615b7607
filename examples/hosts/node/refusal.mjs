// What the host will not do (H6).

/** Ends the work on a request; the reason is the answer. */
export function refuse(reason) {
  throw new Error(reason);
}
