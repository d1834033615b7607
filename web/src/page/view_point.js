// From where something is seen: an orbit about its middle, by hand, wheel, fingers or keys.

import { PerspectiveCamera, Spherical, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const TURN = Math.PI / 36; // Of an arrow key.
const STEP = 1.15; // Of a plus or minus.
const KEYS = {
  ArrowLeft: (s) => { s.theta -= TURN; },
  ArrowRight: (s) => { s.theta += TURN; },
  ArrowUp: (s) => { s.phi -= TURN; },
  ArrowDown: (s) => { s.phi += TURN; },
  "+": (s) => { s.radius /= STEP; },
  "=": (s) => { s.radius /= STEP; },
  "-": (s) => { s.radius *= STEP; },
};
const UP = new Vector3(0, 0, 1);

export class ViewPoint {
  /** `bounds` are of { distance, azimuth, polar }: least and most. */
  constructor(canvas, { target, azimuth, elevation, distance, angle, bounds }, onChange) {
    this.camera = new PerspectiveCamera(angle, 1, 0.01, 1000);
    this.camera.up.copy(UP);
    Object.assign(this, { target: new Vector3(...target), angle, bounds, onChange });
    this.home = { azimuth, elevation, distance };
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enablePan: false, enableDamping: false, enabled: false });
    Object.assign(this.controls, {
      minDistance: bounds.distance[0], maxDistance: bounds.distance[1],
      minAzimuthAngle: bounds.azimuth[0], maxAzimuthAngle: bounds.azimuth[1],
      minPolarAngle: bounds.polar[0], maxPolarAngle: bounds.polar[1],
    });
    this.controls.target.copy(this.target);
    this.goHome();
    this.controls.addEventListener("change", () => this.onChange());
  }

  set active(active) {
    this.controls.enabled = active;
  }

  /** Degrees from +X and above the horizon. */
  goHome() {
    const { azimuth, elevation, distance } = this.home;
    const [a, e] = [azimuth, elevation].map((degrees) => (degrees * Math.PI) / 180);
    const offset = new Vector3(Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e));
    this.camera.position.copy(this.target).addScaledVector(offset, distance);
    this.controls.update();
  }

  /** Whether a key was meant for the view. */
  press(key) {
    if (key === "Home") {
      this.goHome();
      return true;
    }
    if (!Object.hasOwn(KEYS, key)) {
      return false;
    }
    // Three counts angles from +Y, where we have +Z.
    const offset = this.camera.position.clone().sub(this.target);
    const spherical = new Spherical().setFromCartesianCoords(offset.y, offset.z, offset.x);
    KEYS[key](spherical);
    spherical.makeSafe();
    const [least, most] = this.bounds.distance;
    spherical.radius = Math.min(most, Math.max(least, spherical.radius));
    const { x, y, z } = new Vector3().setFromSpherical(spherical);
    this.camera.position.set(z, x, y).add(this.target);
    this.controls.update();
    return true;
  }

  /** The camera of a picture, moved by parts of a pixel. */
  lens([width, height], [right, up] = [0, 0]) {
    const { camera } = this;
    const aspect = width / height;
    const half = Math.tan((this.angle * Math.PI) / 360) / Math.min(1, aspect);
    camera.fov = (Math.atan(half) * 360) / Math.PI;
    camera.aspect = aspect;
    const distance = camera.position.distanceTo(this.target);
    const reach = this.bounds.reach;
    camera.near = Math.max(distance - reach, 0.002 * distance);
    camera.far = distance + reach;
    camera.setViewOffset(width, height, right, -up, width, height);
    camera.updateMatrixWorld();
    return camera;
  }
}
