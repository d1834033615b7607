// The exit surface as triangles, and what asks the lamp's networks in a shader.
//
// Places are in radii about the centre, so that a lamp of any size is drawn with the same digits;
// the networks get metres.

import { BufferAttribute, BufferGeometry } from "three";

const MOST_TRIANGLES = 3_000_000;
const MOST = { float: "1e37", half: "6e4" }; // What a texture can hold, with room to spare.

/** GLSL: radiance over the lamp's scale, and transmittance, at a place of the surface in radii. */
export function questions({ networks }, { exact }) {
  const through = networks.includes("transparency")
    ? "transparency(centre + radius * place, facing(normal, outgoing), outgoing, transmittance);" : "";
  return `uniform vec3 centre;
uniform float radius;
uniform float scale;
float sound(float x) { return x >= 0.0 && x < 1e37 ? min(x, ${MOST[exact ? "float" : "half"]}) : 0.0; }
vec3 sound(vec3 x) { return vec3(sound(x.r), sound(x.g), sound(x.b)); }
vec3 facing(vec3 normal, vec3 outgoing) { return dot(normal, outgoing) < 0.0 ? -normal : normal; }
vec3 lightOf(vec3 place, vec3 normal, vec3 outgoing) {
  vec3 radiance;
  appearance(centre + radius * place, facing(normal, outgoing), outgoing, radiance);
  return sound(radiance / scale);
}
vec3 passing(vec3 place, vec3 normal, vec3 outgoing) {
  vec3 transmittance = vec3(0.0);
  ${through}
  return clamp(sound(transmittance), 0.0, 1.0);
}
`;
}

/** GLSL: the light and the cover of the lamp where it is seen. */
export const LAMP_SEEN = `uniform vec3 eye;
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 cover;
void main() {
  light = cover = vec4(0.0);
  if (seenThing() == 0u) {
    return;
  }
  vec3 place = seenPlace(), side = seenSide(), outgoing = normalize(eye - place);
  light = vec4(lightOf(place, side, outgoing), 1.0);
  cover = vec4(1.0 - passing(place, side, outgoing), 1.0);
}`;

/** The values of `questions`, and the textures of the networks, which views share. */
export function lampUniforms(gpu, lamp) {
  const { center, radius } = lamp.sphere;
  lamp.uniforms ??= {
    centre: { value: center },
    radius: { value: radius },
    scale: { value: lamp.scale },
    ...gpu.uniforms(lamp.shader.textures),
  };
  return lamp.uniforms;
}

/** Triangles with their flat normals, in radii about the centre. */
export function surfaceGeometry({ surface, sphere }) {
  const { positions, triangles } = surface;
  if (triangles.length > 3 * MOST_TRIANGLES) {
    throw new RangeError(`more than ${MOST_TRIANGLES.toLocaleString("en")} triangles`);
  }
  const [places, sides] = [0, 1].map(() => new Float32Array(triangles.length * 3));
  for (let t = 0; t < triangles.length; t += 3) {
    const corners = [0, 1, 2].map((k) => corner(positions, triangles[t + k], sphere));
    const normal = normalOf(corners);
    corners.forEach((place, k) => {
      places.set(place, (t + k) * 3);
      sides.set(normal, (t + k) * 3);
    });
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(places, 3));
  geometry.setAttribute("normal", new BufferAttribute(sides, 3));
  return geometry;
}

/** A vertex in radii about the centre. */
export function corner(positions, index, { center, radius }) {
  return [0, 1, 2].map((k) => (positions[3 * index + k] - center[k]) / radius);
}

/** The edges of a triangle's first corner, multiplied as vectors. */
export function crossOf([a, b, c]) {
  const [[x, y, z], [u, v, w]] = [b, c].map((p) => p.map((value, k) => value - a[k]));
  return [y * w - z * v, z * u - x * w, x * v - y * u];
}

/** The unit normal of a triangle, some direction if it has no area. */
export function normalOf(corners) {
  const cross = crossOf(corners);
  const size = Math.hypot(...cross);
  return size > 0 ? cross.map((value) => value / size) : [0, 0, 1];
}
