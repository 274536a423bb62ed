/**
 * The workbench: puts the parts together and passes on what the desk's socket and the person say.
 */
import { actionsOf, CLEANUPS } from "./actions.js";
import { api, openDesk } from "./api.js";
import { $, notice, showFacts, showHeader, showSettings, waiting } from "./chrome.js";
import { fillHelp, titleButtons, wireButtons, wireKeys } from "./controls.js";
import { PairDesk } from "./desk.js";
import { clamp, fit, fitBox } from "./geometry.js";
import { Journal } from "./journal.js";
import { KEYS, Keymap } from "./keys.js";
import { LAYERS, pictureOf, Pictures } from "./layers.js";
import { MaskView } from "./maskview.js";
import { Modes } from "./modes.js";
import { showConflict } from "./panels/conflict.js";
import { COUNTS, Panes, shareOut } from "./panes.js";
import { listen } from "./pointer.js";
import { area } from "./raster.js";
import { Saver } from "./saver.js";
import { Side } from "./side.js";
import { Standing } from "./standing.js";
import { State } from "./state.js";
import { takePrediction } from "./taking.js";
import { Surroundings } from "./surroundings.js";
import { View } from "./view.js";

// Colours that colour-blind people can tell apart (after Okabe and Ito).
const masks = {
  mask: new MaskView([0, 214, 143], { alone: true }),
  ignore: new MaskView([214, 126, 255], { alone: true, hatched: true }),
  candidate: new MaskView([86, 180, 233]),
  proposal: new MaskView([255, 255, 255]),
};
const PAUSE_MS = 700;
const SHOWN_MS = 150;
const state = new State();
const keymap = new Keymap();
const standing = new Standing();
const around = new Surroundings(sessionStorage);
/** @type {Map<number, string>} of the pairs that were opened here */
const titles = new Map();
let person = "";
/** Of the server that gave this page. */
let version = "";

const saver = new Saver({ put: api.putMask, status: showSave,
  saved: (id, revision) => { desk.saved(id, revision); refreshSoon(); } });
const desk = new PairDesk(state, saver, {
  mask: (layer, box) => { masks[layer].paint(desk.masks[layer], box); countSoon(); view.ask(); },
  pair: showPair,
  candidate: showCandidate,
  sketch: () => view.ask(),
  saved: () => { showHeader(state); view.ask(); },
  judged: () => attempt(side.load(true)),
  notice,
  waiting,
  shown: (action) => keymap.shown(action).toUpperCase(),
  why: (region) => side.reasons.of(region),
  given: (region) => side.reasons.given(region),
  changed: () => socket.send({ type: "changed" }),
  pixels: () => pictures.pixels(url("live")),
});
const side = new Side(state, desk, masks, { selected: showSelected, attempt, notice,
  shown: (action) => keymap.shown(action), redraw: () => view.ask() });
const pictures = new Pictures(() => view.ask());
const panes = new Panes($("panes"), choosePane, () => {
  if (state.fitted) fitAll();
  else if (state.pair) state.view = clamp(state.view, state.pair, panes.size());
  view.ask();
});
const url = (/** @type {string} */ layer) => state.pair ? api.layerUrl(state.pair, layer, !state.second) : "";
const view = new View(state, panes, masks, pictures, url, () => showFacts(state));
const modes = new Modes(state, desk, side, { open, settings, notice, shown: (action) => keymap.shown(action),
  reveal: () => state.reveal(localStorage, person), attempt, redraw: () => showPair(false),
  next: (by) => { clearTimeout(showing); return socket.send({ type: "step", by }); } });
const actions = actionsOf({ state, desk, side, modes, pressAt, settings, redraw: () => view.ask(), fitAll,
  fitProposal: () => showSelected(true), notice,
  takePrediction: () => takePrediction(desk, url("prediction")),
  theme: () => { state.dark = !state.dark; settings(); socket.send({ type: "theme", dark: state.dark }); },
  help: () => { $("help").open ? $("help").close() : $("help").showModal(); } });
