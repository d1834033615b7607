// Golden vectors on the graphics card: does it give the numbers that the lamp's file holds?

import { DataTexture, FloatType, RGBAFormat } from "three";

import { KINDS } from "../format/tables.js";
import { compare } from "../format/vectors.js";
import { dispose } from "./gpu.js";

const AT_ONCE = 256; // Pixels.
const SIZES = { 1: "float", 2: "vec2", 3: "vec3" };
const SWIZZLES = { 2: ".xy", 3: ".xyz" };

/**
 * Evaluates a network on its golden vectors.
 *
 * Gives { missed, count, worst }: the largest error in units of what is allowed; or { refused }.
 */
export async function checkGolden(gpu, name, { shader, vectors }) {
  if (shader.refused || !gpu.exact) {
    return { refused: shader.refused ?? "this graphics card writes no whole floats" };
  }
  const results = await evaluate(gpu, name, shader, vectors);
  if (!results) {
    return { refused: `this graphics card does not compile it: ${gpu.fault.slice(0, 200)}` };
  }
  return { ...compare(vectors, results), count: vectors.count };
}

/** Outputs of a network by name for inputs by name, or nothing where its shader is not compiled. */
export async function evaluate(gpu, name, shader, { inputs, count }) {
  const { outputs } = KINDS[name];
  const widths = Object.values(outputs).map((shape) => shape.reduce((a, b) => a * b, 1));
  const fours = widths.reduce((sum, width) => sum + Math.ceil(width / 4), 0);
  const target = gpu.target(fours, count, { exact: true });
  const given = inputTexture(name, inputs, count);
  const uniforms = { given: { value: given }, ...gpu.uniforms(shader.textures) };
  const pass = gpu.pass(shader.source + program(name, outputs, fours), uniforms);
  const pixels = new Float32Array(fours * count * 4);
  const works = await gpu.compile(pass.scene);
  if (works) {
    const step = Math.max(1, Math.floor(AT_ONCE / fours)); // So that none takes long.
    for (let row = 0; row < count; row += step) {
      gpu.draw(pass.scene, null, target, [0, row, fours, Math.min(step, count - row)]);
      await gpu.finish();
    }
    gpu.renderer.readRenderTargetPixels(target, 0, 0, fours, count, pixels);
  }
  target.dispose();
  dispose(pass.scene);
  return works ? unpacked(outputs, widths, pixels, fours, count) : undefined;
}

/** Inputs as a texture: a texel for each, a row of texels for each vector. */
function inputTexture(name, inputs, count) {
  const entries = Object.entries(KINDS[name].inputs);
  const data = new Float32Array(entries.length * count * 4);
  entries.forEach(([input, [width]], k) => {
    for (let n = 0; n < count; n++) {
      const row = inputs[input].subarray(n * width, (n + 1) * width);
      data.set(row, (n * entries.length + k) * 4);
    }
  });
  const texture = new DataTexture(data, entries.length, count, RGBAFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}

/** A shader whose pixel (four, vector) is one four of the outputs. */
function program(name, outputs, fours) {
  const inputs = Object.values(KINDS[name].inputs).map(([size], k) =>
    `texelFetch(given, ivec2(${k}, row), 0)${SWIZZLES[size]}`);
  const declared = [];
  const texts = [];
  for (const [output, shape] of Object.entries(outputs)) {
    const size = shape.reduce((a, b) => a * b, 1);
    const many = Math.ceil(size / 4);
    declared.push(size > 4 ? `vec4 ${output}[${many}];` : `${SIZES[size]} ${output};`);
    texts.push(...Array.from({ length: many }, (_, k) => (size > 4 ? `${output}[${k}]`
      : `vec4(${[output, ...new Array(4 - size).fill("0.0")].join(", ")})`)));
  }
  return `uniform sampler2D given;
out vec4 color;
void main() {
  int row = int(gl_FragCoord.y);
  ${declared.join(" ")}
  ${name}(${[...inputs, ...Object.keys(outputs)].join(", ")});
  vec4 fours[${fours}] = vec4[${fours}](${texts.join(", ")});
  color = fours[int(gl_FragCoord.x)];
}`;
}

function unpacked(outputs, widths, pixels, fours, count) {
  const results = {};
  let start = 0;
  Object.keys(outputs).forEach((name, k) => {
    const width = widths[k];
    results[name] = Float32Array.from({ length: width * count }, (_, i) => {
      const [row, column] = [Math.floor(i / width), i % width];
      return pixels[(row * fours + start) * 4 + column];
    });
    start += Math.ceil(width / 4);
  });
  return results;
}
