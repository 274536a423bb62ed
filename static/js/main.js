/**
 * The workbench: puts the parts together and routes keys, buttons and the desk's messages.
 */
import { api, openDesk } from "./api.js";
import { dropSpecks, fillHoles, grow, keepComponent, shrink, smooth } from "./cleanup.js";
import { PairDesk } from "./desk.js";
import { fit, fitBox } from "./geometry.js";
import { showConflict } from "./conflict.js";
import { fillHelp, wireButtons, wireKeys } from "./controls.js";
import { KEYS, keyOf } from "./keys.js";
import { LAYERS, Pictures } from "./layers.js";
import { MaskView } from "./maskview.js";
import { COUNTS, Panes } from "./panes.js";
import { listen } from "./pointer.js";
import { APPLY } from "./proposals.js";
import { area } from "./raster.js";
import { drawRegions, drawScores } from "./regions.js";
import { Saver } from "./saver.js";
import { State } from "./state.js";
import { View } from "./view.js";

/** @type {Record<string, string>} */
const STATES = {
  todo: "to do",
  in_progress: "in progress",
  submitted: "submitted",
  approved: "approved",
  confirmed_empty: "confirmed empty",
};
const LEAST_SPECK_PX = 20;
/** @type {Record<string, (mask: import("./raster.js").Mask, at: {x: number, y: number}) => Uint8Array>} */
const CLEANUPS = {
  "fill-holes": fillHoles,
  "drop-specks": (mask) => dropSpecks(mask, LEAST_SPECK_PX),
  "keep-component": keepComponent,
  grow,
  shrink,
  smooth,
};
const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const state = new State();
let person = "";

const maskView = new MaskView();
const saver = new Saver({ put: api.putMask, storage: localStorage, status: showSave,
  saved: (id, revision) => { desk.saved(id, revision); socket.send({ type: "changed" }); } });
const desk = new PairDesk(state, saver, {
  mask: (box) => { maskView.paint(desk.mask, box); countSoon(); view.ask(); },
  pair: showPair,
  notice,
  changed: () => socket.send({ type: "changed" }),
  pixels: () => pictures.pixels(url("live")),
});
const pictures = new Pictures(() => view.ask());
const panes = new Panes($("panes"), choosePane, () => { if (state.fitted) fitAll(); view.ask(); });
const url = (/** @type {string} */ layer) => state.pair ? api.layerUrl(state.pair, layer) : "";
const view = new View(state, panes, maskView, pictures, url);
const socket = openDesk(new URLSearchParams(location.search).get("client") ?? "", receive);

/** @param {any} message from the server's side of the desk */
async function receive(message) {
  if (message.type === "ready") {
    const first = !person;
    person = `${message.store}.${message.annotator}`;
    if (first) start();
    const linked = Number(new URLSearchParams(location.search).get("pair"));
    // A desk that knows nothing yet follows the frame, after a restart say; else the frame the desk.
    const own = state.pair?.id ?? (linked || state.lastPair(sessionStorage, message.store));
    const wanted = message.fresh && own ? own : message.pair;
    if (!wanted) notice("There are no pairs yet. Import some: reviewer import DIR", true);
    else if (wanted !== state.pair?.id) await open(wanted, message.run);
    else socket.send({ type: "showing", pair: wanted });
    await fillRuns();
  } else if (message.type === "error") {
    notice(message.detail, true);
  } else if (message.type === "open" && message.pair) {
    if (message.pair !== desk.wanted || message.run !== state.run) await open(message.pair, message.run);
  } else if (message.type === "ahead") {
    for (const id of message.pairs) loadAhead(id);
  } else if (message.type === "end") {
    notice(message.by > 0 ? "This is the last pair of the queue." : "This is the first pair of the queue.");
  }
}

function start() {
  state.restore(localStorage, person);
  panes.build(state.layers);
  $("pane-count").replaceChildren(...COUNTS.map((n) => new Option(String(n), String(n))));
  $("pane-count").value = String(state.layers.length);
  $("radius").value = String(state.radius);
  $("opacity").value = String(state.opacity);
  showSettings();
  socket.send({ type: "theme", dark: state.dark });
  if (window.parent !== window && !sessionStorage.getItem("reviewer.sized")) {
    sessionStorage.setItem("reviewer.sized", "yes");
    socket.send({ type: "window", width: window.parent.innerWidth });
  }
  if (saver.begin(person)) notice("Work from before that was not saved yet is sent now.");
  window.focus();
}

