/**
 * The workbench: makes the parts and puts them together.
 */
import { actionsOf } from "./actions.js";
import { api } from "./api.js";
import { $, attempt, notice, showFacts, showHeader, showSettings, STATES, waiting } from "./chrome.js";
import { titleButtons, wireButtons, wireKeys } from "./controls.js";
import { DeskLink } from "./desk_link.js";
import { fillFields, wireFields } from "./fields.js";
import { Strip, showOverview } from "./strip.js";
import { Journal } from "./journal.js";
import { Keymap } from "./keys.js";
import { addressOf, LAYERS, levelAt, pictureOf, Pictures } from "./layers.js";
import { Looking } from "./looking.js";
import { showLoupe } from "./loupe.js";
import { remember, rememberRevealed, restore } from "./memory.js";
import { Modes } from "./modes.js";
import { overlaysOf } from "./overlays.js";
import { Jump } from "./panels/jump.js";
import { PairSession } from "./pair_session.js";
import { Palette } from "./panels/palette.js";
import { Tour } from "./panels/tour.js";
import { Panes } from "./panes.js";
import { listen } from "./pointer.js";
import { SaveStatus } from "./save_status.js";
import { Saver } from "./saver.js";
import { Side } from "./side.js";
import { Standing } from "./standing.js";
import { State } from "./state.js";
import { Surroundings } from "./surroundings.js";
import { Sweep } from "./sweep.js";
import { View } from "./view.js";

const state = new State();
const keymap = new Keymap();
const standing = new Standing();
const shown = (/** @type {string} */ action) => keymap.shown(action);

const pictures = new Pictures(() => { view.ask(); strip.ask(); side.crops.draw(); });
const bitmapOf = (/** @type {string} */ layer) => (state.pair?.layers.some((name) => name === layer) ? pictures.get(addressOf(state, layer)).bitmap : null);
const saves = new SaveStatus(state, standing, pictures, { open: (id) => link.open(id, state.run), shown });
const saver = new Saver({
  put: api.putMask,
  status: (...told) => saves.show(saver, ...told),
  saved: (id, revision) => { session.saved(id, revision); saves.refreshSoon(saver, session); },
});
const session = new PairSession(state, saver, { notice, waiting, shown,
  pixels: () => pictures.pixels(addressOf(state, "live")) });
const panes = new Panes($("panes"), (index, layer) => state.showLayer(index, layer), () => looking.resized());
const looking = new Looking(state, panes, sessionStorage);
state.subscribe("candidate", (_, asking) => document.body.toggleAttribute("data-asking", asking));
const overlays = overlaysOf(state, session.document, () => view.now());
const view = new View(state, panes, overlays, pictures, (layer, level) => addressOf(state, layer, level), drawn);
const strip = new Strip($("strip-layers"), state, view, panes, shown);

state.subscribe("pair", () => {
  showHeader(state);
  around.arrange(state);
  for (const { element } of panes.items) element.classList.toggle("locked", state.locked);
});
state.subscribe("saved", () => showHeader(state));
state.subscribe("settings", () => {
  showSettings(state);
  around.arrange(state);
  remember(state, localStorage);
});
state.subscribe("revealed", () => rememberRevealed(state, localStorage));
state.watch(() => view.ask());

const side = new Side(state, session, overlays, looking, shown, bitmapOf, (verdict) => modes.judge(verdict));
const modes = new Modes(state, session, side, { shown, open: (id, run) => link.open(id, run), next: (by) => link.next(by) });
const jump = new Jump({ states: STATES, wrong: (error) => notice(String(error), true),
  find: async (words, most) => (await api.findPairs(words, state.run, most)).pairs,
  open: (id) => link.open(id, state.run) });
const sweep = new Sweep(state, looking, panes, $("facts"), { note: api.sweep, wrong: (error) => notice(String(error), true) });
const around = new Surroundings(sessionStorage, localStorage);
const palette = new Palette(keymap, (action) => act(action));
const tour = new Tour(state);
const actions = actionsOf({ state, session, side, modes, looking, around, strip, jump, sweep,
  palette: () => palette.open(), tour: () => tour.begin() });
const link = new DeskLink(state, session, around, {
  here: () => { standing.joined(); saver.retry(); },
  away: () => { standing.parted(api.me().then(() => 200, (error) => error.status ?? 0)); },
  start,
  runs: (runs) => side.offer(runs),
  settled: async (first) => {
    if (first && state.mode === "audit") await modes.change("audit");
    if (first && !state.toured && state.pair) tour.begin();
  },
  ahead: (pair, name) => {
    const { width, height } = panes.size();
    const scale = Math.min(width / pair.width, height / pair.height) * (window.devicePixelRatio || 1);
    pictures.get(api.layerUrl(pair, name, !state.second, levelAt(pair, scale)));
  },
});

/** It is known who is signed in: what that person set comes back, and what was not saved is sent. */
async function start() {
  restore(state, localStorage);
  fillFields(state, keymap, panes);
  $("annotator").textContent = state.annotator;
  $("initial").textContent = state.annotator.slice(0, 1).toUpperCase();
  side.offer([]);
  attempt(side.reasons.load());
  api.me().then(({ clicks }) => { $("segmenter").textContent = `clicks: ${clicks}`; });
  try {
    const left = await saver.begin(await Journal.open(state.owner));
    if (left) notice("Work from before that was not saved yet is sent now.");
  } catch (error) {
    notice(`This browser keeps no unsent work, so do not close it while offline: ${error}`, true);
  }
  if (saver.idle) standing.saving("saved", "");
  window.focus();
}

let shownPair = "";
/** A frame was drawn: what speaks of it follows; the strip waits until a pair's panes are complete. */
function drawn() {
  showFacts(state);
  showOverview($("overview"), state, panes.size());
  showLoupe($("loupe"), state, bitmapOf, overlays.mask.rim);
  const { shown: pair = "" } = $("panes").dataset;
  if (pair && pair !== shownPair) strip.ask();
  shownPair = pair;
}

/** Do an action that a key or a button asks for. @param {string} action @param {boolean} [down] */
function act(action, down = true) {
  session.document.activity.note();
  attempt(actions[action](down));
}

/** @param {number} index which pane */
const pictureIn = (index) => pictureOf(LAYERS[state.shownLayers[index]]);

listen($("panes"), state, {
  size: () => panes.size(),
  pane: (canvas) => Number(canvas.dataset.pane),
  begin: (at, keys, pane) => session.hand.begin(at, keys, pictureIn(pane)),
  hover: (at, pane) => { strip.pointed = pane; session.hand.hover(at, pictureIn(pane)); },
  leave: () => session.hand.leave(),
  move: (at) => session.hand.move(at),
  end: () => attempt(session.hand.release()),
  cancel: () => session.hand.cancel(),
  resize: (factor) => actions[factor > 1 ? "larger" : "smaller"](true),
  changed: () => session.document.activity.note(),
  look: (there) => looking.go(there),
});
window.addEventListener("client", () => link.socket.again());
window.addEventListener("pagehide", () => around.left());
window.addEventListener("blur", () => state.hold({ blinking: false, swiping: false, hidden: false, magnifying: false }));
window.addEventListener("online", () => saver.retry());
window.addEventListener("beforeunload", (event) => { if (!saver.idle) event.preventDefault(); });
wireFields({ state, side, modes, keymap, panes, looking, link, act });
wireButtons(act);
wireKeys(keymap, act, () => /** @type {HTMLDialogElement | null} */ (document.querySelector("dialog[open]")));
titleButtons(keymap);
