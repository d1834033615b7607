// The page in a headless Chromium with a software WebGL: what it shows, and what it refuses.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import test, { after, before } from "node:test";
import { pathToFileURL } from "node:url";

import { build } from "esbuild";

import { meet } from "../../examples/hosts/node/surface.mjs";
import { examine } from "../src/format/validate.js";
import { evaluate } from "../src/network/evaluate.js";
import { drawn, launch, openPage } from "./browser.mjs";
import { bytes, FOLDER, inputsOf, json, largestError, NEEDS, path } from "./files.mjs";

const PAGE = process.env.PURELIGHT_PAGE
  ?? new URL("../../runtimes/onnx/purelight_onnx/page.html", import.meta.url).pathname;
const ADDRESS = pathToFileURL(PAGE).href;
const SHOTS = process.env.PURELIGHT_SHOTS ?? (FOLDER && path("shots"));
const ROWS = 7;
let browser;

before(async () => {
  if (FOLDER) {
    mkdirSync(SHOTS, { recursive: true });
    browser = await launch();
  }
});
after(() => browser?.close());

/** A page of its own for a test; it must not complain. */
async function onPage(work, { address = ADDRESS, complains = false, ...options } = {}) {
  const opened = await openPage(browser, address, options);
  try {
    await work(opened.page, opened);
    assert.deepEqual(complains ? [] : opened.complaints, []);
  } finally {
    await opened.context.close();
  }
}

const lamp = (name) => path("good", `${name}.plux`);
const shot = (page, name) => page.screenshot({ path: join(SHOTS, `${name}.png`) });

/** Opens a file, and waits until the page has answered. */
async function open(page, file) {
  await page.setInputFiles("#file", file);
  await answered(page);
}

function answered(page) {
  return page.waitForFunction(() => !document.getElementById("panel").hidden
    || !document.getElementById("message").hidden, null, { timeout: 120_000 });
}

/** Drops a file on the page, as a hand does. */
async function drop(page, file, content) {
  const data = await page.evaluateHandle(([name, text]) => {
    const transfer = new DataTransfer();
    const bytesOf = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    transfer.items.add(new File([bytesOf], name));
    return transfer;
  }, [file, Buffer.from(content).toString("base64")]);
  for (const event of ["dragover", "drop"]) {
    await page.dispatchEvent("body", event, { dataTransfer: data });
  }
}

test("every operator and drawn networks give their values as GLSL", NEEDS, async () => {
  const bench = await build({
    entryPoints: [new URL("bench.js", import.meta.url).pathname], bundle: true, write: false,
    format: "iife",
  });
  await onPage(async (page) => {
    await page.addScriptTag({ content: bench.outputFiles[0].text });
    let compared = 0;
    for (const entry of json("networks.json").filter(({ outputs }) => outputs)) {
      const inputs = Object.fromEntries(
        Object.entries(inputsOf(entry)).map(([name, values]) => [name, Array.from(values)]),
      );
      const run = ([model, rows, count]) => globalThis.evaluateOnGpu(model, rows, count);
      const values = await page.evaluate(run, [entry.onnx, inputs, ROWS]);
      assert.ok(Array.isArray(values), `${entry.name}: ${values}`);
      assert.ok(largestError(values, entry) <= 1, `${entry.name}: ${values.slice(0, 6)}`);
      compared += 1;
    }
    assert.ok(compared > 100);
  }, { address: "about:blank", complains: true });
});

test("golden vectors of every network are met by the page's GLSL", NEEDS, async (t) => {
  for (const name of ["octahedron", "globe", "lantern", "wild", "wild_compact"]) {
    await onPage(async (page) => {
      await open(page, lamp(name));
      await page.click("#tab-inspect");
      await page.evaluate(() => globalThis.purelight.picture.restart(null));
      await page.click("#check");
      await page.waitForFunction(() => document.getElementById("check").dataset.done, null,
        { timeout: 240_000 });
      const rows = await page.$$eval("#machine tr", (all) => all.slice(1).map((row) => row.innerText));
      const networks = await page.evaluate(() => globalThis.purelight.lamp.networks);
      assert.equal(rows.length, networks.length);
      for (const row of rows) {
        t.diagnostic(`${name}: ${row.replaceAll("\t", " ")}`);
        assert.match(row, /all \d+ vectors met/);
      }
    });
  }
});