/** @param {number} id @param {string | null} run */
async function open(id, run) {
  desk.cancel();
  try {
    if (await desk.open(id, run)) socket.send({ type: "showing", pair: id });
  } catch (error) {
    notice(error instanceof Error ? error.message : String(error), true);
  }
}

/** @param {boolean} fresh another pair than before */
function showPair(fresh) {
  const { pair } = state;
  if (!pair) return;
  panes.aspect = pair.width / pair.height;
  if (fresh) {
    panes.arrange();
    const place = state.place(sessionStorage, pair.id);
    state.fitted = place?.fitted ?? true;
    state.view = place && !place.fitted ? place.view : fit(pair, panes.size());
    state.region = place?.region ?? -1;
  }
  $("title").textContent = `${pair.split}/${pair.name}`;
  $("state").textContent = STATES[pair.state];
  $("state").dataset.state = pair.state;
  $("run").value = state.run ?? "";
  $("region-count").textContent = String(pair.regions.length);
  for (const { element } of panes.items) element.classList.toggle("locked", state.locked);
  for (const [action, off] of Object.entries({ submit: state.locked, empty: state.locked,
    approve: pair.state === "approved", reopen: !state.locked, take: state.locked })) {
    button(action).disabled = off;
  }
  drawScores($("scores"), pair.scores);
  showRegions();
  showFacts();
  view.ask();
}

function showRegions() {
  drawRegions($("regions"), state.pair?.regions ?? [], state.region, {
    select: (index) => { state.region = index; goToRegion(); },
    verdict: (index, verdict) => { state.region = index; attempt(desk.verdict(verdict)); },
  });
  rememberPlaceSoon();
}

function showFacts() {
  const { pair } = state;
  if (!pair) return;
  const facts = [`${pair.width}×${pair.height}`, `mask ${state.area} px`, `revision ${state.revision}`];
  if (pair.valid_fraction !== null) facts.push(`warp ${Math.round(pair.valid_fraction * 100)} % valid`);
  $("facts").textContent = facts.join("   ·   ");
  const at = state.cursor;
  const where = at ? `x ${Math.floor(at.x)}  y ${Math.floor(at.y)}  ` : "";
  $("where").textContent = `${where}${Math.round(state.view.scale * 100)} %`;
}

/** @param {string} status @param {string} [detail] @param {number} [id] the pair it is about */
function showSave(status, detail = "", id = 0) {
  const waits = [...saver.parked.values()][0];
  const shown = status === "saved" && waits ? waits : status;
  $("save").dataset.status = shown;
  $("save").textContent = detail && status !== "conflict" ? `${shown}: ${detail}` : shown;
  if (status === "conflict") {
    const name = state.pair?.id === id ? `${state.pair.split}/${state.pair.name}` : `Pair ${id}`;
    attempt(showConflict(id, name, saver, (which) => { if (state.pair?.id === which) open(which, state.run); }));
  }
  if (status === "locked") notice(`${detail} Your work is kept and sent when you reopen it (O).`, true);
  if (status === "refused") notice(`Not saved, but kept in this browser: ${detail}`, true);
}

let counting = 0;
/** Count the mask's pixels, once the stroke pauses. */
function countSoon() {
  clearTimeout(counting);
  counting = window.setTimeout(() => { state.area = area(desk.mask); showFacts(); }, 60);
}

let remembering = 0;
function rememberPlaceSoon() {
  clearTimeout(remembering);
  remembering = window.setTimeout(() => state.rememberPlace(sessionStorage, person), 200);
}

function fitAll() {
  if (!state.pair) return;
  state.view = fit(state.pair, panes.size());
  state.fitted = true;
  rememberPlaceSoon();
}

