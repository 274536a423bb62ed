/**
 * The workbench's state, and what of it outlives a reload. Docking the panel reloads the frame, so
 * everything a person set must come back: tools and panes from localStorage, place and zoom from
 * sessionStorage.
 * @typedef {import("./geometry.js").View} ViewState
 * @typedef {{id: number, choice: string, number: number, label: string, f_b: number,
 *   iou: number, doi: number, inspect: boolean, reason: string, box_xyxy: number[] | null,
 *   has_object: boolean, verdict: string | null, audited_by: string | null}} Region
 * @typedef {{id: number, split: string, name: string, width: number, height: number,
 *   revision: number, state: string, run: string | null, layers: string[], version: string,
 *   regions: Region[], scores: Record<string, {precision: number, recall: number, f_score: number}>,
 *   valid_fraction: number | null, alignment_residual: number | null}} Pair
 */

const DEFAULTS = {
  tool: "brush",
  radius: 6,
  tolerance: 18,
  opacity: 0.45,
  outline: false,
  dark: true,
  layers: ["warped", "live", "detector", "objects_live", "doi", "prediction"],
};
const KEPT = /** @type {(keyof typeof DEFAULTS)[]} */ (Object.keys(DEFAULTS));

export class State {
  constructor() {
    this.tool = DEFAULTS.tool;
    this.radius = DEFAULTS.radius;
    this.tolerance = DEFAULTS.tolerance;
    this.opacity = DEFAULTS.opacity;
    this.outline = DEFAULTS.outline;
    this.dark = DEFAULTS.dark;
    this.layers = [...DEFAULTS.layers];
    /** @type {Pair | null} */
    this.pair = null;
    /** @type {ViewState} */
    this.view = { scale: 1, x: 0, y: 0 };
    /** @type {string | null} */
    this.run = null;
    this.revision = 0;
    this.region = -1;
    /** @type {{x: number, y: number} | null} */
    this.cursor = null;
    /** Pixels of the mask, counted when it changes. */
    this.area = 0;
    /** Whether the view shows the whole image because nobody zoomed; a resize fits it again. */
    this.fitted = true;
    /** @type {{x: number, y: number}[]} outline that a tool draws, in the image */
    this.sketch = [];
    /** A stroke is under way. */
    this.drawing = false;
    this.blinking = false;
    this.swiping = false;
    this.hidden = false;
  }

  get locked() {
    return ["submitted", "approved", "confirmed_empty"].includes(this.pair?.state ?? "");
  }

  /** @param {Storage} storage @param {string} person */
  restore(storage, person) {
    const text = storage.getItem(`reviewer.settings.${person}`);
    if (text) Object.assign(this, JSON.parse(text));
  }

  /** @param {Storage} storage @param {string} person */
  remember(storage, person) {
    const kept = Object.fromEntries(KEPT.map((key) => [key, this[key]]));
    storage.setItem(`reviewer.settings.${person}`, JSON.stringify(kept));
  }

  /** Keep where the person is looking. @param {Storage} session @param {string} owner */
  rememberPlace(session, owner) {
    if (!this.pair) return;
    session.setItem("reviewer.owner", owner);
    const place = { pair: this.pair.id, view: this.view, region: this.region, fitted: this.fitted };
    session.setItem("reviewer.place", JSON.stringify(place));
  }

  /** Return the pair that was open here in this database, 0 for none.
   * @param {Storage} session @param {string} store */
  lastPair(session, store) {
    const owner = session.getItem("reviewer.owner") ?? "";
    const text = session.getItem("reviewer.place");
    return text && owner.startsWith(`${store}.`) ? JSON.parse(text).pair : 0;
  }

  /** Return the place when it is of this pair. @param {Storage} session @param {number} id */
  place(session, id) {
    const text = session.getItem("reviewer.place");
    const place = text ? JSON.parse(text) : null;
    return place && place.pair === id ? place : null;
  }
}
