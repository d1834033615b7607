// A picture that is drawn a tile at a time: coarse at once, then finer, then smoother.
//
// A tile is so small that the graphics card is done with it in a moment, however costly a lamp's
// networks are: the first one is tiny, and each tells how large the next may be.

const FIRST_TILE = 1 << 10; // Pixels.
const LEAST_TILE = 1 << 6;
const QUICK = 40; // Milliseconds for a tile.
const FRAME = 30; // Milliseconds of drawing before the page is shown.
const BAND = 16; // Rows of tiles that are no whole rows.
const AT_ONCE = 60; // Milliseconds that the first picture may take, if that is possible.

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
    Object.assign(this, { gpu, size, subject: null, tile: FIRST_TILE, speed: 0, epoch: 0 });
    this.running = false;
    this.figures = { tiles: 0, samples: 0, pixels: 0, milliseconds: 0 };
  }

  /** Draws another subject, or the same from another side. */
  restart(subject = this.subject) {
    if (subject !== this.subject) {
      [this.tile, this.speed] = [FIRST_TILE, 0]; // Nothing is known of its cost.
    }
    this.subject = subject;
    this.epoch += 1;
    if (subject && !this.running) {
      this.running = true;
      this.run().finally(() => {
        this.running = false;
      });
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
      const { subject } = this;
      const steps = subject?.ladder.slice(this.firstStep(subject)) ?? [];
      for (const [k, step] of steps.entries()) {
        if (!(await this.climb(step, { epoch, subject, first: k === 0, least: step.least }))) {
          break;
        }
      }
    }
  }

  /** The finest step that is drawn in a moment, by what tiles took so far. */
  firstStep({ ladder }) {
    const [width, height] = this.size();
    const time = ({ divisor }) => (width * height) / divisor ** 2 / this.speed;
    const quick = ladder.findLastIndex((step) => time(step) <= AT_ONCE);
    return this.speed ? Math.max(0, quick) : 0;
  }

  /** Whether drawing goes on; the first picture is finished even if something else is asked for. */
  goesOn({ epoch, subject, first, least }, index) {
    return subject === this.subject && (epoch === this.epoch || (first && index < least));
  }

  /** All samples of one size; whether nothing else was asked for meanwhile. */
  async climb({ divisor, samples, least }, work) {
    const { subject } = work;
    const size = this.size().map((side) => Math.max(1, Math.round(side / divisor)));
    for (let index = 0; index < samples; index++) {
      if (!(await this.sample(size, index, work))) {
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
    return work.epoch === this.epoch;
  }

  /** One sample of all pixels. */
  async sample(size, index, work) {
    if (!this.goesOn(work, index)) {
      return false;
    }
    const area = work.subject.begin(size, index);
    for (let next = [area[0], area[1]]; next; ) {
      if (!this.goesOn(work, index)) {
        return false;
      }
      const { part, after } = tileAt(area, next, this.tile);
      next = after;
      await this.timed(part, work.subject);
    }
    return this.goesOn(work, index);
  }

  /** Draws a tile, and learns how large the next may be. */
  async timed(part, subject) {
    const start = performance.now();
    subject.draw(part);
    await this.gpu.finish();
    const took = Math.max(performance.now() - start, 0.1);
    const pixels = part[2] * part[3];
    this.speed = this.speed ? 0.8 * this.speed + 0.2 * (pixels / took) : pixels / took;
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
