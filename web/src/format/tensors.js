// What is known of a value of a network before it is computed: type and shape of one row.

export const FLOAT = "float32";
export const INT32 = "int32";
export const INT64 = "int64";
export const BOOL = "bool";
export const INDEX = [INT32, INT64];
export const NUMBER = [FLOAT, ...INDEX];
export const ANY = [...NUMBER, BOOL];
export const TYPES = { 1: FLOAT, 6: INT32, 7: INT64, 9: BOOL }; // By the numbers of ONNX.
export const ARRAYS = {
  [FLOAT]: Float32Array,
  [INT32]: Int32Array,
  [INT64]: BigInt64Array,
  [BOOL]: Uint8Array,
};

/**
 * A tensor: element type, shape of a row, number of elements.
 *
 * Constants have a `value`, a typed array, and their shape is that of the whole array.
 */
export class Tensor {
  constructor(type, shape, value = null) {
    this.type = type;
    this.shape = shape;
    this.value = value;
    this.size = product(shape);
  }

  get isConstant() {
    return this.value !== null;
  }
}

export function product(sizes) {
  return sizes.reduce((a, b) => a * Number(b), 1);
}

/** Whole numbers of a constant, which lose digits beyond 2^53 only. */
export function wholeNumbers(tensor) {
  return Array.from(tensor.value, Number);
}

/**
 * Shape of a row when constants and tensors with rows are broadcast, as NumPy does.
 *
 * Nothing if they do not fit.
 */
export function broadcast(shapes) {
  const rank = Math.max(...shapes.map((shape) => shape.length));
  const result = new Array(rank).fill(1);
  for (const shape of shapes) {
    for (const [k, size] of shape.entries()) {
      const at = rank - shape.length + k;
      if (size !== 1 && result[at] !== 1 && result[at] !== size) {
        return undefined;
      }
      result[at] = size === 1 ? result[at] : size;
    }
  }
  return result;
}

/** The shape of a constant beside rows of `rank` axes: a leading 1 stands for the rows. */
export function rowShape(tensor, rank) {
  const { shape } = tensor;
  return tensor.isConstant && shape.length > rank ? shape.slice(1) : shape;
}