test("the picture is that of rays and networks, pixel by pixel", NEEDS, async () => {
  const { surface, networks, manifest } = examine(bytes("good", "wild.plux"));
  const { center, radius } = manifest.bounding_sphere;
  const corners = Array.from({ length: surface.triangles.length / 3 }, (_, t) => [0, 1, 2].map((k) =>
    Array.from(surface.positions.subarray(3 * surface.triangles[3 * t + k]).subarray(0, 3))));
  await onPage(async (page) => {
    await open(page, lamp("wild"));
    await drawn(page);
    const side = 24;
    const { light, cover, place, inverse } = await page.evaluate(async (size) => {
      const { picture, views: { look }, gpu } = globalThis.purelight;
      picture.restart(null);
      await look.ready;
      look.begin([size, size], 0);
      look.draw([0, 0, size, size]);
      await gpu.finish();
      const read = (layer) => {
        const pixels = new Float32Array(size * size * 4);
        gpu.renderer.readRenderTargetPixels(look.sample, 0, 0, size, size, pixels, undefined, layer);
        return Array.from(pixels);
      };
      const { camera } = look.view;
      const toWorld = camera.matrixWorld.clone().multiply(camera.projectionMatrixInverse);
      return { light: read(0), cover: read(1), place: camera.position.toArray(),
        inverse: toWorld.elements };
    }, side);
    let seen = 0;
    for (let k = 0; k < side * side; k += 7) {
      const [x, y] = [k % side, Math.floor(k / side)].map((at) => (2 * (at + 0.5)) / side - 1);
      const at = [0, 1, 2, 3].map((row) => [x, y, 0.5, 1]
        .reduce((sum, value, column) => sum + value * inverse[4 * column + row], 0));
      const direction = [0, 1, 2].map((axis) => at[axis] / at[3] - place[axis]);
      const length = Math.hypot(...direction);
      const origin = place.map((value, axis) => center[axis] + radius * value);
      const hit = meet(corners, origin, direction.map((value) => value / length));
      const right = hit ? answers(networks, hit, manifest.radiance_scale) : [0, 0, 0, 0, 0, 0];
      const found = [...light.slice(4 * k, 4 * k + 3), ...cover.slice(4 * k, 4 * k + 3)];
      seen += hit ? 1 : 0;
      if (hit?.depth === undefined || !isRim(corners, origin, direction)) {
        found.forEach((value, i) => assert.ok(Math.abs(value - right[i]) < 2e-3 * (1 + right[i]),
          `pixel ${k}: ${found}, not ${right}`));
      }
    }
    assert.ok(seen > 20, `${seen} pixels`);
  });
});

/** Whether a pixel's ray only touches the rim, where rounding decides. */
function isRim(corners, origin, direction) {
  const moved = [1e-4, -1e-4].map((shift) => direction.map((value, k) => value + (k ? shift : 0)));
  const hits = moved.map((ray) => {
    const length = Math.hypot(...ray);
    return Boolean(meet(corners, origin, ray.map((value) => value / length)));
  });
  return hits[0] !== hits[1];
}

/** Light over the scale, and cover, where a ray meets the surface. */
function answers(networks, { position, normal, outgoing }, scale) {
  const inputs = Object.fromEntries(Object.entries({ position, normal, outgoing })
    .map(([name, values]) => [name, Float32Array.from(values)]));
  const { radiance } = evaluate(networks.get("appearance"), inputs, 1);
  const { transmittance } = evaluate(networks.get("transparency"), inputs, 1);
  return [...Array.from(radiance, (x) => x / scale), ...Array.from(transmittance, (x) => 1 - x)];
}

