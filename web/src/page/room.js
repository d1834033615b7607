// A small room that the lamp lights: light that comes straight from it, with its shadows.
//
// Each sample takes one point of the exit surface for the whole picture. Lengths are those of a room
// five metres wide; a lamp that is very small or large gets a room to its size.

import {
  BoxGeometry, FrontSide, Matrix4, PlaneGeometry, SphereGeometry, Vector3,
} from "three";

import { dispose } from "./gpu.js";
import { LAMP_SEEN, lampUniforms, questions, surfaceGeometry } from "./lamp.js";
import { jitter } from "./look.js";
import { Mean } from "./mean.js";
import { OCCLUSION, surfaceTree } from "./occlusion.js";
import { SurfaceSamples } from "./samples.js";
import { SEEN, Seen, Things } from "./seen.js";
import { ViewPoint } from "./view_point.js";

const WIDTH = 5;
const CORNER = [-2, 2]; // Where two of its walls meet; the others are not there.
const HEIGHT = 2.7;
const AREA = 2 * WIDTH * WIDTH + 4 * WIDTH * HEIGHT;
const REFLECTED = 0.48; // Mean part of the light that comes back; two of the walls are not there.
const FITTING = [0.02, 0.6]; // Radii of lamps that hang in a room of its true size, metres.
const USUAL = 0.15; // Radius that other lamps have in their room.
const LADDER = [
  { divisor: 8, samples: 6, least: 6 },
  { divisor: 4, samples: 16, least: 4 },
  { divisor: 2, samples: 48, least: 12 },
  { divisor: 1, samples: 512, least: 24 },
];

const VIEW = {
  target: [0, 0, 1.15], azimuth: -62, elevation: 9, distance: 5.6, angle: 34,
  bounds: { distance: [0.8, 8], azimuth: [-0.35, 1.9], polar: [0.9, 1.68], reach: 6 },
};
const BALL = { at: [-0.62, -0.55, 0.3], size: 0.3 };
const BOXES = [
  { at: [0.98, 0.62, 0.38], half: [0.34, 0.34, 0.38], turn: 0.42 },
  { at: [-1.15, 0.95, 0.75], half: [0.13, 0.13, 0.75], turn: -0.3 },
];
const WHITE = [0.76, 0.75, 0.73];
const FLOOR = [0.55, 0.5, 0.45];
const CLAY = [0.62, 0.42, 0.34];
const SLATE = [0.42, 0.47, 0.52];

const number = (x) => (Number.isInteger(x) ? `${x}.0` : String(x));
const vec3 = (values) => `vec3(${values.map(number).join(", ")})`;

/** Whether things of the room stand in the way of a ray. */
const THINGS = `bool boxHit(vec3 origin, vec3 direction, vec3 at, vec3 extent, float turn, float far) {
  float c = cos(turn), s = sin(turn);
  mat3 back = mat3(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
  vec3 o = back * (origin - at), d = 1.0 / (back * direction);
  vec3 a = (-extent - o) * d, b = (extent - o) * d;
  float near = max(max(min(a.x, b.x), min(a.y, b.y)), min(a.z, b.z));
  float end = min(min(max(a.x, b.x), max(a.y, b.y)), max(a.z, b.z));
  return end > max(near, 0.0) && near < far && near > 0.0;
}
bool ballHit(vec3 origin, vec3 direction, vec3 at, float size, float far) {
  vec3 o = origin - at;
  float b = dot(o, direction), c = dot(o, o) - size * size, root = b * b - c;
  float start = -b - sqrt(max(root, 0.0));
  return root > 0.0 && start > 0.0 && start < far;
}
bool isShaded(vec3 origin, vec3 direction, float far) {
  return ballHit(origin, direction, ${vec3(BALL.at)}, ${number(BALL.size)}, far)
    || ${BOXES.map(({ at, half, turn }) => `boxHit(origin, direction, ${vec3(at)}, ${vec3(half)}, ${
    number(turn)}, far)`).join("\n    || ")};
}
`;

