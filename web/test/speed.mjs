// Frames a second in a headless Chromium with a software WebGL: npm run speed -- LAMP ...
//
// Processor time is that of Chromium's processes together (Linux), so that it does not depend on what
// else the machine does.

import { readdirSync, readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

import { drawn, launch, openPage } from "./browser.mjs";

const PAGE = new URL("../../runtimes/onnx/purelight_onnx/page.html", import.meta.url).pathname;
const SIZES = [64, 128, 256];
const FRAMES = 5;

/** Draws frames of a size in the page: the least seconds of one, the pixels of the lamp in it. */
async function measured([size, frames]) {
  const { views: { look }, picture, gpu } = globalThis.purelight;
  picture.restart(null);
  const times = [];
  for (let frame = 0; frame < frames; frame++) {
    const start = performance.now();
    look.begin([size, size], 0);
    look.draw([0, 0, size, size]);
    await gpu.finish();
    times.push(performance.now() - start);
  }
  const pixels = new Float32Array(size * size * 4);
  gpu.renderer.readRenderTargetPixels(look.sample, 0, 0, size, size, pixels);
  const lit = pixels.filter((x, k) => k % 4 === 3 && x > 0).length;
  return { lit, seconds: Math.min(...times) / 1000 };
}

/** Seconds that this process's descendants have computed so far. */
function computed() {
  const parents = new Map();
  for (const pid of readdirSync("/proc").filter((name) => /^[0-9]+$/.test(name))) {
    try {
      const text = readFileSync(`/proc/${pid}/stat`, "utf8");
      const fields = text.slice(text.lastIndexOf(")") + 2).split(" ");
      parents.set(Number(pid), [Number(fields[1]), Number(fields[11]) + Number(fields[12])]);
    } catch {
      // It has ended meanwhile.
    }
  }
  const isOurs = (pid) => pid === process.pid || (parents.has(pid) && isOurs(parents.get(pid)[0]));
  const ticks = [...parents].map(([pid, [, time]]) => (pid !== process.pid && isOurs(pid) ? time : 0));
  return ticks.reduce((a, b) => a + b, 0) / 100;
}

const browser = await launch();
for (const lamp of process.argv.slice(2)) {
  const { page, context } = await openPage(browser, pathToFileURL(PAGE).href);
  await page.setInputFiles("#file", lamp);
  await page.waitForFunction(() => globalThis.purelight.views.look?.mean.shown, null,
    { timeout: 600_000 });
  const text = await page.evaluate(() => globalThis.purelight.lamp.shader.source.length);
  console.log(`${lamp}: ${(text / 1e3).toFixed(0)} kB of GLSL`);
  for (const size of SIZES) {
    await page.evaluate(measured, [size, 1]);
    const before = computed();
    const { lit, seconds } = await page.evaluate(measured, [size, FRAMES]);
    const processor = (computed() - before) / FRAMES;
    console.log(`  ${size} x ${size}, ${lit} pixels of the lamp: ${(1 / seconds).toFixed(1)} frames/s, ${
      (1000 * processor).toFixed(0)} ms of processor time a frame`);
  }
  await context.close();
}
await browser.close();