test("a lamp is looked at, lights a room, and is described", NEEDS, async () => {
  await onPage(async (page) => {
    await open(page, lamp("globe"));
    await drawn(page);
    assert.equal(await page.title(), "Glass globe – PureLight");
    assert.ok(await brightness(page) > 1e-3);
    await shot(page, "look_dark");
    await page.click("#tab-room");
    await page.waitForFunction(() => Number(document.getElementById("canvas").dataset.shown?.split(" ")[0])
      && globalThis.purelight.subject === globalThis.purelight.views.room
      && globalThis.purelight.views.room.mean.shown, null, { timeout: 120_000 });
    assert.ok(await brightness(page) > 1e-3);
    await shot(page, "room_dark");
    await page.click("#tab-inspect");
    const text = await page.innerText("#inspect");
    for (const words of ["Glass globe: a PureLight luminaire", "18 cm across", "appearance",
      "not: sample its own light", "digest", "None: the file follows the format"]) {
      assert.ok(text.includes(words), words);
    }
    await shot(page, "inspect_dark");
  }, { colorScheme: "dark" });
});

/** Mean luminance of what is shown, before it is exposed. */
function brightness(page) {
  return page.evaluate(() => {
    const { gpu, subject } = globalThis.purelight;
    const { shown } = subject.mean;
    const pixels = new Float32Array(shown.width * shown.height * 4);
    gpu.renderer.readRenderTargetPixels(shown, 0, 0, shown.width, shown.height, pixels);
    return pixels.reduce((sum, x, k) => sum + (k % 4 < 3 ? x : 0), 0) / pixels.length;
  });
}

test("exposure, dimmer and background change the picture at once", NEEDS, async () => {
  await onPage(async (page) => {
    await open(page, lamp("globe"));
    await drawn(page);
    await page.evaluate(() => globalThis.purelight.picture.restart(null));
    const level = async () => (await page.locator("#stage").screenshot()).length;
    const gains = () => page.evaluate(() => globalThis.purelight.views.look.tones.values);
    const before = await gains();
    await page.locator("#look input[type=range]").first().fill("2");
    assert.ok(Math.abs((await gains()).gain[0] / before.gain[0] - 4) < 1e-6);
    await page.locator("#look input[type=range]").nth(1).fill("0");
    assert.equal((await gains()).gain[0], 0);
    const checks = await level();
    await page.selectOption("#look select", "black");
    assert.deepEqual((await gains()).behind, [[0, 0, 0], [0, 0, 0]]);
    assert.ok(await level() < checks / 2, "a dark lamp before black is an empty picture");
  });
});

test("a damaged file is one line, and nothing is shown; the next lamp is", NEEDS, async () => {
  await onPage(async (page) => {
    const good = bytes("good", "globe.plux");
    const cases = {
      "PLX_ZIP_CRC": damaged(good, 0.5), "PLX_ZIP_TRUNCATED": good.subarray(0, 5000),
      "PLX_ZIP_BAD_SIGNATURE": new TextEncoder().encode("no lamp at all"),
      "PLX_GOLDEN_MISMATCH": bytes("bad", "PLX_GOLDEN_MISMATCH-0.plux"),
      "PLX_ONNX_COST": bytes("bad", "PLX_ONNX_COST-0.plux"),
    };
    await drop(page, "lamp.plux", good);
    await drawn(page);
    for (const [code, content] of Object.entries(cases)) {
      await drop(page, "damaged.plux", content);
      await page.waitForSelector("#message:not([hidden])");
      const message = await page.innerText("#message");
      assert.match(message, new RegExp(`^damaged.plux is not shown: ${code} at .+$`));
      assert.ok(message.length < 400 && !message.includes("\n"), message);
      assert.deepEqual(await page.evaluate(() => [document.getElementById("panel").hidden,
        document.getElementById("name").textContent, globalThis.purelight.lamp]), [true, "", null]);
    }
    await shot(page, "damaged");
    await drop(page, "lamp.plux", good);
    await drawn(page);
    assert.equal(await page.isVisible("#message"), false);
  });
});

