// Which element of a row goes where: maps of indices, for every evaluator and printer alike.

import { slices } from "../format/operators.js";
import { product, rowShape, wholeNumbers } from "../format/tensors.js";

/** How far apart neighbours along each axis lie in a flat row. */
export function strides(shape) {
  return shape.map((_, k) => product(shape.slice(k + 1)));
}

/** Calls `visit` with the coordinates of each element of a shape, in order; they are reused. */
function eachElement(shape, visit) {
  const at = shape.map(() => 0);
  const count = product(shape);
  for (let k = 0; k < count; k++) {
    visit(at, k);
    for (let axis = shape.length - 1; axis >= 0 && ++at[axis] === shape[axis]; axis--) {
      at[axis] = 0;
    }
  }
}

/** An index map: `place` gives the element that each coordinate of a shape comes from. */
function indexMap(shape, place) {
  const map = new Int32Array(product(shape));
  eachElement(shape, (at, k) => {
    map[k] = place(at);
  });
  return map;
}

/** Elements of an operand for each element of the result it is spread over. */
export function spread(tensor, shape) {
  const own = rowShape(tensor, shape.length);
  const [skip, steps] = [shape.length - own.length, strides(own)];
  return indexMap(shape, (at) =>
    own.reduce((sum, size, k) => sum + (size === 1 ? 0 : at[skip + k] * steps[k]), 0),
  );
}

/** An axis of the rows' tensor, counted without the rows. */
export function axisOf(node, given) {
  return node.axis(given, node.inputs[0].shape.length);
}

/**
 * What an operator of arrangement makes of its inputs: for each output { source, from }: the input
 * and the element that each element comes from; a `source` that is a number is that of all.
 */
export function arrangement(node, outputs) {
  const [x] = node.inputs;
  switch (node.op) {
    case "Concat":
      return [joined(node)];
    case "Slice":
      return [{ source: 0, from: sliced(node, outputs[0].shape) }];
    case "Split":
      return parts(node, outputs);
    case "Transpose": {
      const steps = strides(x.shape);
      const order = node.attribute("perm").slice(1).map((axis) => steps[axis - 1]);
      const place = (at) => at.reduce((sum, k, axis) => sum + k * order[axis], 0);
      return [{ source: 0, from: indexMap(outputs[0].shape, place) }];
    }
    case "Gather":
      return [{ source: 0, from: columns(node, outputs[0].shape) }];
    default: // Identity, Reshape, Squeeze, Unsqueeze
      return [{ source: 0, from: Int32Array.from({ length: x.size }, (_, k) => k) }];
  }
}

function joined(node) {
  const axis = axisOf(node, node.attribute("axis", 0));
  const { shape } = node.inputs[0];
  const [before, after] = [product(shape.slice(0, axis)), product(shape.slice(axis + 1))];
  const [source, from] = [[], []];
  for (let block = 0; block < before; block++) {
    for (const [k, tensor] of node.inputs.entries()) {
      const width = tensor.shape[axis] * after;
      for (let i = 0; i < width; i++) {
        source.push(k);
        from.push(block * width + i);
      }
    }
  }
  return { source: Int32Array.from(source), from: Int32Array.from(from) };
}

function sliced(node, shape) {
  const steps = strides(node.inputs[0].shape);
  const [start, step] = [shape.map(() => 0), shape.map(() => 1)];
  for (const cut of slices(node)) {
    start[cut.axis] = cut.start;
    step[cut.axis] = cut.step;
  }
  return indexMap(shape, (at) =>
    at.reduce((sum, k, axis) => sum + (start[axis] + k * step[axis]) * steps[axis], 0),
  );
}

function parts(node, outputs) {
  const axis = axisOf(node, node.attribute("axis", 0));
  const steps = strides(node.inputs[0].shape);
  let start = 0;
  return outputs.map(({ shape }) => {
    const first = start;
    start += shape[axis];
    const place = (at) => at.reduce((sum, k, i) => sum + k * steps[i], first * steps[axis]);
    return { source: 0, from: indexMap(shape, place) };
  });
}

/** Fixed columns of a row. */
function columns(node, shape) {
  const [x, index] = node.inputs;
  const axis = axisOf(node, node.attribute("axis", 0));
  const rank = index.shape.length;
  const [steps, own] = [strides(x.shape), strides(index.shape)];
  const chosen = wholeNumbers(index).map((k) => (k < 0 ? k + x.shape[axis] : k));
  return indexMap(shape, (at) => {
    const column = own.reduce((sum, step, k) => sum + step * at[axis + k], 0);
    const rest = steps.reduce((sum, step, k) => {
      return k === axis ? sum : sum + step * at[k < axis ? k : k + rank - 1];
    }, 0);
    return rest + chosen[column] * steps[axis];
  });
}

/** The lines along an axis: for each the elements on it, in order. */
export function lines(shape, axis) {
  const step = strides(shape)[axis];
  const rest = shape.with(axis, 1);
  const firsts = [];
  const steps = strides(shape);
  eachElement(rest, (at) => firsts.push(at.reduce((sum, k, i) => sum + k * steps[i], 0)));
  return firsts.map((first) => Array.from({ length: shape[axis] }, (_, k) => first + k * step));
}

/** For each element of a reduction the elements that it is made of. */
export function groups(node) {
  const { shape } = node.inputs[0];
  const axes = node.axes(1, shape.length);
  const kept = shape.map((size, k) => (axes.includes(k) ? 1 : size));
  const steps = strides(kept);
  const made = Array.from({ length: product(kept) }, () => []);
  eachElement(shape, (at, k) => {
    made[at.reduce((sum, i, axis) => sum + (axes.includes(axis) ? 0 : i * steps[axis]), 0)].push(k);
  });
  return made;
}

/** Of GatherElements: for each element the line of data that its index chooses from. */
export function choices(node) {
  const [x, index] = node.inputs;
  const axis = axisOf(node, node.attribute("axis", 0));
  const steps = strides(x.shape);
  const first = indexMap(index.shape, (at) =>
    at.reduce((sum, k, i) => sum + (i === axis ? 0 : k * steps[i]), 0),
  );
  return { axis, first, step: steps[axis], size: x.shape[axis] };
}
