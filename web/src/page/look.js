// The lamp as it is, over a background that one sees through it.

import { dispose, HEAD } from "./gpu.js";
import { LAMP_SEEN, lampUniforms, questions, surfaceGeometry } from "./lamp.js";
import { Mean } from "./mean.js";
import { SEEN, Seen, Things } from "./seen.js";
import { ViewPoint } from "./view_point.js";

const ANGLE = 28; // Degrees, the narrower side of the picture.
const MARGIN = 1.12; // Of the picture over the sphere.
const LADDER = [
  { divisor: 8, samples: 1, least: 1 },
  { divisor: 4, samples: 1, least: 1 },
  { divisor: 2, samples: 1, least: 1 },
  { divisor: 1, samples: 16, least: 1 },
];

/** Where in a pixel sample number `index` lies, from its middle. */
export function jitter(index) {
  return index === 0 ? [0, 0] : [0.7548776662466927, 0.5698402909980532]
    .map((step) => ((0.5 + index * step) % 1) - 0.5);
}

export class Look {
  constructor(gpu, lamp, canvas, onChange) {
    Object.assign(this, { gpu, lamp, ladder: LADDER, sample: null });
    this.things = new Things(gpu);
    this.things.add(surfaceGeometry(lamp), 1);
    this.seen = new Seen(gpu);
    this.eye = { value: [0, 0, 0] };
    this.light = gpu.pass(lamp.shader.source + questions(lamp, gpu) + SEEN + LAMP_SEEN, {
      ...lampUniforms(gpu, lamp), ...this.seen.uniforms, eye: this.eye,
    });
    this.mean = new Mean(gpu);
    this.view = new ViewPoint(canvas, {
      target: [0, 0, 0], azimuth: 30, elevation: 10, angle: ANGLE,
      distance: MARGIN / Math.sin((ANGLE * Math.PI) / 360),
      bounds: {
        distance: [1.2, 40], azimuth: [-Infinity, Infinity], polar: [0.001, Math.PI - 0.001],
        reach: 1.001,
      },
    }, onChange);
  }

  compile() {
    return this.gpu.compile(this.light.scene);
  }

  begin(size, index) {
    const camera = this.view.lens(size, jitter(index));
    this.seen.draw(this.things, camera, size);
    this.eye.value = camera.position.toArray();
    this.sample = this.gpu.resized(this.sample, size);
    this.gpu.clear(this.sample);
    return this.area(size, camera.position.length());
  }

  /** The rectangle that the sphere fills. */
  area([width, height], distance) {
    const half = Math.tan((ANGLE * Math.PI) / 360) / Math.min(width, height);
    const reach = Math.ceil(1 / Math.sqrt(distance ** 2 - 1) / half / 2) + 2;
    const [left, bottom] = [width, height].map((side) => Math.max(0, Math.floor(side / 2 - reach)));
    return [left, bottom, width - 2 * left, height - 2 * bottom];
  }

  draw(part) {
    this.gpu.draw(this.light.scene, null, this.sample, part);
  }

  add(index, size) {
    this.mean.add(this.sample, index, size);
  }

  dispose() {
    this.view.controls.dispose();
    [this.things.scene, this.light.scene].forEach(dispose);
    this.seen.dispose();
    this.sample?.dispose();
    this.mean.clear();
  }
}