/** A file with one byte changed, somewhere in the middle of a member. */
function damaged(good, part) {
  const copy = Uint8Array.from(good);
  copy[Math.floor(copy.length * part)] ^= 64;
  return copy;
}

test("a file that is too large is not even read", NEEDS, async () => {
  await onPage(async (page) => {
    await page.evaluate(() => globalThis.purelight.openFile({
      name: "huge.plux", size: 2 ** 31, arrayBuffer: () => Promise.reject(new Error("it was read")),
    }));
    assert.match(await page.innerText("#message"), /^huge.plux is not shown: PLX_FILE_TOO_LARGE/);
  });
});

test("a valid lamp that is too large for a shader is described, without a picture", NEEDS, async () => {
  await onPage(async (page) => {
    await open(page, lamp("large"));
    assert.match(await page.innerText("#message"), /is valid, but too large for pictures here/);
    assert.ok(await page.isDisabled("#tab-look"));
    assert.ok((await page.innerText("#inspect")).includes("Octahedron"));
  });
});

test("where there is no WebGL 2 the lamp is described", NEEDS, async () => {
  await onPage(async (page) => {
    assert.match(await page.innerText("#message"), /no WebGL 2/);
    await open(page, lamp("globe"));
    assert.ok((await page.innerText("#inspect")).includes("Glass globe"));
    assert.ok(await page.isDisabled("#tab-look") && await page.isDisabled("#tab-room"));
    await open(page, lamp("verdict_0"));
    const said = await page.locator("#inspect dl p").allInnerTexts();
    const from = said.indexOf("says its maker:");
    assert.ok(from >= 0 && /^light in the room within .*\)/.test(said[from + 1]), said[from + 1]);
    assert.ok(said.slice(from).every((line) => !line.startsWith("%") && !line.startsWith(" ")));
    await open(page, lamp("tier"));
    assert.ok((await page.innerText("#inspect")).includes("huge, of which this version knows"));
  }, { patch: () => {
    HTMLCanvasElement.prototype.getContext = () => null;
  } });
});

test("a graphics card of half floats only draws the lamp", NEEDS, async () => {
  await onPage(async (page) => {
    await open(page, lamp("globe"));
    await drawn(page);
    assert.equal(await page.evaluate(() => globalThis.purelight.gpu.exact), false);
    await shot(page, "half_floats");
    const stops = await page.evaluate(() => globalThis.purelight.views.look.tones.stops);
    assert.ok(Math.abs(stops) > 0.1 && Math.abs(stops) < 20, `${stops}`);
  }, { complains: true, patch: () => {
    const { getExtension } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.getExtension = function patched(name) {
      return name === "EXT_color_buffer_float" ? null : getExtension.call(this, name);
    };
  } });
});

test("no text of a file becomes part of the page, and warnings are told", NEEDS, async () => {
  await onPage(async (page) => {
    await open(page, lamp("markup"));
    assert.equal(await page.innerText("#name"), "<img src=x onerror=alert(1)>&lt;b&gt;");
    await open(page, path("bad", "PLX_MANIFEST_UNKNOWN_FIELD-0.plux"));
    await page.click("#tab-inspect");
    assert.ok((await page.innerText("#inspect .issues")).includes("PLX_MANIFEST_UNKNOWN_FIELD"));
    assert.equal(await page.locator("img").count(), 0);
  });
});

test("the page asks for nothing from any network, and may not", NEEDS, async () => {
  await onPage(async (page, { asked }) => {
    await open(page, lamp("octahedron"));
    await drawn(page);
    assert.deepEqual(asked.filter((url) => !/^(file|blob|data):/.test(url)), []);
    const tried = await page.evaluate(() => fetch("https://example.com/").then(() => "sent",
      (error) => error.name));
    assert.equal(tried, "TypeError");
    assert.deepEqual(asked.filter((url) => url.startsWith("https:")), []);
  }, { complains: true });
});