const LIGHT = `uniform vec3 hung;
uniform float size;
uniform vec3 source;
uniform vec3 sourceSide;
uniform float weight;
uniform vec3 glow;
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 cover;
void main() {
  cover = vec4(1.0);
  light = vec4(0.0, 0.0, 0.0, 1.0);
  uint thing = seenThing();
  if (thing == 0u) {
    return;
  }
  vec3 normal = normalize(seenSide()), start = seenPlace() + normal * 1e-4;
  vec3 color = colorOf(thing) * 0.318309886;
  light.rgb = color * glow;
  vec3 here = (start - hung) / size;
  vec3 offset = source - here;
  float square = dot(offset, offset), distance = sqrt(square);
  vec3 direction = offset / distance;
  float received = dot(normal, direction), sent = abs(dot(sourceSide, direction));
  float share = received * sent / square * weight;
  if (received <= 0.0 || !(share > 0.0) || isShaded(start, direction, distance * size * 0.9999)
    || isBlocked(here, direction, distance * 0.999)) {
    return;
  }
  light.rgb += color * share * lightOf(source, sourceSide, -direction);
}`;

const JOIN = `uniform sampler2D lamp0;
uniform sampler2D lamp1;
uniform sampler2D room0;
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 cover;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 behind = texelFetch(room0, at, 0).rgb * (1.0 - texelFetch(lamp1, at, 0).rgb);
  light = vec4(texelFetch(lamp0, at, 0).rgb + behind, 1.0);
  cover = vec4(1.0);
}`;

export class Room {
  constructor(gpu, lamp, canvas, onChange) {
    Object.assign(this, { gpu, lamp, ladder: LADDER, samples: new SurfaceSamples(lamp) });
    const { radius } = lamp.sphere;
    this.isTrueSize = radius >= FITTING[0] && radius <= FITTING[1];
    this.size = this.isTrueSize ? radius : USUAL;
    this.seen = { room: new Seen(gpu), lamp: new Seen(gpu) };
    this.targets = { room: null, lamp: null, both: null };
    this.uniforms = {
      ...lampUniforms(gpu, lamp), tree: { value: surfaceTree(lamp) }, eye: { value: [0, 0, 0] },
      hung: { value: [0, 0.1, 1.75] }, size: { value: this.size }, source: { value: [0, 0, 0] },
      sourceSide: { value: [0, 0, 1] }, weight: { value: 0 }, glow: { value: [0, 0, 0] },
    };
    this.hasGlow = true;
    this.makeThings();
    this.makePasses();
    this.mean = new Mean(gpu);
    this.view = new ViewPoint(canvas, VIEW, onChange);
  }

  /** The real width of the room in metres. */
  get width() {
    return (WIDTH * this.lamp.sphere.radius) / this.size;
  }

  /** Height of the lamp above the floor, in metres of the room. */
  get height() {
    return this.uniforms.hung.value[2];
  }

  set height(height) {
    this.uniforms.hung.value = this.uniforms.hung.value.with(2, height);
  }

  /**
   * Whether walls light each other, as an estimate: an even glow, the lamp's flux over the room's
   * area as often as it is thrown back.
   */
  set hasGlow(on) {
    const { flux, scale, sphere } = this.lamp;
    const area = AREA * (sphere.radius / this.size) ** 2;
    const often = on ? REFLECTED / (1 - REFLECTED) : 0;
    this.uniforms.glow.value = flux.map((power) => (power / area / scale) * often);
  }

  /** What is seen: the room by itself; and the lamp, where the room does not hide it. */
  makeThings() {
    this.things = { room: new Things(this.gpu), lamp: new Things(this.gpu) };
    for (const [k, { geometry, matrix }] of THINGS_SEEN.entries()) {
      this.things.room.add(geometry, k + 1, { matrix, side: FrontSide, flat: false });
      this.things.lamp.add(geometry, 0, { matrix, side: FrontSide, flat: false });
    }
    this.lampMesh = this.things.lamp.add(surfaceGeometry(this.lamp), 1, { frame: [0, 0, 0, 1] });
    this.lampMesh.matrixAutoUpdate = false;
  }

  makePasses() {
    const { gpu, lamp, uniforms, seen } = this;
    const source = lamp.shader.source + questions(lamp, gpu) + SEEN;
    const texture = () => ({ value: null });
    this.passes = {
      room: gpu.pass(source + OCCLUSION + THINGS + COLORS + LIGHT,
        { ...uniforms, ...seen.room.uniforms }),
      lamp: gpu.pass(source + LAMP_SEEN, { ...uniforms, ...seen.lamp.uniforms }),
      both: gpu.pass(JOIN, { lamp0: texture(), lamp1: texture(), room0: texture() }),
    };
  }

