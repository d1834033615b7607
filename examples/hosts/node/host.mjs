// A PureLight host in Node.js for the conformance suite, written from spec/ alone.
//
// It answers each line of its standard input with one line (conformance.md, "Hosts").

import { createInterface } from "node:readline";

import { decode, encode, mapValues } from "./arrays.mjs";
import { Lamp } from "./lamp.mjs";
import { OPERATIONS } from "./operations.mjs";
import { refuse } from "./refusal.mjs";

const GREETING = {
  protocol: "1.0",
  host: "node",
  version: "1",
  operations: Object.keys(OPERATIONS),
};

let lamp = new Lamp();

async function answer(request) {
  switch (request.do) {
    case "hello":
      return String(request.protocol).split(".")[0] === "1"
        ? GREETING
        : refuse(`version ${request.protocol} of the protocol is not spoken here`);
    case "open":
      lamp = new Lamp(); // Also if the next one is refused.
      lamp = await Lamp.open(request.bundle);
      return {};
    case "evaluate":
      return { outputs: await evaluate(request) };
    default:
      return refuse(`cannot ${request.do}`);
  }
}

async function evaluate({ operation, parameters, inputs }) {
  if (!Object.hasOwn(OPERATIONS, operation)) {
    refuse(`cannot evaluate ${operation}`);
  }
  const outputs = await OPERATIONS[operation](lamp, mapValues(inputs, decode), parameters);
  return mapValues(outputs, encode);
}

function refusal(error) {
  return { refused: String(error.message).split("\n")[0] };
}

for await (const line of createInterface({ input: process.stdin })) {
  const request = JSON.parse(line);
  const reply = await answer(request).catch(refusal);
  process.stdout.write(`${JSON.stringify({ id: request.id, ...reply })}\n`);
}
