// What is seen in each pixel: place and normal, kept to the last bit in textures of whole numbers,
// so that any graphics card can draw them. The costly part of a picture then asks pixels, not
// triangles.

import {
  DoubleSide, Matrix4, Mesh, NearestFilter, RGBAIntegerFormat, Scene, UnsignedIntType,
  WebGLRenderTarget,
} from "three";

import { HEAD } from "./gpu.js";

const WORLD = [0, 0, 0, 1];

const vertex = (flat) => `${HEAD}in vec3 position;
in vec3 normal;
uniform mat4 toScreen;
uniform mat4 modelMatrix;
out vec3 place;
${flat}out vec3 side;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  place = world.xyz;
  side = mat3(modelMatrix) * normal;
  gl_Position = toScreen * world;
}`;

// Graphics cards move corners to a fraction of a pixel, so what they say of a place is a little beside
// the ray; where the ray meets the triangle's plane is exact.
const fragment = (flat) => `${HEAD}in vec3 place;
${flat}in vec3 side;
uniform uint thing;
uniform vec3 eye;
uniform mat4 fromScreen;
uniform vec2 size;
uniform vec4 frame;
layout(location = 0) out uvec4 places;
layout(location = 1) out uvec4 sides;
void main() {
  vec4 far = fromScreen * vec4(2.0 * gl_FragCoord.xy / size - 1.0, 0.5, 1.0);
  vec3 direction = normalize(far.xyz / far.w - eye), normal = normalize(side);
  float roughly = dot(place - eye, direction), speed = dot(normal, direction);
  float exactly = dot(place - eye, normal) / (speed == 0.0 ? 1.0 : speed);
  float reach = abs(exactly - roughly) < 0.01 * roughly ? exactly : roughly;
  vec3 found = (eye + reach * direction - frame.xyz) / frame.w;
  places = uvec4(floatBitsToUint(found), thing);
  sides = uvec4(floatBitsToUint(normal), thing);
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
 * Places are those of the world, or of a `frame`: where its middle is, and how long its unit.
 */
export class Things {
  constructor(gpu) {
    Object.assign(this, { gpu, scene: new Scene() });
    this.uniforms = {
      toScreen: { value: null }, fromScreen: { value: null }, eye: { value: null },
      size: { value: [1, 1] },
    };
  }

  add(geometry, thing, { matrix = null, side = DoubleSide, frame = WORLD, flat = true } = {}) {
    const uniforms = { ...this.uniforms, thing: { value: thing }, frame: { value: frame } };
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

/** From the world to the screen. */
function screenOf(camera) {
  return new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
}

/** A target of places and normals, and the uniforms to ask it with. */
export class Seen {
  constructor(gpu) {
    this.gpu = gpu;
    this.target = null;
    this.uniforms = { places: { value: null }, sides: { value: null } };
  }

  /** Draws things from where they are seen. */
  draw(things, camera, [width, height]) {
    if (this.target?.width !== width || this.target?.height !== height) {
      this.dispose();
      this.target = new WebGLRenderTarget(width, height, {
        count: 2, format: RGBAIntegerFormat, type: UnsignedIntType, depthBuffer: true,
        minFilter: NearestFilter, magFilter: NearestFilter, generateMipmaps: false,
      });
      [this.uniforms.places.value, this.uniforms.sides.value] = this.target.textures;
    }
    const { uniforms } = things;
    uniforms.toScreen.value = screenOf(camera);
    uniforms.fromScreen.value = screenOf(camera).invert();
    uniforms.eye.value = camera.position.toArray();
    uniforms.size.value = [width, height];
    this.gpu.clear(this.target);
    this.gpu.draw(things.scene, null, this.target);
  }

  dispose() {
    this.target?.dispose();
    this.target = null;
  }
}
