// A lamp: the networks of a bundle in ONNX Runtime, its bounding sphere, its triangles.

import * as ort from "onnxruntime-node";

import { mapValues, shapeOf, toRows } from "./arrays.mjs";
import { readBundle, readNpy } from "./bundle.mjs";
import { refuse } from "./refusal.mjs";

export const NETWORKS = ["appearance", "transparency", "sampler", "sampler_pdf", "fast_map"];

/** What is open; at first nothing, of which nothing can be asked. */
export class Lamp {
  sphere = null;
  triangles = [];
  sessions = {};

  /** Opens a bundle; a network that misses its golden vectors is refused. */
  static async open(path) {
    const { manifest, members } = readBundle(path);
    const lamp = new Lamp();
    lamp.sphere = manifest.bounding_sphere;
    lamp.triangles = readTriangles(members);
    for (const name of NETWORKS.filter((network) => network in manifest.networks)) {
      const session = await ort.InferenceSession.create(members[`networks/${name}.onnx`]);
      await requireGolden(name, session, members);
      lamp.sessions[name] = session;
    }
    return lamp;
  }

  has(network) {
    return network in this.sessions;
  }

  /** Outputs of a network by name. */
  ask(network, inputs) {
    if (!this.has(network)) {
      refuse(`no lamp with the network ${network} is open`);
    }
    return run(this.sessions[network], inputs);
  }
}

/** Corners of all triangles: three points each. */
function readTriangles(members) {
  const positions = readNpy(members["surface/positions.npy"]);
  const triangles = readNpy(members["surface/triangles.npy"]);
  return triangles.map((corners) => corners.map((corner) => positions[corner]));
}

/** Compares a network with its golden vectors (conformance.md). */
async function requireGolden(network, session, members) {
  const golden = (array) => readNpy(members[`vectors/${network}.${array}.npy`]);
  const inputs = Object.fromEntries(session.inputNames.map((name) => [name, golden(name)]));
  const outputs = await run(session, inputs);
  for (const [name, rows] of Object.entries(outputs)) {
    const wanted = golden(name).flat();
    const tolerance = golden(`${name}.tolerance`).flat();
    if (!rows.flat().every((value, k) => Math.abs(value - wanted[k]) <= tolerance[k])) {
      refuse(`${network} misses its golden vectors here`);
    }
  }
}

async function run(session, inputs) {
  const tensors = mapValues(
    inputs,
    (rows, name) => new ort.Tensor("float32", Float32Array.from(rows.flat()), shapeOf(name, rows)),
  );
  return mapValues(await session.run(tensors), ({ dims, data }) => toRows(dims, data));
}
