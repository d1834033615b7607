// Reads lamps beside the page, so that no file can make it stand still.

import { FormatError } from "./format/issues.js";
import { summary } from "./format/summary.js";
import { examine } from "./format/validate.js";
import { shaderOf } from "./network/shader.js";
import { TooComplex } from "./network/writer.js";

const SEEN = ["appearance", "transparency"]; // What a picture is made of.
let examination = null;

/** What is wrong with a file, and the lamp if nothing is. */
function open({ bytes, widest }) {
  examination = examine(new Uint8Array(bytes));
  const { issues, truncated } = examination.findings.report();
  const valid = !examination.findings.errors.length;
  return { issues, truncated, lamp: valid ? lamp(widest) : null };
}

function lamp(widest) {
  const { manifest, surface, networks } = examination;
  return {
    name: manifest.name,
    sphere: manifest.bounding_sphere,
    flux: manifest.flux,
    scale: manifest.radiance_scale,
    surface: Object.fromEntries(Object.entries(surface).map(([name, data]) => [name, data.slice()])),
    networks: [...networks.keys()],
    summary: summary(examination),
    shader: shader(SEEN, widest),
  };
}

/** The functions of those networks that the lamp has, or why there are none. */
function shader(names, widest) {
  const { networks } = examination;
  try {
    const known = names.filter((name) => networks.has(name));
    return shaderOf(new Map(known.map((name) => [name, networks.get(name)])), widest);
  } catch (error) {
    if (!(error instanceof TooComplex)) {
      throw error;
    }
    return { refused: error.message };
  }
}

/** One network with its golden vectors. */
function network({ name, widest }) {
  return { shader: shader([name], widest), vectors: examination.vectors.get(name) };
}

const ANSWERS = { open, network };

self.onmessage = ({ data: request }) => {
  try {
    const answer = ANSWERS[request.do](request);
    const { shader: made } = answer.lamp ?? answer;
    const textures = made?.textures?.map(({ data }) => data.buffer) ?? [];
    self.postMessage({ id: request.id, answer }, textures);
  } catch (error) {
    const refused = error instanceof FormatError ? error.message : `${error.name}: ${error.message}`;
    self.postMessage({ id: request.id, refused });
  }
};
