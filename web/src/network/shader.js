// Several networks of a lamp as one text of GLSL with its textures.

import { printNetwork } from "./glsl.js";
import { Store } from "./store.js";
import { support } from "./support.js";
import { TooComplex } from "./writer.js";

const MOST_BYTES = 512 * 2 ** 20; // Of textures.

/**
 * The functions of some networks of a lamp: { source, textures }.
 *
 * `networks` are vetted ones by name, `widest` the largest texture that there may be.
 */
export function shaderOf(networks, widest) {
  const store = new Store();
  const functions = [...networks].map(([name, network]) => printNetwork(network, name, store));
  if (store.bytes > MOST_BYTES) {
    throw new TooComplex(`tables of ${Math.round(store.bytes / 2 ** 20)} MB`);
  }
  const width = 2 ** Math.floor(Math.log2(Math.min(widest, 4096)));
  const textures = store.textures(width);
  if (textures.some(({ height }) => height > widest)) {
    throw new TooComplex("tables larger than this graphics card's textures");
  }
  const source = functions.join("\n");
  return { source: support(source, width) + source, textures };
}
