// Vetting of a bundle's USD layer (usd.md, U1 to U7): it may not compose, nor name other files.

import { fail, issue } from "./issues.js";
import { LIMITS, USD } from "./tables.js";
import { readLayer } from "./usd_text.js";

/** Checks that the first member is the only layer, and what it says. */
export function* layerIssues(read, names, limits = LIMITS) {
  const [first] = names;
  const layers = [...names].filter((name) => isLayer(name));
  const right = layers.length === 1 && layers[0] === first && first.endsWith(".usda");
  if (!right || first.includes("/")) {
    fail("PLX_USD_NOT_FIRST", first);
  }
  const layer = readLayer(read(first), first, limits);
  const roots = new Set(layer.children.map((prim) => prim.name));
  if (!texts(layer, "defaultPrim").some((name) => roots.has(name))) {
    yield issue("PLX_USD_NO_DEFAULT_PRIM", first);
  }
  const prims = [...tree(layer)];
  if (!prims.some((prim) => texts(prim, "apiSchemas").includes(USD.schema))) {
    yield issue("PLX_USD_SCHEMA_MISSING", first);
  }
  if (!isInMetres(layer)) {
    yield issue("PLX_USD_METERS_PER_UNIT", first);
  }
  for (const prim of prims) {
    for (const path of paths([...prim.metadata, ...prim.properties])) {
      yield* pathIssues(path, first, new Set(names));
    }
  }
}

function* tree(prim) {
  yield prim;
  for (const child of prim.children) {
    yield* tree(child);
  }
}

function* paths(properties) {
  for (const { value, metadata } of properties) {
    yield* paths(metadata);
    if (value) {
      yield* value.kind === "path" ? value.items : [];
      yield* paths(value.entries);
    }
  }
}

function stated(prim, name) {
  return prim.metadata.filter((found) => found.name === name).map(({ value }) => value);
}

/** The quotations that a prim's metadata holds under a name. */
function texts(prim, name) {
  return stated(prim, name).flatMap((value) => (value?.kind === "text" ? value.items : []));
}

function isInMetres(layer) {
  const [metres, axes] = [stated(layer, "metersPerUnit"), stated(layer, "upAxis")];
  const items = metres.length === 1 ? (metres[0]?.items ?? []) : [];
  const up = axes.length === 1 && axes[0]?.kind === "text" && axes[0].items.length === 1
    && axes[0].items[0] === "Z";
  return items.length === 1 && /^1(\.0*)?$/.test(items[0]) && up;
}

function isLayer(name) {
  return USD.endings.some((end) => name.toLowerCase().endsWith(end));
}

function* pathIssues(path, name, members) {
  const target = normalized(path);
  const shown = { path: Array.from(path).slice(0, 200).join("") };
  if (!path.startsWith("./") || path.split("/").includes("..") || /[\\:[\]]/.test(path)) {
    yield issue("PLX_USD_PATH", name, shown);
  } else if (target === name) {
    return; // The asset's own identifier.
  } else if (isLayer(target)) {
    yield issue("PLX_USD_REFERENCES_LAYER", name, shown);
  } else if (!members.has(target)) {
    yield issue("PLX_USD_PATH_DANGLING", name, shown);
  }
}

/** A path without empty parts and dots; the layer lies at the bundle's root. */
function normalized(path) {
  const parts = path.split("/").filter((part) => part !== "" && part !== ".");
  return parts.join("/") || ".";
}
