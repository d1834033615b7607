// What stands between two points: the lamp's own surface, by three-mesh-bvh.

import { BufferAttribute, BufferGeometry } from "three";
import { BVHShaderGLSL, MeshBVH, MeshBVHUniformStruct } from "three-mesh-bvh";

import { corner } from "./lamp.js";

const MOST_TRIANGLES = 1_000_000;
const FULLEST = 256; // Triangles in a leaf.

// Library code steps through the tree; we need no first hit, only whether there is one.
export const OCCLUSION = `#define BVH_STACK_DEPTH 64
${BVHShaderGLSL.common_functions}
${BVHShaderGLSL.bvh_struct_definitions}
${BVHShaderGLSL.bvh_ray_functions}
uniform BVH tree;
bool isBlocked(vec3 origin, vec3 direction, float far) {
  int pointer = 0;
  uint stack[BVH_STACK_DEPTH];
  stack[0] = 0u;
  while (pointer > -1 && pointer < BVH_STACK_DEPTH - 2) {
    uint node = stack[pointer--];
    float start;
    if (!intersectsBVHNodeBounds(origin, direction, tree.bvhBounds, node, start) || start > far) {
      continue;
    }
    uvec2 info = uTexelFetch1D(tree.bvhContents, node).xy;
    if (bool(info.x & 0xffff0000u)) {
      for (uint i = info.y, end = info.y + (info.x & 0x0000ffffu); i < end; i++) {
        uvec3 corners = uTexelFetch1D(tree.index, i).xyz;
        vec3 a = texelFetch1D(tree.position, corners.x).rgb;
        vec3 b = texelFetch1D(tree.position, corners.y).rgb;
        vec3 c = texelFetch1D(tree.position, corners.z).rgb;
        vec3 weights, normal;
        float reach, side;
        bool hit = intersectsTriangle(origin, direction, a, b, c, weights, normal, reach, side);
        if (hit && reach > 0.0 && reach < far) {
          return true;
        }
      }
    } else {
      stack[++pointer] = node + info.y;
      stack[++pointer] = node + 1u;
    }
  }
  return false;
}
`;

/** The uniform `tree` of a lamp's surface, in radii about its centre. */
export function surfaceTree({ surface, sphere }) {
  const { positions, triangles } = surface;
  const index = wholeTriangles(positions, triangles);
  if (index.length > 3 * MOST_TRIANGLES) {
    throw new RangeError(`more than ${MOST_TRIANGLES.toLocaleString("en")} triangles`);
  }
  const places = new Float32Array(positions.length);
  for (let k = 0; k < positions.length / 3; k++) {
    places.set(corner(positions, k, sphere), 3 * k);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(places, 3));
  geometry.setIndex(new BufferAttribute(index, 1));
  const tree = new MeshBVH(geometry, { targetLeafSize: 6, maxDepth: 40, verbose: false });
  tree.traverse((depth, isLeaf, box, offset, count) => {
    if (isLeaf && count > FULLEST) {
      throw new RangeError(`${count} triangles in one place`);
    }
  });
  const uniform = new MeshBVHUniformStruct();
  uniform.updateFrom(tree);
  return uniform;
}

/** Indices of the triangles that have three corners, each triangle once. */
function wholeTriangles(positions, triangles) {
  const known = new Set();
  const kept = [];
  const same = (a, b) => [0, 1, 2].every((k) => positions[3 * a + k] === positions[3 * b + k]);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = triangles.subarray(t, t + 3);
    const key = [a, b, c].sort((x, y) => x - y).join();
    if (!same(a, b) && !same(b, c) && !same(c, a) && !known.has(key)) {
      known.add(key);
      kept.push(a, b, c);
    }
  }
  if (!kept.length) {
    kept.push(...triangles.subarray(0, 3));
  }
  return Uint32Array.from(kept);
}
