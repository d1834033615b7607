// A picture that is drawn a tile at a time: coarse at once, then finer, then smoother.
//
// A tile is so small that the graphics card is done with it in a moment, however costly a lamp's
// networks are: the first one is tiny, and each tells how large the next may be.

const FIRST_TILE = 1 << 10; // Pixels.
const LEAST_TILE = 1 << 6;
const QUICK = 40; // Milliseconds for a tile.
const FRAME = 30; // Milliseconds of drawing before the page is shown.
const BAND = 16; // Rows of tiles that are no whole rows.

/**
 * Draws a `subject` again and again, and shows the mean.
 *
 * A subject has `ladder`, a list of { divisor, samples, least }: how coarse, how often to draw, and
 * after how many times it is shown; `begin(size, index)`, which prepares a sample and gives the
 * rectangle that is not empty; `draw(rectangle)`; `add(index, size)`, which joins the sample to the mean;
 * and `show(size)`.
 */
export class Progressive {
  constructor(gpu, size) {
    Object.assign(this, { gpu, size, subject: null, tile: FIRST_TILE, epoch: 0, running: false });
    this.figures = { tiles: 0, samples: 0, pixels: 0, milliseconds: 0 };
  }

  /** Draws another subject, or the same from another side. */
  restart(subject = this.subject) {
    this.subject = subject;
    this.epoch += 1;
    if (subject && !this.running) {
      this.running = true;
      this.run().finally(() => {
        this.running = false;
      });
    }
  }

  /** Shows the picture anew, with other tones. */
  refresh() {
    if (this.subject && this.shown) {
      this.subject.show(this.shown);
    }
  }

  /** Whether all is drawn. */
  get isDone() {
    return !this.running;
  }

  async run() {
    for (let epoch = -1; epoch !== this.epoch; ) {
      epoch = this.epoch;
      await nextFrame();
      for (const step of this.subject?.ladder ?? []) {
        if (!(await this.climb(step, epoch))) {
          break;
        }
      }
    }
  }

  /** All samples of one size; whether nothing else was asked for meanwhile. */
  async climb({ divisor, samples, least }, epoch) {
    const { subject } = this;
    const size = this.size().map((side) => Math.max(1, Math.round(side / divisor)));
    for (let index = 0; index < samples; index++) {
      if (!(await this.sample(size, index, epoch))) {
        return false;
      }
      subject.add(index, size);
      if (index + 1 >= least) {
        this.shown = size;
        subject.show(size);
        subject.onShown?.(size, index + 1);
      }
      this.figures.samples += 1;
      await this.breathe();
    }
    return true;
  }

  /** One sample of all pixels. */
  async sample(size, index, epoch) {
    const area = this.subject.begin(size, index);
    for (let next = [area[0], area[1]]; next; ) {
      if (epoch !== this.epoch) {
        return false;
      }
      const { part, after } = tileAt(area, next, this.tile);
      next = after;
      await this.timed(part);
    }
    return epoch === this.epoch;
  }

  /** Draws a tile, and learns how large the next may be. */
  async timed(part) {
    const start = performance.now();
    this.subject.draw(part);
    await this.gpu.finish();
    const took = Math.max(performance.now() - start, 0.1);
    const pixels = part[2] * part[3];
    const growth = Math.min(4, Math.max(0.25, QUICK / took));
    this.tile = Math.max(LEAST_TILE, Math.min(this.tile * 4, Math.round(pixels * growth)));
    this.figures.tiles += 1;
    this.figures.pixels += pixels;
    this.figures.milliseconds += took;
    await this.breathe();
  }

  /** Lets the page be shown from time to time. */
  async breathe() {
    if (performance.now() - (this.last ?? 0) > FRAME) {
      await nextFrame();
      this.last = performance.now();
    }
  }
}

/** A tile of about so many pixels at a place, and where the next one begins. */
function tileAt([left, bottom, width, height], [x, y], pixels) {
  const right = left + width;
  const top = bottom + height;
  const rows = x === left ? Math.min(top - y, Math.max(BAND, Math.floor(pixels / width))) : BAND;
  const tall = Math.min(rows, top - y);
  const whole = tall * width <= pixels && x === left;
  const wide = whole ? width : Math.min(right - x, Math.max(4, Math.floor(pixels / tall)));
  const ends = x + wide >= right;
  const after = ends ? [left, y + tall] : [x + wide, y];
  return { part: [x, y, wide, tall], after: after[1] < top ? after : null };
}

function nextFrame() {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, 100); // Where the page is hidden there are no frames.
    requestAnimationFrame(() => {
      clearTimeout(timer);
      resolve();
    });
  });
}
