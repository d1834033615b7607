// A bundle (plux.md): a stored zip, its manifest, its arrays.

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

import { fromBytes } from "./arrays.mjs";
import { refuse } from "./refusal.mjs";

const LOCAL_HEADER = 0x04034b50;

/** The manifest and the bytes of all members by name, compared with their digests. */
export function readBundle(path) {
  const members = unpack(readFileSync(path));
  const manifest = JSON.parse(members["manifest.json"]);
  if (manifest.format_version.split(".")[0] !== "1") {
    refuse("another major version of the format");
  }
  for (const [name, { sha256 }] of Object.entries(manifest.members)) {
    if (createHash("sha256").update(members[name]).digest("hex") !== sha256) {
      refuse(`${name} is damaged`);
    }
  }
  return { manifest, members };
}

/** Members of a zip without compression, walked from its first byte. */
function unpack(file) {
  const members = {};
  let at = 0;
  while (file.readUInt32LE(at) === LOCAL_HEADER) {
    const size = file.readUInt32LE(at + 18);
    const name = file.subarray(at + 30, at + 30 + file.readUInt16LE(at + 26));
    const start = at + 30 + name.length + file.readUInt16LE(at + 28);
    members[name.toString("latin1")] = file.subarray(start, start + size);
    at = start + size;
  }
  return members;
}

/** Rows of a NumPy file. */
export function readNpy(member) {
  const start = 10 + member.readUInt16LE(8);
  const header = member.toString("latin1", 10, start);
  const [, type, shape] = /'descr': '(.*?)'.*'shape': \((.*?),?\)/.exec(header);
  return fromBytes(type, shape.split(",").map(Number), member.subarray(start));
}
