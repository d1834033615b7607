// A headless Chromium with a software WebGL, for tests: no network, and what it complains of.

import { chromium } from "playwright-core";

export const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
const FLAGS = [
  "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
  "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--disable-gpu-watchdog",
];

const PATIENCE = 240_000; // Milliseconds; the machine may be busy.

export function launch() {
  return chromium.launch({ executablePath: CHROMIUM, headless: true, args: FLAGS });
}

/** A tab with the page from disk; `complaints` are what it logs as errors, `asked` what it fetches. */
export async function openPage(browser, address, { patch, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1100, height: 760 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  const complaints = [];
  const asked = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) {
      complaints.push(message.text());
    }
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => asked.push(request.url()));
  if (patch) {
    await page.addInitScript(patch);
  }
  await page.goto(address);
  return { page, context, complaints, asked };
}

/** Waits for a picture of at least so many samples in the canvas's full size. */
export async function drawn(page, samples = 1, timeout = PATIENCE) {
  await page.waitForFunction((least) => {
    const canvas = document.getElementById("canvas");
    const [width, , count] = (canvas.dataset.shown ?? "").split(" ").map(Number);
    return width === canvas.width && count >= least;
  }, samples, { timeout });
}
