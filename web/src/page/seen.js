// What is seen in each pixel: place and normal, kept to the last bit in textures of whole numbers,
// so that any graphics card can draw them. The costly part of a picture then asks pixels, not
// triangles.

import {
  DoubleSide, Mesh, NearestFilter, RGBAIntegerFormat, Scene, UnsignedIntType, WebGLRenderTarget,
} from "three";

import { HEAD } from "./gpu.js";

const vertex = (flat) => `${HEAD}in vec3 position;
in vec3 normal;
uniform mat4 toScreen;
uniform mat4 modelMatrix;
uniform bool own;
out vec3 place;
${flat}out vec3 side;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  place = own ? position : world.xyz;
  side = own ? normal : mat3(modelMatrix) * normal;
  gl_Position = toScreen * world;
}`;

const fragment = (flat) => `${HEAD}in vec3 place;
${flat}in vec3 side;
uniform uint thing;
layout(location = 0) out uvec4 places;
layout(location = 1) out uvec4 sides;
void main() {
  places = uvec4(floatBitsToUint(place), thing);
  sides = uvec4(floatBitsToUint(side), thing);
}`;

/** GLSL to ask with: `seenThing` is 0 where nothing is seen. */
export const SEEN = `uniform highp usampler2D places;
uniform highp usampler2D sides;
uint seenThing() { return texelFetch(places, ivec2(gl_FragCoord.xy), 0).w; }
vec3 seenPlace() { return uintBitsToFloat(texelFetch(places, ivec2(gl_FragCoord.xy), 0).xyz); }
vec3 seenSide() { return uintBitsToFloat(texelFetch(sides, ivec2(gl_FragCoord.xy), 0).xyz); }
`;

/**
 * Things to be seen; each is known by its number, from one on, or hides what is behind it: 0.
 *
 * Places are those of the world, or of the thing's `own` frame.
 */
export class Things {
  constructor(gpu) {
    Object.assign(this, { gpu, scene: new Scene(), toScreen: { value: null } });
  }

  add(geometry, thing, { matrix = null, side = DoubleSide, own = false, flat = true } = {}) {
    const uniforms = { toScreen: this.toScreen, thing: { value: thing }, own: { value: own } };
    const word = flat ? "flat " : "";
    const material = this.gpu.material(vertex(word), fragment(word), uniforms, { side });
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    if (matrix) {
      mesh.matrixAutoUpdate = false;
      mesh.matrix.copy(matrix);
    }
    this.scene.add(mesh);
    return mesh;
  }
}

/** A target of places and normals, and the uniforms to ask it with. */
export class Seen {
  constructor(gpu) {
    this.gpu = gpu;
    this.target = null;
    this.uniforms = { places: { value: null }, sides: { value: null } };
  }

  /** Draws things from where they are seen. */
  draw(things, toScreen, [width, height]) {
    if (this.target?.width !== width || this.target?.height !== height) {
      this.dispose();
      this.target = new WebGLRenderTarget(width, height, {
        count: 2, format: RGBAIntegerFormat, type: UnsignedIntType, depthBuffer: true,
        minFilter: NearestFilter, magFilter: NearestFilter, generateMipmaps: false,
      });
      [this.uniforms.places.value, this.uniforms.sides.value] = this.target.textures;
    }
    things.toScreen.value = toScreen;
    this.gpu.clear(this.target);
    this.gpu.draw(things.scene, null, this.target);
  }

  dispose() {
    this.target?.dispose();
    this.target = null;
  }
}