const socket = openDesk(() => around.joining(state), {
  message: receive,
  here: () => { standing.joined(); saver.retry(); },
  away: () => { around.left(); standing.parted(api.me().then(() => 200, (error) => error.status ?? 0)); },
});
window.addEventListener("client", () => socket.again());
window.addEventListener("pagehide", () => around.left());

/** @param {import("./wire.js").ToFrame} message from the server's side of the desk */
async function receive(message) {
  if (message.type === "ready") {
    around.joined();
    const first = !person;
    version ||= message.version;
    if (message.version !== version) notice("The server has been updated. Load the page again to work with what is new.", true);
    person = `${message.store}.${message.annotator}`;
    state.annotator = message.annotator;
    if (first) await start();
    const linked = first && message.fresh && Number(new URLSearchParams(location.search).get("pair"));
    const wanted = linked || message.pair;
    if (!wanted) notice("There are no pairs yet. Import some: reviewer import DIR", true);
    else if (wanted !== state.pair?.id || message.run !== state.run) await open(wanted, message.run);
    else showingSoon();
    await fillRuns();
    if (state.mode === "audit" && first) await modes.change("audit");
  } else if (message.type === "error") {
    notice(message.detail, true);
  } else if (message.type === "open" && message.pair) {
    if (message.pair !== desk.wanted || message.run !== state.run) await open(message.pair, message.run);
  } else if (message.type === "queue") {
    around.filtered(message);
  } else if (message.type === "ahead") {
    for (const id of message.pairs) loadAhead(id);
  } else if (message.type === "end") {
    notice(message.by > 0 ? "This is the last pair of the queue." : "This is the first pair of the queue.");
  }
}

async function start() {
  state.restore(localStorage, person);
  keymap.changes = state.keys;
  panes.build(state.layers);
  $("pane-count").replaceChildren(...COUNTS.map((n) => new Option(String(n), String(n))));
  $("pane-count").value = String(state.layers.length);
  side.offer([]);
  attempt(side.reasons.load());
  showKeys();
  settings();
  socket.send({ type: "theme", dark: state.dark });
  api.me().then(({ clicks }) => { $("segmenter").textContent = `clicks: ${clicks}`; });
  try {
    const left = await saver.begin(await Journal.open(person));
    if (left) notice("Work from before that was not saved yet is sent now.");
  } catch (error) {
    notice(`This browser keeps no unsent work, so do not close it while offline: ${error}`, true);
  }
  if (saver.idle) standing.saving("saved", "");
  window.focus();
}

/** @param {number} id @param {string | null} run */
async function open(id, run) {
  try {
    if (await desk.open(id, run)) showingSoon();
  } catch (error) {
    notice(error instanceof Error ? error.message : String(error), true);
  }
}

let showing = 0;
/** Tell the desk what is shown, once it is: queue, map and the work ahead wait for it. */
function showingSoon() {
  clearTimeout(showing);
  showing = window.setTimeout(() => {
    // Another one may be on its way: then this one is not what the desk should think of.
    if (state.pair?.id === desk.wanted) socket.send({ type: "showing", pair: desk.wanted });
  }, SHOWN_MS);
}

/** @param {boolean} fresh another pair than before */
function showPair(fresh) {
  const { pair } = state;
  if (!pair) return;
  titles.set(pair.id, `${pair.split}/${pair.name}`);
  panes.aspect = pair.width / pair.height;
  if (fresh) {
    panes.arrange();
    side.reset();
    const place = state.place(sessionStorage, pair.id);
    state.fitted = place?.fitted ?? true;
    state.view = place && !place.fitted ? clamp(place.view, pair, panes.size()) : fit(pair, panes.size());
    state.selected = place?.selected ?? null;
  }
  rememberPlaceSoon();
  showHeader(state);
  for (const { element } of panes.items) element.classList.toggle("locked", state.locked);
  attempt(side.load());
  view.ask();
}