  async compile() {
    const { room, lamp } = this.passes;
    return await this.gpu.compile(room.scene) && this.gpu.compile(lamp.scene);
  }

  begin(size, index) {
    const camera = this.view.lens(size, jitter(index));
    const hung = new Vector3(...this.uniforms.hung.value);
    this.lampMesh.matrix.makeScale(this.size, this.size, this.size).setPosition(hung);
    this.lampMesh.material.uniforms.frame.value = [...hung.toArray(), this.size];
    for (const name of ["room", "lamp"]) {
      this.seen[name].draw(this.things[name], camera, size);
    }
    for (const name of Object.keys(this.targets)) {
      this.targets[name] = this.gpu.resized(this.targets[name], size);
    }
    this.uniforms.eye.value = camera.position.clone().sub(hung).divideScalar(this.size).toArray();
    const { place, normal, weight } = this.samples.point(index);
    this.uniforms.source.value = place;
    this.uniforms.sourceSide.value = normal;
    this.uniforms.weight.value = weight;
    return [0, 0, ...size];
  }

  draw(part) {
    for (const name of ["room", "lamp"]) {
      this.gpu.draw(this.passes[name].scene, null, this.targets[name], part);
    }
  }

  add(index, size) {
    const { room, lamp, both } = this.targets;
    const { uniforms, scene } = this.passes.both;
    [uniforms.lamp0.value, uniforms.lamp1.value] = lamp.textures;
    [uniforms.room0.value] = room.textures;
    this.gpu.draw(scene, null, both);
    this.mean.add(both, index, size);
  }

  dispose() {
    this.view.controls.dispose();
    [...Object.values(this.things), ...Object.values(this.passes)].forEach((x) => dispose(x.scene));
    this.uniforms.tree.value.dispose();
    Object.values(this.seen).forEach((seen) => seen.dispose());
    Object.values(this.targets).forEach((target) => target?.dispose());
    this.mean.clear();
  }
}

/** The things of the room: geometry, where it stands, and the part of light it throws back. */
function thingsSeen() {
  const plane = (matrix, width, height, albedo) =>
    ({ geometry: new PlaneGeometry(width, height), matrix, albedo });
  const turned = (x, y, z, rotation) => rotation.setPosition(x, y, z);
  const [left, back] = CORNER;
  const middle = [left + WIDTH / 2, back - WIDTH / 2];
  const sideways = new Matrix4().makeBasis(new Vector3(0, 1, 0), new Vector3(0, 0, 1),
    new Vector3(1, 0, 0));
  const walls = [
    plane(turned(...middle, 0, new Matrix4()), WIDTH, WIDTH, FLOOR),
    plane(turned(middle[0], back, HEIGHT / 2, new Matrix4().makeRotationX(Math.PI / 2)), WIDTH,
      HEIGHT, WHITE),
    plane(turned(left, middle[1], HEIGHT / 2, sideways), WIDTH, HEIGHT, WHITE),
    plane(turned(...middle, HEIGHT, new Matrix4().makeRotationX(Math.PI)), WIDTH, WIDTH, WHITE),
  ];
  const ball = {
    geometry: new SphereGeometry(BALL.size, 64, 48), albedo: CLAY,
    matrix: new Matrix4().makeTranslation(...BALL.at),
  };
  const boxes = BOXES.map(({ at, half, turn }, k) => ({
    geometry: new BoxGeometry(...half.map((side) => 2 * side)), albedo: k ? SLATE : WHITE,
    matrix: turned(...at, new Matrix4().makeRotationZ(turn)),
  }));
  return [...walls, ball, ...boxes];
}

const THINGS_SEEN = thingsSeen();
const COLORS = `vec3 colorOf(uint thing) {
  ${THINGS_SEEN.map(({ albedo }, k) => `if (thing == ${k + 1}u) { return ${vec3(albedo)}; }`)
    .join("\n  ")}
  return vec3(0.5);
}
`;
