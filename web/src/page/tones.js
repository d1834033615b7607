// How radiance becomes a picture: exposure, dimmer, balance, background; and the controls for them.

import { LUMINANCE } from "../format/tables.js";
import { checkbox, choice, note, slider } from "./elements.js";

const BALANCE = 0.7; // How far the lamp's colour is moved towards white.
const BACKGROUNDS = {
  checks: "Checks",
  black: "Black",
  grey: "Grey",
  white: "White",
  color: "Colours",
};
const PAIRS = {
  checks: [[0.5, 0.5, 0.5], [0.16, 0.16, 0.16]],
  black: [[0, 0, 0], [0, 0, 0]],
  grey: [[0.22, 0.22, 0.22], [0.22, 0.22, 0.22]],
  white: [[1, 1, 1], [1, 1, 1]],
  color: [[0.75, 0.16, 0.08], [0.06, 0.3, 0.7]],
};

/** Gains that move a colour most of the way to white, at equal luminance. */
export function balanceOf(flux) {
  const most = Math.max(...flux);
  const present = flux.map((x) => Math.max(x, 1e-3 * most));
  const gains = present.map((x) => (most > 0 ? x ** -BALANCE : 1));
  const luminance = (color) => color.reduce((sum, x, k) => sum + x * LUMINANCE[k], 0);
  const level = luminance(present) / luminance(gains.map((gain, k) => gain * present[k]));
  return gains.map((gain) => (most > 0 ? gain * level : 1));
}

export class Tones {
  /** Exposed for a percentile, of the lit pixels only or of all; with something behind or not. */
  constructor(lamp, { percentile, onlyLit, withBackground }, onChange) {
    Object.assign(this, { lamp, percentile, onlyLit, withBackground, onChange });
    Object.assign(this, { stops: 0, exposed: 0, offset: 0, dimmer: 1, balanced: false });
    this.isClear = lamp.networks.includes("transparency");
    this.background = this.isClear ? "checks" : "black";
    this.level = 0.14;
  }

  /** Exposes for the first picture and the finer ones after it, not for every turn of the lamp. */
  expose(mean) {
    const { width } = mean.shown;
    if (width > this.exposed) {
      this.stops = mean.stops(this.percentile, this.onlyLit);
      this.exposed = width;
    }
  }

  /** What a mean is shown with. */
  get values() {
    const gain = 2 ** (this.stops + this.offset) * this.dimmer;
    const colour = this.balanced ? balanceOf(this.lamp.flux) : [1, 1, 1];
    const values = { gain: colour.map((x) => x * gain), square: 20 * devicePixelRatio };
    if (this.withBackground) {
      values.behind = PAIRS[this.background].map((color) => color.map((x) => x * this.level));
    }
    return values;
  }

  set(name, value) {
    this[name] = value;
    this.onChange();
  }

  /** Sliders and choices. */
  controls() {
    const stops = (value) => (value === 0 ? "auto" : `auto ${value > 0 ? "+" : "−"}${
      Math.abs(value).toFixed(1)} stops`);
    const percent = (value) => `${Math.round(100 * value)} %`;
    this.exposure = slider("Exposure", {
      min: -8, max: 8, step: 0.1, value: 0, show: stops, onInput: (x) => this.set("offset", x),
    });
    const dimmer = slider("Dimmer", {
      min: 0, max: 1, step: 0.01, value: 1, show: percent, onInput: (x) => this.set("dimmer", x),
    });
    const balance = checkbox("Balance to the lamp’s colour", false, (on) => this.set("balanced", on));
    return [this.exposure.row, dimmer.row, ...this.backgroundControls(percent), balance.row];
  }

  backgroundControls(percent) {
    if (!this.withBackground) {
      return [];
    }
    const background = choice("Background", BACKGROUNDS, this.background,
      (name) => this.set("background", name));
    const level = slider("Background light", {
      min: 0, max: 1, step: 0.01, value: this.level, show: percent,
      onInput: (x) => this.set("level", x),
    });
    const blind = note("This lamp has no network for transparency: it hides what is behind it.");
    return [background.row, level.row, ...(this.isClear ? [] : [blind])];
  }

  /** Steps of exposure by keys. */
  step(stops) {
    this.exposure.set(Math.min(8, Math.max(-8, this.offset + stops)));
    this.set("offset", Number(this.exposure.input.value));
  }
}