/** @param {boolean} go show the place of the selected proposal */
function showSelected(go) {
  const box = state.proposal?.box_xyxy;
  if (go && box && box[2] > box[0]) look(fitBox(box, panes.size()));
  rememberPlaceSoon();
  view.ask();
}

function showCandidate() {
  document.body.toggleAttribute("data-asking", desk.pointing.open && desk.pointing.request !== null);
  const shown = desk.pointing.mask ?? (desk.pointing.open ? null : desk.pointing.preview);
  if (shown) masks.candidate.show(shown);
  else if (side.looked === null) masks.candidate.clear();
  view.now();
}

/** @param {string} status @param {string} [detail] @param {number} [id] the pair it is about */
function showSave(status, detail = "", id = 0) {
  const waits = [...saver.parked][0];
  const [about, told] = status === "saved" && waits ? waits : [id, status];
  const name = titles.get(about) ?? `Pair ${about}`;
  standing.saving(told, detail, saver.parked.has(about) ? name : "");
  if (status === "conflict") {
    const picture = state.pair?.id === id ? pictures.get(url("live")).bitmap : null;
    attempt(showConflict(id, name, saver, picture, (which) => { if (state.pair?.id === which) open(which, state.run); }));
  }
  if (status === "locked") notice(`${detail} Your work is kept and sent when you reopen it (${keymap.shown("reopen")}).`, true);
  if (status === "refused") notice(`Not saved, but kept in this browser: ${detail}`, true);
}

let counting = 0;
/** Count the layers' pixels, once the stroke pauses. */
function countSoon() {
  clearTimeout(counting);
  counting = window.setTimeout(() => {
    if (state.drawing) return countSoon();
    state.area = { mask: area(desk.masks.mask), ignore: area(desk.masks.ignore) };
    if (!state.area.ignore) masks.ignore.clear();
    view.ask();
  }, 60);
}

let refreshing = 0;
/** Bring scores, queue and map up to date, once the person pauses: that costs a stroke its fluency. */
function refreshSoon() {
  clearTimeout(refreshing);
  refreshing = window.setTimeout(() => {
    if (state.drawing || !saver.idle) return refreshSoon();
    socket.send({ type: "changed" });
    attempt(desk.refresh());
  }, PAUSE_MS);
}

let remembering = 0;
function rememberPlaceSoon() {
  clearTimeout(remembering);
  remembering = window.setTimeout(() => state.rememberPlace(sessionStorage, person), 200);
}

/** Look elsewhere, but never past the picture. @param {import("./geometry.js").View} there */
function look(there) {
  if (!state.pair) return;
  state.view = clamp(there, state.pair, panes.size());
  state.fitted = false;
  rememberPlaceSoon();
}

function fitAll() {
  if (!state.pair) return;
  state.view = fit(state.pair, panes.size());
  state.fitted = true;
  rememberPlaceSoon();
}

function settings() {
  showSettings(state);
  if (person) state.remember(localStorage, person);
  view.ask();
}

/** Keys were given, or changed. */
function showKeys() {
  state.keys = keymap.changes;
  titleButtons(keymap);
  fillHelp($("help-keys"), keymap, () => { showKeys(); settings(); });
  $("cleanup").replaceChildren(new Option("Clean up…", ""), ...Object.keys(CLEANUPS).map((name) => {
    const entry = KEYS.find((candidate) => candidate.action === name);
    return new Option(`${entry?.title}  (${keymap.shown(name)})`, name);
  }));
}

async function fillRuns() {
  const runs = await api.runs();
  $("run").replaceChildren(...runs.map((run) => new Option(run.name, run.name)));
  $("run").value = state.run ?? "";
  side.offer(runs);
}

