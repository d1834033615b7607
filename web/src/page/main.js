// The page: opens lamps, shows them, and says what is wrong.

import { tooLarge } from "../format/validate.js";
import { checkbox, element, note, slider } from "./elements.js";
import { bytesOf, embedded } from "./embedded.js";
import { Gpu, NoGraphics } from "./gpu.js";
import { inspection } from "./inspection.js";
import { Look } from "./look.js";
import { Progressive } from "./progressive.js";
import { Reader } from "./reader.js";
import { Room } from "./room.js";
import { Tones } from "./tones.js";

const MOST_PIXELS = 2_200_000;
const TABS = ["look", "room", "inspect"];
const LOOKING = { percentile: 0.99, onlyLit: true, withBackground: true };
const LIT = { percentile: 0.9, onlyLit: false, withBackground: false };
const $ = (id) => document.getElementById(id);

class Page {
  constructor() {
    this.reader = new Reader(WORKER_SOURCE);
    this.canvas = $("canvas");
    this.lamp = null;
    this.views = {};
    this.tab = "look";
    this.gpu = this.start();
    this.picture = this.gpu && new Progressive(this.gpu, () => [this.canvas.width, this.canvas.height]);
    this.listen();
    this.openEmbedded();
  }

  /** The graphics card, or nothing and a word why. */
  start() {
    try {
      return new Gpu(this.canvas);
    } catch (error) {
      this.complain(error instanceof NoGraphics ? error.message : `no pictures: ${error.message}`);
      return null;
    }
  }

  // Messages

  complain(text) {
    $("message").textContent = text;
    $("message").hidden = !text;
  }

  // Opening

  async openEmbedded() {
    const { own, examples } = embedded();
    for (const block of examples) {
      const open = () => this.openBlock(block);
      $("examples").append(element("button", { type: "button", onclick: open }, block.dataset.name));
      $("examples").hidden = false;
    }
    if (own) {
      await this.openBlock(own);
    }
  }

  async openBlock(block) {
    await this.open(block.dataset.name, () => bytesOf(block));
  }

  openFile(file) {
    const found = tooLarge(file.size);
    const bytes = () => (found ? Promise.reject(new Error(`${found.code}: ${found.message}`))
      : file.arrayBuffer());
    return this.open(file.name, bytes);
  }

  /** Opens a lamp; what is wrong with it is one line. */
  async open(name, bytes) {
    this.close();
    this.complain("");
    $("progress").textContent = "Reading…";
    $("empty").hidden = true;
    const opening = (this.opening = Symbol("opening"));
    try {
      const answer = await this.reader.open(await bytes(), this.gpu?.widest ?? 4096);
      if (this.opening === opening) {
        this.show(name, answer);
      }
    } catch (error) {
      if (this.opening === opening) {
        this.refuse(name, error.message);
      }
    }
  }

  refuse(name, reason) {
    this.close();
    this.complain(`${shortened(name)} is not shown: ${reason}`);
  }

  show(name, { lamp, issues }) {
    if (!lamp) {
      const [{ code, location, message }] = issues;
      const more = issues.filter(({ severity }) => severity === "error").length - 1;
      const others = more ? ` (and ${more} more)` : "";
      this.refuse(name, `${code} at ${location}: ${message}${others}`);
      return;
    }
    this.lamp = lamp;
    $("name").textContent = lamp.name;
    document.title = `${lamp.name} – PureLight`;
    $("panel").hidden = false;
    $("progress").textContent = "";
    $("inspect").replaceChildren(...inspection(lamp, issues, this.gpu, (network) =>
      this.reader.network(network, this.gpu.widest)));
    const hindrance = lamp.shader.refused;
    if (hindrance) {
      this.complain(`${shortened(lamp.name)} is valid, but too large for pictures here: ${hindrance}`);
    }
    this.canDraw = Boolean(this.gpu) && !hindrance;
    this.choose(this.canDraw ? "look" : "inspect");
  }

  /** Shows nothing any more. */
  close() {
    this.opening = null;
    this.picture?.restart(null);
    Object.values(this.views).forEach((view) => view.dispose());
    this.views = {};
    this.lamp = null;
    this.canDraw = false;
    this.gpu?.renderer.setRenderTarget(null);
    this.gpu?.renderer.clear();
    $("panel").hidden = true;
    delete $("main").dataset.tab;
    $("empty").hidden = false;
    $("name").textContent = $("progress").textContent = "";
    document.title = "PureLight";
    TABS.forEach((tab) => $(tab).replaceChildren());
  }

  // Tabs

  choose(tab) {
    if (!this.lamp) {
      return;
    }
    if (tab !== "inspect" && !this.canDraw) {
      tab = "inspect";
    }
    this.tab = $("main").dataset.tab = tab;
    for (const name of TABS) {
      $(name).hidden = name !== tab;
      $(`tab-${name}`).setAttribute("aria-selected", String(name === tab));
      $(`tab-${name}`).tabIndex = name === tab ? 0 : -1;
      $(`tab-${name}`).disabled = name !== "inspect" && !this.canDraw;
    }
    this.resize();
    if (tab !== "inspect") {
      this.look(tab);
    } else if (this.canDraw && !this.subject) {
      this.look("look");
    }
  }

  get subject() {
    return this.picture?.subject ?? null;
  }

