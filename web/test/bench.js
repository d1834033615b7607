// For tests: the page's translator and its graphics, without the page around them.

import { inspect } from "../src/format/profile.js";
import { shaderOf } from "../src/network/shader.js";
import { evaluate } from "../src/page/golden.js";
import { Gpu } from "../src/page/gpu.js";

let gpu;

/** Evaluates an appearance network (base64) on rows of inputs (lists of numbers) in WebGL. */
globalThis.evaluateOnGpu = async (model, inputs, count) => {
  gpu ??= new Gpu(document.createElement("canvas"));
  const bytes = Uint8Array.from(atob(model), (character) => character.charCodeAt(0));
  const network = inspect(bytes, "appearance", "networks/appearance.onnx");
  const shader = shaderOf(new Map([["appearance", network]]), gpu.widest);
  const rows = Object.fromEntries(
    Object.entries(inputs).map(([name, numbers]) => [name, Float32Array.from(numbers)]),
  );
  const results = await evaluate(gpu, "appearance", shader, { inputs: rows, count });
  return results ? Array.from(results.radiance, String) : gpu.fault;
};
