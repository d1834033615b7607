// The mean of the samples so far, and how it is shown: exposed, toned, over a background.

import { LUMINANCE } from "../format/tables.js";

const ADD = `uniform sampler2D before0;
uniform sampler2D before1;
uniform sampler2D now0;
uniform sampler2D now1;
uniform float share;
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 cover;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 a = texelFetch(now0, at, 0);
  vec4 b = texelFetch(now1, at, 0);
  light = share < 1.0 ? mix(texelFetch(before0, at, 0), a, share) : a;
  cover = share < 1.0 ? mix(texelFetch(before1, at, 0), b, share) : b;
}`;

const SHOW = `uniform sampler2D mean0;
uniform sampler2D mean1;
uniform vec2 size;
uniform vec2 screen;
uniform vec3 gain;
uniform vec3 behind0;
uniform vec3 behind1;
uniform float square;
out vec4 color;
vec4 smoothly(sampler2D image, vec2 at) {
  vec2 low = floor(at - 0.5);
  vec2 part = at - 0.5 - low;
  ivec2 top = ivec2(size) - 1;
  ivec2 a = clamp(ivec2(low), ivec2(0), top), b = clamp(ivec2(low) + 1, ivec2(0), top);
  return mix(mix(texelFetch(image, a, 0), texelFetch(image, ivec2(b.x, a.y), 0), part.x),
    mix(texelFetch(image, ivec2(a.x, b.y), 0), texelFetch(image, b, 0), part.x), part.y);
}
float curve(float x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055; }
void main() {
  vec2 at = gl_FragCoord.xy / screen * size;
  vec2 cell = floor((gl_FragCoord.xy - 0.5 * screen) / square);
  vec3 behind = mod(cell.x + cell.y, 2.0) < 0.5 ? behind0 : behind1;
  vec3 light = smoothly(mean0, at).rgb * gain + behind * (1.0 - smoothly(mean1, at).rgb);
  vec3 tone = 1.0 - exp(-1.5 * min(light, 60.0));
  color = vec4(curve(tone.r), curve(tone.g), curve(tone.b), 1.0);
}`;

/** Two targets in turn: the mean before a sample, and with it. */
export class Mean {
  constructor(gpu) {
    this.gpu = gpu;
    this.targets = [];
    this.shown = null; // The mean that is complete enough to be seen.
    const texture = () => ({ value: null });
    this.adding = gpu.pass(ADD, { before0: texture(), before1: texture(), now0: texture(),
      now1: texture(), share: { value: 1 } });
    this.showing = gpu.pass(SHOW, { mean0: texture(), mean1: texture(), size: { value: [1, 1] },
      screen: { value: [1, 1] }, gain: { value: [1, 1, 1] }, behind0: { value: [0, 0, 0] },
      behind1: { value: [0, 0, 0] }, square: { value: 24 } });
  }

  /** Joins a sample, a target of two layers, as the one of number `index`. */
  add(sample, index, [width, height]) {
    const [before] = index ? [this.targets.at(-1)] : [null];
    const { uniforms, scene } = this.adding;
    const after = this.spare(width, height, before);
    const from = before ?? sample;
    [uniforms.before0.value, uniforms.before1.value] = from.textures;
    [uniforms.now0.value, uniforms.now1.value] = sample.textures;
    uniforms.share.value = 1 / (index + 1);
    this.gpu.draw(scene, null, after);
    this.targets = [...this.targets.filter((target) => target !== after), after];
  }

  /** A target of a size that is neither shown nor needed. */
  spare(width, height, before) {
    const fits = (target) => target.width === width && target.height === height;
    const free = this.targets.filter((target) => target !== this.shown && target !== before);
    const found = free.find(fits);
    free.filter((target) => target !== found).forEach((target) => {
      target.dispose();
      this.targets = this.targets.filter((other) => other !== target);
    });
    return found ?? this.gpu.target(width, height, { count: 2 });
  }

  /** Lets the mean as it is now be what is shown. */
  settle() {
    this.shown = this.targets.at(-1);
  }

  /** Shows it on the page. */
  show({ gain, behind = [[0, 0, 0], [0, 0, 0]], square = 24 }) {
    if (!this.shown) {
      return;
    }
    const { uniforms, scene } = this.showing;
    [uniforms.mean0.value, uniforms.mean1.value] = this.shown.textures;
    uniforms.size.value = [this.shown.width, this.shown.height];
    const { drawingBufferWidth, drawingBufferHeight } = this.gpu.gl;
    uniforms.screen.value = [drawingBufferWidth, drawingBufferHeight];
    uniforms.gain.value = gain;
    [uniforms.behind0.value, uniforms.behind1.value] = behind;
    uniforms.square.value = square;
    this.gpu.renderer.setViewport(0, 0, drawingBufferWidth, drawingBufferHeight);
    this.gpu.draw(scene, null, null);
  }

  /** Stops that bring a percentile of the luminance to white: of what is lit, or of all pixels. */
  stops(percentile, onlyLit) {
    const { width, height } = this.shown;
    const pixels = this.gpu.exact ? new Float32Array(width * height * 4)
      : new Uint16Array(width * height * 4);
    this.gpu.renderer.readRenderTargetPixels(this.shown, 0, 0, width, height, pixels);
    const levels = luminances(pixels).filter((level) => !onlyLit || level > 0);
    const level = levels.sort()[Math.floor((levels.length - 1) * percentile)];
    return level > 0 ? -Math.log2(level) : 0;
  }

  /** Forgets what was shown. */
  clear() {
    this.targets.forEach((target) => target.dispose());
    this.targets = [];
    this.shown = null;
  }
}

function luminances(pixels) {
  const value = pixels instanceof Float32Array ? (x) => x : fromHalf;
  const levels = new Float32Array(pixels.length / 4);
  for (let k = 0; k < levels.length; k++) {
    levels[k] = LUMINANCE.reduce((sum, weight, c) => sum + weight * value(pixels[4 * k + c]), 0);
  }
  return levels;
}

/** A float of 16 bits. */
function fromHalf(bits) {
  const exponent = (bits >> 10) & 31;
  const part = bits & 1023;
  const size = exponent ? (1 + part / 1024) * 2 ** (exponent - 15) : part * 2 ** -24;
  return bits & 0x8000 ? -size : size;
}
