// The numbers of a lamp's networks, packed for textures: whole rows in ones, twos and fours.

const FORMATS = {
  four: { channels: 4, Kind: Float32Array },
  two: { channels: 2, Kind: Float32Array },
  one: { channels: 1, Kind: Float32Array },
  whole: { channels: 1, Kind: Int32Array },
};

/** Gives constants their places, counted in texels; equal ones share one. */
export class Store {
  constructor() {
    this.sizes = Object.fromEntries(Object.keys(FORMATS).map((format) => [format, 0]));
    this.parts = Object.fromEntries(Object.keys(FORMATS).map((format) => [format, []]));
    this.known = new Map();
  }

  /**
   * Where numbers lie in the texture of a format.
   *
   * What came from the same `source` with the same `layout` is there already.
   */
  add(format, source, layout, numbers) {
    const places = this.known.get(source) ?? new Map();
    this.known.set(source, places);
    const key = `${format}, ${layout}`;
    if (!places.has(key)) {
      const data = numbers();
      places.set(key, this.sizes[format]);
      this.parts[format].push(data);
      this.sizes[format] += Math.ceil(data.length / FORMATS[format].channels);
    }
    return places.get(key);
  }

  /** Bytes that the textures take. */
  get bytes() {
    const bytes = ([format, texels]) => texels * FORMATS[format].channels * 4;
    return Object.entries(this.sizes).reduce((sum, entry) => sum + bytes(entry), 0);
  }

  /** Textures that are needed: { format, channels, width, height, data }. */
  textures(width) {
    return Object.keys(FORMATS).filter((format) => this.sizes[format]).map((format) => {
      const { channels, Kind } = FORMATS[format];
      const height = Math.ceil(this.sizes[format] / width);
      const data = new Kind(width * height * channels);
      let at = 0;
      for (const part of this.parts[format]) {
        data.set(part, at);
        at += Math.ceil(part.length / channels) * channels;
      }
      return { format, channels, width, height, data };
    });
  }
}

/** A matrix [out, in] as four by four blocks, column after column. */
export function blocks(weight, out, size, transposed) {
  const [rows, columns] = [Math.ceil(out / 4), Math.ceil(size / 4)];
  const data = new Float32Array(rows * columns * 16);
  for (let o = 0; o < out; o++) {
    for (let i = 0; i < size; i++) {
      const block = (Math.floor(o / 4) * columns + Math.floor(i / 4)) * 4 + (i % 4);
      data[block * 4 + (o % 4)] = weight[transposed ? o * size + i : i * out + o];
    }
  }
  return data;
}

/** Rows of a table, each padded to whole fours. */
export function paddedRows(table, width) {
  if (width % 4 === 0) {
    return table;
  }
  const padded = Math.ceil(width / 4) * 4;
  const data = new Float32Array((table.length / width) * padded);
  for (let row = 0; row * width < table.length; row++) {
    data.set(table.subarray(row * width, (row + 1) * width), row * padded);
  }
  return data;
}
