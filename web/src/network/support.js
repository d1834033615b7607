// Functions of GLSL ES 3.00 that the printed networks call; only those that are called are written.
//
// Trigonometry is ours, as graphics cards promise about three digits of theirs. Whole numbers of 64
// bits are pairs of 32, the lower one first.

const READERS = {
  four: ["sampler2D", "vec4", ""],
  two: ["sampler2D", "vec2", ".rg"],
  one: ["sampler2D", "float", ".r"],
  whole: ["isampler2D", "int", ".r"],
};

const FUNCTIONS = {
  // What only rounds by a fraction of a turn has to be exact: quarter turns in three parts.
  sine: `float pl_sine(float x, float ahead) {
  float n = floor(x * 0.636619772 + 0.5);
  float r = ((x - n * 1.5703125) - n * 0.000483751297) - n * 7.54978995e-08;
  float quarter = n + ahead - 4.0 * floor((n + ahead) * 0.25);
  float z = r * r;
  float sine = r + r * z * (-0.166666667 + z * (0.00833333333 + z * (-0.000198412698
    + z * 2.75573192e-06)));
  float cosine = 1.0 + z * (-0.5 + z * (0.0416666667 + z * (-0.00138888889
    + z * (2.48015873e-05 - z * 2.75573192e-07))));
  float size = quarter == 1.0 || quarter == 3.0 ? cosine : sine;
  return quarter >= 2.0 ? -size : size;
}`,
  sin: "float pl_sin(float x) { return pl_sine(x, 0.0); }",
  cos: "float pl_cos(float x) { return pl_sine(x, 1.0); }",
  atan: `float pl_atan(float x) {
  float size = abs(x);
  bool steep = size > 2.41421356;
  bool middle = !steep && size > 0.414213562;
  float t = steep ? -1.0 / size : (middle ? (size - 1.0) / (size + 1.0) : size);
  float z = t * t;
  float angle = t + t * z * (-0.333333155 + z * (0.199984894 + z * (-0.142438486
    + z * (0.105960006 - z * 0.0608345092))));
  angle += steep ? 1.57079633 : (middle ? 0.785398163 : 0.0);
  return x < 0.0 ? -angle : angle;
}`,
  asin: `float pl_asin(float x) {
  float size = min(abs(x), 1.0);
  bool steep = size > 0.5;
  float z = steep ? 0.5 * (1.0 - size) : size * size;
  float t = steep ? sqrt(z) : size;
  float angle = t + t * z * (0.166667539 + z * (0.0749524175 + z * (0.0454771016
    + z * (0.0241475864 + z * 0.0422185932))));
  angle = steep ? 1.57079633 - 2.0 * angle : angle;
  return x < 0.0 ? -angle : angle;
}`,
  // A division bit by bit, each step of which is exact.
  rest: `float pl_rest(float a, float b) {
  float rest = abs(a);
  float size = abs(b);
  for (int k = 0; k < 280 && size > 0.0 && rest >= size; k++) {
    int lift = (floatBitsToInt(rest) >> 23) - (floatBitsToInt(size) >> 23);
    float step = intBitsToFloat(floatBitsToInt(size) + (lift << 23));
    rest -= step > rest ? 0.5 * step : step;
  }
  return a < 0.0 ? -rest : rest;
}`,
  // Languages leave open what % and / do with negative numbers; here none get in.
  modulo: `int pl_modulo(int a, int b) {
  int rest = (a < 0 ? -1 - a : a) % b;
  return a < 0 ? b - 1 - rest : rest;
}`,
  quotient: `int pl_quotient(int a, int b) {
  return a < 0 ? -((-1 - a) / b) - ((-1 - a) % b == b - 1 ? 1 : 0) : a / b;
}`,
  place: `int pl_place(int i, int size) {
  return clamp(i < 0 ? i + size : i, 0, size - 1);
}`,
  long_place: `int pl_long_place(uvec2 i, int size) {
  uvec2 place = int(i.y) < 0 ? pl_long_add(i, uvec2(uint(size), 0u)) : i;
  return int(place.y) < 0 ? 0 : place.y > 0u ? size - 1 : int(min(place.x, uint(size - 1)));
}`,
  to_long: "uvec2 pl_to_long(int x) { return uvec2(uint(x), uint(x >> 31)); }",
  to_int: "int pl_to_int(uvec2 x) { return int(x.x); }",
  long_to_float: `float pl_long_to_float(uvec2 x) {
  uvec2 size = pl_long_abs(x);
  float value = float(size.y) * 4294967296.0 + float(size.x);
  return int(x.y) < 0 ? -value : value;
}`,
  float_to_long: `uvec2 pl_float_to_long(float x) {
  float size = min(floor(abs(x)), 9.22337149e18);
  float high = floor(size * 2.32830644e-10);
  uvec2 value = uvec2(uint(size - high * 4294967296.0), uint(high));
  return x < 0.0 ? pl_long_neg(value) : value;
}`,
  long_add: `uvec2 pl_long_add(uvec2 a, uvec2 b) {
  uint low = a.x + b.x;
  return uvec2(low, a.y + b.y + (low < a.x ? 1u : 0u));
}`,
  long_neg: "uvec2 pl_long_neg(uvec2 a) { return pl_long_add(~a, uvec2(1u, 0u)); }",
  long_sub: "uvec2 pl_long_sub(uvec2 a, uvec2 b) { return pl_long_add(a, pl_long_neg(b)); }",
  long_mul: `uvec2 pl_long_mul(uvec2 a, uvec2 b) {
  uint al = a.x & 0xffffu, ah = a.x >> 16, bl = b.x & 0xffffu, bh = b.x >> 16;
  uint ll = al * bl, lh = al * bh, hl = ah * bl;
  uint middle = (ll >> 16) + (lh & 0xffffu) + (hl & 0xffffu);
  uint high = ah * bh + (lh >> 16) + (hl >> 16) + (middle >> 16);
  return uvec2((middle << 16) | (ll & 0xffffu), high + a.x * b.y + a.y * b.x);
}`,
  long_less: `bool pl_long_less(uvec2 a, uvec2 b) {
  return a.y == b.y ? a.x < b.x : int(a.y) < int(b.y);
}`,
  long_abs: "uvec2 pl_long_abs(uvec2 a) { return int(a.y) < 0 ? pl_long_neg(a) : a; }",
  long_sign: `uvec2 pl_long_sign(uvec2 a) {
  return int(a.y) < 0 ? uvec2(0xffffffffu) : uvec2(a.x == 0u && a.y == 0u ? 0u : 1u, 0u);
}`,
  long_max: "uvec2 pl_long_max(uvec2 a, uvec2 b) { return pl_long_less(a, b) ? b : a; }",
  long_min: "uvec2 pl_long_min(uvec2 a, uvec2 b) { return pl_long_less(b, a) ? b : a; }",
  // Quotient and remainder of numbers that are not negative, digit by digit.
  long_divide: `uvec4 pl_long_divide(uvec2 a, uvec2 b) {
  uvec2 rest = uvec2(0u), result = uvec2(0u);
  for (int k = 63; k >= 0; k--) {
    uint digit = k > 31 ? (a.y >> (k - 32)) & 1u : (a.x >> k) & 1u;
    rest = uvec2((rest.x << 1) | digit, (rest.y << 1) | (rest.x >> 31));
    bool fits = rest.y == b.y ? rest.x >= b.x : rest.y > b.y;
    rest = fits ? pl_long_sub(rest, b) : rest;
    result = uvec2((result.x << 1) | (fits ? 1u : 0u), (result.y << 1) | (result.x >> 31));
  }
  return uvec4(result, rest);
}`,
  long_quotient: `uvec2 pl_long_quotient(uvec2 a, uvec2 b) {
  uvec2 size = pl_long_divide(pl_long_abs(a), b).xy;
  return int(a.y) < 0 ? pl_long_neg(size) : size;
}`,
  long_modulo: `uvec2 pl_long_modulo(uvec2 a, uvec2 b) {
  uvec2 rest = pl_long_divide(pl_long_abs(a), b).zw;
  bool turned = int(a.y) < 0 && (rest.x != 0u || rest.y != 0u);
  return turned ? pl_long_sub(b, rest) : rest;
}`,
};

const CALLED = /\bpl_(\w+)\(/g;

/** The functions that a text calls, those that they call first, behind readers of textures. */
export function support(text, width) {
  const shift = Math.log2(width);
  const written = new Map();
  const write = (name) => {
    if (written.has(name)) {
      return;
    }
    const body = READERS[name] ? reader(name, width, shift) : FUNCTIONS[name];
    written.set(name, null);
    called(body).filter((other) => other !== name && known(other)).forEach(write);
    written.delete(name);
    written.set(name, body);
  };
  called(text).filter(known).forEach(write);
  return `${[...written.values()].join("\n")}\n`;
}

function known(name) {
  return name in READERS || name in FUNCTIONS;
}

function called(text) {
  return [...new Set(Array.from(text.matchAll(CALLED), ([, name]) => name))];
}

function reader(name, width, shift) {
  const [sampler, type, channels] = READERS[name];
  const at = `ivec2(i & ${width - 1}, i >> ${shift})`;
  return `uniform highp ${sampler} pl_${name}s;
${type} pl_${name}(int i) { return texelFetch(pl_${name}s, ${at}, 0)${channels}; }`;
}
