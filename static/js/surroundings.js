/**
 * What a workbench knows of the Viser page around it, and what it keeps of the desk, so that a new
 * desk (the server was started again, or Viser was) goes on where the old one was. A workbench that
 * stands alone has nothing around it.
 * @typedef {import("./state.js").State} State
 */
import { lastPlace } from "./memory.js";
import { FOLDED } from "./shell/frame.js";

const LAYOUT = "reviewer.layout";
const QUEUE = "reviewer.queue";
/** A layout counts once it stood this long: before, Viser is still building it. */
const STOOD_MS = 2000;

export class Surroundings {
  /** @param {Storage} session */
  constructor(session) {
    this.session = session;
    /** @type {HTMLElement | null} the frame's element in Viser's page */
    this.frame = /** @type {HTMLElement | null} */ (window.frameElement);
    this.joinedAt = Infinity;
  }

  /** Where the desk should go on, as the address of its socket says it.
   * @param {State} state @returns {Record<string, string>} */
  joining(state) {
    const place = lastPlace(this.session);
    return texts({
      client: this.frame?.dataset.client,
      store: (this.session.getItem("reviewer.owner") ?? "").split(".")[0],
      pair: state.pair?.id ?? place?.pair,
      run: state.run ?? place?.run,
      dark: state.dark,
      window: this.frame ? window.parent.innerWidth : 0,
      ...read(this.session, QUEUE),
      ...(this.frame ? read(this.session, LAYOUT) : {}),
    });
  }

  /** The desk has answered. */
  joined() {
    this.joinedAt = performance.now();
    if (this.frame) this.frame.dataset.joined = this.frame.dataset.client;
  }

  /** The desk has gone, or the page goes: keep how wide the docked panels are. */
  left() {
    const stood = performance.now() - this.joinedAt > STOOD_MS;
    this.joinedAt = Infinity;
    if (!this.frame || !stood) return;
    const widths = { queue: this.width("left"), workbench: this.width("right") };
    this.session.setItem(LAYOUT, JSON.stringify({ ...read(this.session, LAYOUT), ...texts(widths) }));
  }

  /** How wide a docked panel is; null for one that is folded or elsewhere. @param {string} edge */
  width(edge) {
    const region = window.parent.document.querySelector(`[data-dock-region="${edge}"]`);
    if (!region || region.querySelector(FOLDED)) return null;
    // The region itself has a border that Viser adds to the width that it is given.
    const columns = [...region.querySelectorAll("[data-dock-column]")];
    return Math.round(columns.reduce((sum, column) => sum + column.getBoundingClientRect().width, 0));
  }

  /** Keep the queue's filters. @param {import("./wire.js").Filtered} filters */
  filtered({ split, state, team, order }) {
    this.session.setItem(QUEUE, JSON.stringify({ split, state, team, order }));
  }
}

/** @param {Storage} session @param {string} name */
const read = (session, name) => JSON.parse(session.getItem(name) ?? "{}");

/** Leave out what is not known. @param {Record<string, unknown>} values @returns {Record<string, string>} */
function texts(values) {
  return Object.fromEntries(Object.entries(values)
    .filter(([, value]) => value !== null && value !== undefined && value !== "")
    .map(([name, value]) => [name, String(value)]));
}
