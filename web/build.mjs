// One file that opens from disk: scripts, style, worker and example lamps, and a policy that lets
// the page run nothing else and reach no network.

import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname } from "node:path";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const HERE = new URL(".", import.meta.url);
const read = (path) => readFileSync(new URL(path, HERE), "utf8");
const LIBRARIES = ["three", "three-mesh-bvh", "@noble/hashes"];
const OPTIONS = {
  bundle: true, minify: true, write: false, format: "iife", target: "es2023", charset: "utf8",
  legalComments: "none", absWorkingDir: new URL(".", HERE).pathname, logLevel: "warning",
};

async function bundled(entry, define = {}) {
  const result = await build({ ...OPTIONS, entryPoints: [entry], define });
  return result.outputFiles[0].text.replaceAll("</script", "<\\/script").trim();
}

function hashOf(text) {
  return `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
}

function policy(script, style) {
  return [
    "default-src 'none'", `script-src ${hashOf(script)}`, `style-src ${hashOf(style)}`,
    "worker-src blob:", "img-src 'none'", "connect-src 'none'", "base-uri 'none'",
    "form-action 'none'",
  ].join("; ");
}

/** Licences of what is in the page. */
function licenses() {
  const texts = LIBRARIES.map((name) => {
    const { version, license } = JSON.parse(read(`node_modules/${name}/package.json`));
    return `${name} ${version} (${license})\n\n${read(`node_modules/${name}/LICENSE`).trim()}`;
  });
  const all = ["PureLight, Apache License 2.0. It holds:", ...texts].join("\n\n");
  return all.replaceAll("--", "- -");
}

/** Example lamps as data in the page. */
function lamps() {
  const folder = new URL("examples/", HERE);
  const files = readdirSync(folder).filter((name) => name.endsWith(".plux")).sort();
  return files.map((file) => {
    const name = file.replace(/^\d+_|\.plux$/g, "").replaceAll("_", " ");
    const packed = gzipSync(readFileSync(new URL(file, folder)), { level: 9 });
    packed[9] = 255; // Of the system it was packed on: none.
    const type = 'type="application/vnd.purelight"';
    return `<script ${type} data-example data-name="${name}">${packed.toString("base64")}</script>`;
  }).join("\n");
}

const worker = await bundled("src/worker.js");
const script = await bundled("src/page/main.js", { WORKER_SOURCE: JSON.stringify(worker) });
const style = (await build({ ...OPTIONS, entryPoints: ["src/page/style.css"] })).outputFiles[0].text
  .trim();
const parts = {
  POLICY: policy(script, style), LICENSES: licenses(), STYLE: style, LAMPS: lamps(), SCRIPT: script,
};
const page = read("src/page/index.html").replace(/%([A-Z]+)%/g, (_, name) => parts[name]);
const output = process.argv[2] ?? new URL("dist/index.html", HERE).pathname;
mkdirSync(dirname(output), { recursive: true });
writeFileSync(output, page);
console.log(`${output}: ${(Buffer.byteLength(page) / 1e3).toFixed(0)} kB`);