  /** Shows a view, made when it is first asked for. */
  async look(tab) {
    const lamp = this.lamp;
    try {
      const view = this.views[tab] ?? this.make(tab);
      Object.values(this.views).forEach((other) => {
        other.view.active = other === view;
      });
      this.picture.restart(null);
      $("progress").textContent = "Preparing…";
      view.ready ??= view.compile();
      const works = await view.ready;
      if (this.lamp !== lamp || this.views[tab] !== view) {
        return;
      }
      if (!works) {
        throw new Error(`this graphics card does not compile its networks (${
          this.gpu.fault.slice(0, 120)})`);
      }
      this.complain("");
      this.picture.restart(view);
    } catch (error) {
      if (this.lamp === lamp) {
        this.complain(`No picture of ${shortened(lamp.name)}: ${error.message}`);
        $("progress").textContent = "";
      }
    }
  }

  make(tab) {
    const { gpu, lamp, canvas } = this;
    const turned = () => this.picture.subject === view && this.picture.restart();
    const view = tab === "look" ? new Look(gpu, lamp, canvas, turned)
      : new Room(gpu, lamp, canvas, turned);
    const tones = new Tones(lamp, tab === "look" ? LOOKING : LIT, () =>
      view.mean.show(tones.values));
    view.tones = tones;
    view.show = () => {
      view.mean.settle();
      tones.expose(view.mean);
      view.mean.show(tones.values);
    };
    view.onShown = (size, count) => this.tell(view, size, count);
    this.views[tab] = view;
    $(tab).replaceChildren(...tones.controls(), ...(tab === "room" ? this.roomControls(view) : []));
    return view;
  }

  roomControls(room) {
    const height = slider("Height of the lamp", {
      min: 0.3, max: 2.5, step: 0.05, value: room.height,
      show: (x) => `${((x / room.size) * this.lamp.sphere.radius).toPrecision(2)} m`,
      onInput: (x) => {
        room.height = x;
        this.picture.restart();
      },
    });
    const glow = checkbox("Glow of the walls, estimated", true, (on) => {
      room.hasGlow = on;
      this.picture.restart();
    });
    const width = `${room.width.toPrecision(2)} m`;
    const scaled = room.isTrueSize ? `The room is ${width} wide.`
      : `The room is made to the lamp's size: ${width} wide.`;
    return [height.row, glow.row, note(`${scaled} Light straight from the lamp is computed with its `
      + "shadows; what walls throw back is an even glow.")];
  }

  tell(view, [width, height], count) {
    const { samples } = view.ladder.at(-1);
    const isLast = width === this.canvas.width;
    $("progress").textContent = isLast && count >= samples ? "" : isLast
      ? `sample ${count} of ${samples}` : `preview, ${width} × ${height}`;
    this.canvas.dataset.shown = `${width} ${height} ${count}`;
  }

  // What the hand does

  listen() {
    this.listenToFiles();
    $("theme").addEventListener("click", () => turnTheme());
    $("help").addEventListener("click", () => $("keys").showModal());
    TABS.forEach((tab) => $(`tab-${tab}`).addEventListener("click", () => this.choose(tab)));
    document.querySelector("[role=tablist]").addEventListener("keydown", (event) => this.step(event));
    document.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.resize()).observe($("stage"));
    this.canvas.addEventListener("webglcontextlost", () =>
      this.complain("The graphics card has given up this picture; open the lamp again."));
  }

  listenToFiles() {
    const ask = () => $("file").click();
    $("open").addEventListener("click", ask);
    $("choose").addEventListener("click", ask);
    $("file").addEventListener("change", () => {
      const [file] = $("file").files;
      $("file").value = "";
      if (file) {
        this.openFile(file);
      }
    });
    document.addEventListener("dragover", (event) => {
      event.preventDefault();
      $("drop").hidden = false;
    });
    document.addEventListener("dragleave", (event) => {
      $("drop").hidden = event.relatedTarget === null;
    });
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      $("drop").hidden = true;
      const [file] = event.dataTransfer.files;
      if (file) {
        this.openFile(file);
      }
    });
  }

  /** Arrow keys among the tabs. */
  step(event) {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by && this.canDraw) {
      event.preventDefault();
      this.choose(TABS[(TABS.indexOf(this.tab) + by + TABS.length) % TABS.length]);
      $(`tab-${this.tab}`).focus();
    }
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || $("keys").open) {
      return;
    }
    if (document.activeElement === this.canvas && this.subject?.view.press(event.key)) {
      event.preventDefault();
      return;
    }
    const { key } = event;
    const turns = {
      o: () => $("file").click(), t: turnTheme, "?": () => $("keys").showModal(),
      1: () => this.choose("look"), 2: () => this.choose("room"), 3: () => this.choose("inspect"),
      "[": () => this.subject?.tones.step(-0.5), "]": () => this.subject?.tones.step(0.5),
    };
    if (Object.hasOwn(turns, key.toLowerCase()) && !(event.target instanceof HTMLSelectElement)) {
      turns[key.toLowerCase()]();
    }
  }

  /** Fits the picture to the stage. */
  resize() {
    const { clientWidth, clientHeight } = $("stage");
    const ratio = Math.min(devicePixelRatio, 2,
      Math.sqrt(MOST_PIXELS / Math.max(clientWidth * clientHeight, 1)));
    const [width, height] = [clientWidth, clientHeight].map((side) =>
      Math.max(1, Math.round(side * ratio)));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.subject?.mean.show(this.subject.tones.values);
      this.picture?.restart();
    }
  }
}

function shortened(name) {
  const characters = Array.from(String(name));
  return characters.length > 80 ? `${characters.slice(0, 79).join("")}…` : String(name);
}

/** From the system's colours to the others, and back. */
function turnTheme() {
  const root = document.documentElement;
  const isDark = root.dataset.theme ? root.dataset.theme === "dark"
    : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = isDark ? "light" : "dark";
}

globalThis.purelight = new Page();