function showSettings() {
  document.documentElement.dataset.theme = state.dark ? "dark" : "light";
  $("radius-value").textContent = String(state.radius);
  $("tolerance").value = String(state.tolerance);
  $("tolerance-value").textContent = String(state.tolerance);
  $("tolerance-field").hidden = state.tool !== "fill";
  $("radius").parentElement.hidden = !["brush", "eraser"].includes(state.tool);
  for (const tool of document.querySelectorAll("[data-tool]")) {
    tool.setAttribute("aria-pressed", String(/** @type {HTMLElement} */ (tool).dataset.tool === state.tool));
  }
  if (person) state.remember(localStorage, person);
  view.ask();
}

async function fillRuns() {
  const runs = await api.runs();
  $("run").replaceChildren(...runs.map((/** @type {any} */ run) => new Option(run.name, run.name)));
  $("run").value = state.run ?? "";
}

/** @param {number} id decode the pictures of a pair before it is asked for */
async function loadAhead(id) {
  const pair = await api.pair(id, state.run);
  for (const name of new Set(state.layers.flatMap((l) => [LAYERS[l].base, LAYERS[l].overlay]))) {
    if (name && pair.layers.includes(name)) pictures.get(api.layerUrl(pair, name));
  }
}

/** @param {number} index @param {string} layer */
function choosePane(index, layer) {
  state.layers[index] = layer;
  showSettings();
}

function goToRegion() {
  const box = state.pair?.regions[state.region]?.box_xyxy;
  if (box) {
    state.view = fitBox(box, panes.size());
    state.fitted = false;
  }
  showRegions();
  view.ask();
}

/** @param {number} by */
function walkRegions(by) {
  const count = state.pair?.regions.length ?? 0;
  if (!count) return;
  state.region = (state.region + by + (state.region < 0 && by < 0 ? 1 : 0) + count) % count;
  goToRegion();
}

async function takePrediction() {
  const { pair } = state;
  if (!pair || state.locked) return;
  if (!pair.layers.includes("prediction")) return notice("This run has no prediction for the pair yet.", true);
  const reply = await fetch(url("prediction"), { credentials: "same-origin" });
  if (!reply.ok) throw new Error((await reply.json()).detail);
  const bitmap = await createImageBitmap(await reply.blob(), { premultiplyAlpha: "none" });
  const context = new OffscreenCanvas(pair.width, pair.height).getContext("2d");
  context?.drawImage(bitmap, 0, 0);
  const pixels = context?.getImageData(0, 0, pair.width, pair.height).data ?? [];
  if (state.pair?.id !== pair.id || state.locked || desk.active) return;
  desk.replace(Uint8Array.from({ length: pair.width * pair.height }, (_, i) => (pixels[4 * i + 3] ? 1 : 0)), "take prediction");
}

/** @param {number} radius */
function setRadius(radius) {
  state.radius = Math.min(60, Math.max(1, Math.round(radius * 2) / 2));
  $("radius").value = String(state.radius);
  showSettings();
}

/** @param {number} opacity */
function setOpacity(opacity) {
  state.opacity = Math.min(1, Math.max(0, opacity));
  $("opacity").value = String(state.opacity);
  showSettings();
}

/** @param {string} tool */
function chooseTool(tool) {
  desk.cancel();
  state.tool = tool;
  showSettings();
}

/** @param {string} name */
function cleanUp(name) {
  const mask = { ...desk.mask };
  if (!state.pair || state.locked || desk.active) return;
  if (name === "keep-component" && !state.cursor) return notice("Point at the part to keep.");
  desk.replace(CLEANUPS[name](mask, state.cursor ?? { x: 0, y: 0 }), name);
}

