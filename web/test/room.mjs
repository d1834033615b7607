// What the room receives at some places, for Python to compare: node test/room.mjs PAGE LAMP.
//
// Prints a list of { point, normal, light }: a place on ceiling or wall in the lamp's own frame and
// metres, and the light that it throws back in W/(m² sr), without the glow of the walls.

import { pathToFileURL } from "node:url";

import { drawn, launch, openPage } from "./browser.mjs";

const SIZE = [32, 24];
const SAMPLES = 192;
const [page, lamp] = process.argv.slice(2);

/** Runs in the page: the mean of many samples, and where its pixels are. */
async function measured([size, samples]) {
  const { views: { room }, picture, gpu } = globalThis.purelight;
  await room.ready;
  picture.restart(null);
  room.hasGlow = false;
  for (let index = 0; index < samples; index++) {
    room.begin(size, 0);
    const { place, normal, weight } = room.samples.point(index);
    room.uniforms.source.value = place;
    room.uniforms.sourceSide.value = normal;
    room.uniforms.weight.value = weight;
    room.draw([0, 0, ...size]);
    room.add(index, size);
    await gpu.finish();
  }
  const read = (target, Kind, layer) => {
    const pixels = new Kind(size[0] * size[1] * 4);
    gpu.renderer.readRenderTargetPixels(target, 0, 0, ...size, pixels, undefined, layer);
    return pixels;
  };
  const light = read(room.mean.targets.at(-1), Float32Array);
  const [places, sides] = [0, 1].map((layer) => read(room.seen.room.target, Uint32Array, layer));
  const cover = read(room.seen.lamp.target, Uint32Array);
  const { sphere, scale } = room.lamp;
  const hung = room.uniforms.hung.value;
  const found = [];
  for (let k = 0; k < size[0] * size[1]; k++) {
    const vector = (words) => Array.from(new Float32Array(words.slice(4 * k, 4 * k + 3).buffer));
    const thing = places[4 * k + 3];
    if ((thing === 2 || thing === 4) && cover[4 * k + 3] === 0) {
      const point = vector(places).map((x, axis) =>
        sphere.center[axis] + ((x - hung[axis]) / room.size) * sphere.radius);
      const color = Array.from(light.slice(4 * k, 4 * k + 3), (x) => x * scale);
      found.push({ point, normal: vector(sides), light: color, thing });
    }
  }
  return found;
}

const browser = await launch();
const opened = await openPage(browser, pathToFileURL(page).href);
await opened.page.setInputFiles("#file", lamp);
await drawn(opened.page);
await opened.page.click("#tab-room");
await opened.page.waitForFunction(() => globalThis.purelight.views.room);
const found = await opened.page.evaluate(measured, [SIZE, SAMPLES]);
console.log(JSON.stringify(found));
await browser.close();