/** @param {number} id decode the pictures of a pair before it is asked for */
async function loadAhead(id) {
  const pair = await api.pair(id, state.run);
  for (const name of new Set(state.layers.flatMap((l) => [LAYERS[l].base, LAYERS[l].overlay]))) {
    if (name && pair.layers.includes(name)) pictures.get(api.layerUrl(pair, name, !state.second));
  }
}

/** @param {number} index @param {string} layer */
function choosePane(index, layer) {
  state.showLayer(index, layer);
  settings();
}

/** Use the tool where the cursor is, from the keyboard. @param {boolean} other take away */
function pressAt(other) {
  if (!state.cursor) return notice("Move the cursor first: Shift and the arrow keys.");
  desk.begin(state.cursor, { shift: false, alt: other, right: false }, "live");
  attempt(desk.release());
  view.ask();
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
  attempt(actions[action](down));
}

/** @param {number} index which pane */
const pictureIn = (index) => pictureOf(LAYERS[state.shownLayers[index]]);

for (const name of /** @type {const} */ (["radius", "tolerance", "opacity", "brightness", "contrast"])) {
  $(name).oninput = () => { state[name] = Number($(name).value); settings(); };
}
$("cleanup").onchange = () => { const name = $("cleanup").value; $("cleanup").value = ""; $("cleanup").blur(); act(name); };
$("mode").onchange = () => { $("mode").blur(); attempt(modes.change($("mode").value)); };
for (const name of /** @type {const} */ (["walkOrder", "walkOpinion"])) {
  $(name).onchange = () => { state[name] = $(name).value; $(name).blur(); attempt(modes.change("audit")); };
}
$("source").onchange = () => { state.source = $("source").value; $("source").blur(); settings(); attempt(side.load()); };
for (const tab of document.querySelectorAll("[data-side]")) {
  /** @type {HTMLElement} */ (tab).onclick = () => {
    state.side = /** @type {HTMLElement} */ (tab).dataset.side ?? "proposals";
    /** @type {HTMLElement} */ (tab).blur();
    settings();
    attempt(side.load());
  };
}
$("pane-count").onchange = () => {
  Object.assign(state, shareOut(Number($("pane-count").value), state.layers, state.spare));
  panes.build(state.layers);
  fitAll();
  settings();
};
$("run").onchange = () => {
  $("run").blur();
  if (socket.send({ type: "run", run: $("run").value })) return;
  $("run").value = state.run ?? "";
  notice("The server cannot be reached just now.", true);
};
$("reset-keys").onclick = () => { keymap.changes = {}; showKeys(); settings(); };
$("close-help").onclick = () => $("help").close();
listen($("panes"), state, {
  size: () => panes.size(),
  pane: (canvas) => Number(canvas.dataset.pane),
  begin: (at, keys, pane) => desk.begin(at, keys, pictureIn(pane)),
  hover: (at, pane) => desk.hover(at, pictureIn(pane)),
  leave: () => desk.pointing.leave(),
  move: (at) => desk.move(at),
  end: () => attempt(desk.release()),
  cancel: () => desk.cancel(),
  resize: (factor) => actions[factor > 1 ? "larger" : "smaller"](true),
  changed: () => { desk.activity.note(); view.ask(); },
  look,
});
window.addEventListener("blur", () => { state.blinking = state.swiping = state.hidden = false; view.ask(); });
window.addEventListener("online", () => saver.retry());
window.addEventListener("beforeunload", (event) => { if (!saver.idle) event.preventDefault(); });
for (const type of ["pointerdown", "keydown"]) {
  document.addEventListener(type, (event) => {
    for (const menu of document.querySelectorAll("details[open]")) {
      if (!menu.contains(/** @type {Node} */ (event.target))) menu.removeAttribute("open");
    }
  });
}
wireButtons(act);
wireKeys(keymap, act, () => /** @type {HTMLDialogElement | null} */ (document.querySelector("dialog[open]")));
titleButtons(keymap);