test("purelight-view --web: the lamp is there when its page is opened from disk", NEEDS, async () => {
  await onPage(async (page) => {
    await answered(page);
    await drawn(page);
    assert.equal(await page.innerText("#name"), "<img src=x onerror=alert(1)>&lt;b&gt;");
    assert.equal(await page.isVisible("#examples"), false);
  }, { address: pathToFileURL(path("good", "own.html")).href });
});

test("an example opens with the keyboard alone, and is turned by it", NEEDS, async () => {
  await onPage(async (page) => {
    await page.locator("#examples button").first().focus();
    await page.keyboard.press("Enter");
    await drawn(page);
    const place = () => page.evaluate(() =>
      globalThis.purelight.subject.view.camera.position.toArray());
    const [x, y, z] = await place();
    await page.focus("#canvas");
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("ArrowUp");
    const turned = await place();
    assert.ok(Math.abs(Math.hypot(...turned) - Math.hypot(x, y, z)) < 1e-6);
    assert.ok(turned[2] > z && Math.atan2(turned[1], turned[0]) < Math.atan2(y, x));
    await page.keyboard.press("+");
    assert.ok(Math.hypot(...await place()) < Math.hypot(x, y, z) / 1.1);
    await page.keyboard.press("Home");
    (await place()).forEach((value, k) => assert.ok(Math.abs(value - [x, y, z][k]) < 1e-6));
    await page.keyboard.press("3");
    assert.equal(await page.getAttribute("#tab-inspect", "aria-selected"), "true");
    await page.focus("#tab-inspect");
    await page.keyboard.press("ArrowRight");
    assert.equal(await page.getAttribute("#tab-look", "aria-selected"), "true");
    await page.keyboard.press("?");
    assert.ok(await page.isVisible("#keys"));
    await page.keyboard.press("Escape");
    assert.equal(await page.isVisible("#keys"), false);
  });
});

test("on a phone nothing is wider than the screen, and every target is large enough", NEEDS, async () => {
  await onPage(async (page) => {
    await shot(page, "phone_empty");
    await open(page, lamp("globe"));
    await drawn(page);
    for (const tab of ["look", "room", "inspect"]) {
      await page.click(`#tab-${tab}`);
      const [wide, screen] = await page.evaluate(() =>
        [document.documentElement.scrollWidth, innerWidth]);
      assert.ok(wide <= screen, `${tab}: ${wide} of ${screen}`);
      const heights = await page.$$eval("button:not([disabled])", (all) =>
        all.filter((button) => button.offsetParent).map((button) => button.offsetHeight));
      assert.ok(Math.min(...heights) >= 36, `${heights}`);
      await shot(page, `phone_${tab}`);
    }
  }, { viewport: { width: 360, height: 740 }, colorScheme: "light" });
});

test("light and dark follow the system, and can be turned; text stays legible", NEEDS, async () => {
  for (const colorScheme of ["light", "dark"]) {
    await onPage(async (page) => {
      await open(page, lamp("lantern"));
      await drawn(page);
      await shot(page, `lantern_${colorScheme}`);
      const [paper, ink, quiet] = await tones(page);
      assert.equal(paper > 0.5, colorScheme === "light");
      assert.ok(contrast(paper, ink) > 7 && contrast(paper, quiet) > 4.5, `${[paper, ink, quiet]}`);
      await page.click("#theme");
      assert.equal((await tones(page))[0] > 0.5, colorScheme === "dark");
    }, { colorScheme });
  }
});

/** Luminances of paper, ink and quiet ink. */
function tones(page) {
  return page.evaluate(() => {
    const luminance = (color) => {
      const linear = color.match(/[\d.]+/g).slice(0, 3).map(Number).map((x) => x / 255)
        .map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
      return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    };
    const body = getComputedStyle(document.body);
    const label = getComputedStyle(document.querySelector("#look output"));
    return [body.backgroundColor, body.color, label.color].map(luminance);
  });
}

function contrast(a, b) {
  return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
}
