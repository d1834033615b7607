// What `purelight-inspect` says of a lamp, what a validator warns of, and what this machine computes.

import { element, note } from "./elements.js";
import { checkGolden } from "./golden.js";

const NETWORK = /^(\S+)\s+(?:(\S+ [kM]B)\s+([\d,]+)\s+([\d,]+))?\s*(.*)$/;

/** The panel of a lamp; `ask` gives a network by name for the check on the graphics card. */
export function inspection(lamp, issues, gpu, ask) {
  const { facts, networks } = sorted(lamp.summary.lines);
  return [
    note(lamp.summary.headline),
    definitions(facts),
    element("h2", {}, "Networks"),
    element("div", { class: "scroll" }, networkTable(networks)),
    element("h2", {}, issues.length ? `Warnings (${issues.length})` : "Warnings"),
    issues.length ? issueList(issues) : note("None: the file follows the format in everything."),
    element("h2", {}, "This machine"),
    ...machine(lamp, gpu, ask),
  ];
}

/** Lines by title, those that continue one joined to it; the table of networks by itself. */
function sorted(lines) {
  const facts = [];
  const networks = [];
  let inTable = false;
  for (const [title, text] of lines) {
    inTable = title === "can" || (inTable && ["", "  yes", "  no"].includes(title));
    if (title !== "can" && inTable) {
      networks.push([title.trim(), text]);
    } else if (title && !inTable) {
      facts.push([title, [text]]);
    } else if (!inTable) {
      continued(facts.at(-1)[1], text);
    }
  }
  return { facts, networks };
}

/** Adds a line; what a terminal would indent is the rest of the line before, which folds itself here. */
function continued(texts, text) {
  if (text.startsWith("  ")) {
    texts.push(`${texts.pop()} ${text.trim()}`);
  } else {
    texts.push(text);
  }
}

function definitions(facts) {
  const rows = facts.map(([title, texts]) => element("div", {},
    element("dt", {}, title),
    element("dd", {}, ...texts.map((text) => element("p", {}, text)))));
  return element("dl", { class: "facts" }, ...rows);
}

function networkTable(networks) {
  const head = ["Network", "Size", "Multiply-adds", "Values", "The lamp can"];
  const rows = networks.map(([can, text]) => {
    const [, name, ...cells] = NETWORK.exec(text) ?? [null, text, "", "", "", ""];
    const figures = cells.slice(0, 3).map((cell) => element("td", { class: "figure" }, cell ?? "–"));
    return element("tr", { class: can === "no" ? "absent" : "" }, element("td", {}, name),
      ...figures, element("td", {}, can === "no" ? `not: ${cells[3]}` : cells[3]));
  });
  const heading = element("tr", {}, ...head.map((text, k) =>
    element("th", { class: k > 0 && k < 4 ? "figure" : "" }, text)));
  return element("table", {}, element("thead", {}, heading), element("tbody", {}, ...rows));
}

/** Issues of a report, one line each. */
export function issueList(issues) {
  return element("ul", { class: "issues" }, ...issues.map(({ code, location, message }) =>
    element("li", {}, element("code", {}, code), ` at ${location}: ${message}`)));
}

function machine(lamp, gpu, ask) {
  const rows = element("tbody");
  const add = (name, text) => {
    const cells = [name, text].map((cell) => element("td", {}, cell));
    const row = element("tr", {}, ...cells);
    rows.append(row);
    return (next) => {
      cells[1].textContent = next;
    };
  };
  if (!gpu) {
    return [note("There are no pictures here, as the browser gives the page no WebGL 2.")];
  }
  add("Graphics", gpu.name);
  const button = element("button", { type: "button", id: "check" }, "Check the networks here");
  button.addEventListener("click", async () => {
    button.disabled = true;
    for (const name of lamp.networks) {
      const tell = add(name, "…");
      tell(words(await checked(gpu, name, ask)));
    }
    button.dataset.done = "true";
  });
  const about = "Evaluates every network on its golden vectors with this graphics card; the error is in "
    + "units of what each vector allows.";
  return [element("table", { id: "machine" }, rows), note(about), button];
}

async function checked(gpu, name, ask) {
  try {
    return await checkGolden(gpu, name, await ask(name));
  } catch (error) {
    return { refused: error.message };
  }
}

function words({ refused, missed, count, worst }) {
  if (refused) {
    return `not checked: ${refused}`;
  }
  const error = `largest error ${worst.toPrecision(2)} of what is allowed`;
  return missed ? `${missed} of ${count} vectors are missed, ${error}` : `all ${count} vectors met, ${error}`;
}
