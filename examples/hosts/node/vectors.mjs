// Vectors: lists of numbers.

export function dot(a, b) {
  return a.reduce((sum, x, i) => sum + x * b[i], 0);
}

export function cross(a, b) {
  return [
    a[1] * b[2] - a[2] * b[1],
    a[2] * b[0] - a[0] * b[2],
    a[0] * b[1] - a[1] * b[0],
  ];
}

export function scaled(a, factor) {
  return a.map((x) => x * factor);
}

export function sum(a, b) {
  return a.map((x, i) => x + b[i]);
}

export function difference(a, b) {
  return a.map((x, i) => x - b[i]);
}

export function clip(x, low, high) {
  return Math.min(high, Math.max(low, x));
}