/** @type {Record<string, (down: boolean) => unknown>} */
const ACTIONS = {
  ...Object.fromEntries(Object.keys(desk.tools).map((tool) => [tool, () => chooseTool(tool)])),
  ...Object.fromEntries(Object.keys(CLEANUPS).map((name) => [name, () => cleanUp(name)])),
  smaller: () => setRadius(state.radius / 1.2 - 0.25),
  larger: () => setRadius(state.radius * 1.2 + 0.25),
  undo: () => desk.step("undo"),
  redo: () => desk.step("redo"),
  cancel: () => desk.cancel(),
  take: takePrediction,
  ...Object.fromEntries(Object.keys(APPLY).map((way) => [way, () => desk.applyRegion(way)])),
  swipe: (down) => { state.swiping = down; view.ask(); },
  outline: () => { state.outline = !state.outline; showSettings(); },
  hide: (down) => { state.hidden = down; view.ask(); },
  blink: (down) => { state.blinking = down; view.ask(); },
  fit: () => { fitAll(); view.ask(); },
  goto: goToRegion,
  fainter: () => setOpacity(state.opacity - 0.1),
  stronger: () => setOpacity(state.opacity + 0.1),
  "next-region": () => walkRegions(1),
  "previous-region": () => walkRegions(-1),
  agree: () => desk.verdict("agree"),
  adopt: () => desk.verdict("adopt"),
  keep: () => desk.verdict("keep"),
  reject: () => desk.verdict("reject"),
  submit: async () => {
    if (desk.active?.name === "polygon") return desk.end();
    if (!state.locked && await desk.setState("submitted")) step(1);
  },
  approve: () => desk.setState("approved"),
  empty: () => { if (!state.locked) return desk.setState("confirmed_empty"); },
  reopen: () => desk.setState("in_progress"),
  next: () => step(1),
  previous: () => step(-1),
  theme: () => { state.dark = !state.dark; showSettings(); socket.send({ type: "theme", dark: state.dark }); },
  help: () => { $("help").open ? $("help").close() : $("help").showModal(); },
};

/** @param {1 | -1} by */
function step(by) {
  if (!socket.send({ type: "step", by })) notice("The server cannot be reached just now.", true);
}

/** Do an action; what goes wrong is told. @param {unknown} work */
async function attempt(work) {
  try {
    await work;
  } catch (error) {
    notice(error instanceof Error ? error.message : String(error), true);
  }
}

/** Do an action that a key or a button asks for. @param {string} action @param {boolean} [down] */
function act(action, down = true) {
  desk.activity.note();
  attempt(ACTIONS[action](down));
}

/** @param {string} action @returns {HTMLButtonElement} */
function button(action) {
  return /** @type {HTMLButtonElement} */ (document.querySelector(`button[data-action="${action}"]`));
}

let noticeTimer = 0;
/** @param {string} text @param {boolean} [bad] */
function notice(text, bad = false) {
  $("notice").textContent = text;
  $("notice").dataset.kind = bad ? "bad" : "";
  $("notice").hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = window.setTimeout(() => { $("notice").hidden = true; }, bad ? 8000 : 3500);
}

$("radius").oninput = () => setRadius(Number($("radius").value));
$("tolerance").oninput = () => { state.tolerance = Number($("tolerance").value); showSettings(); };
$("cleanup").append(...Object.keys(CLEANUPS).map((name) => {
  const entry = KEYS.find((candidate) => candidate.action === name);
  return new Option(`${entry?.title}  (${keyOf(name)})`, name);
}));
$("cleanup").onchange = () => { const name = $("cleanup").value; $("cleanup").value = ""; $("cleanup").blur(); cleanUp(name); };
$("opacity").oninput = () => setOpacity(Number($("opacity").value));
$("pane-count").onchange = () => {
  const count = Number($("pane-count").value);
  const more = Object.keys(LAYERS).filter((layer) => !state.layers.includes(layer));
  state.layers = [...state.layers, ...more].slice(0, count);
  panes.build(state.layers);
  fitAll();
  showSettings();
};
$("run").onchange = () => { socket.send({ type: "run", run: $("run").value }); $("run").blur(); };
listen($("panes"), state, {
  size: () => panes.size(),
  begin: (at, keys) => desk.begin(at, keys),
  hover: (at) => { if (desk.active?.name === "polygon") desk.move(at); },
  move: (at) => desk.move(at),
  end: () => desk.release(),
  cancel: () => desk.cancel(),
  resize: (factor) => setRadius(state.radius * factor),
  changed: () => { showFacts(); view.ask(); },
  zoomed: () => { state.fitted = false; rememberPlaceSoon(); },
});
window.addEventListener("blur", () => { state.blinking = state.swiping = state.hidden = false; view.ask(); });
window.addEventListener("online", () => saver.retry());
window.addEventListener("beforeunload", (event) => { if (!saver.idle) event.preventDefault(); });
wireButtons(act);
wireKeys(act, () => $("conflict").open || $("help").open);
fillHelp($("help-keys"));
showSave("saved");
