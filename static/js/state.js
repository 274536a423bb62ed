/**
 * The workbench's state, and what of it outlives a reload of the page, after which everything a
 * person set must come back: settings from localStorage, place and zoom from
 * sessionStorage.
 * @typedef {import("./geometry.js").View} ViewState
 * @typedef {{x: number, y: number}} Point
 * @typedef {import("./wire.js").RegionInfo} Region
 * @typedef {import("./wire.js").ProposalInfo} Proposal
 * @typedef {import("./wire.js").PairDetail} Pair
 * @typedef {{points: {x: number, y: number, positive: boolean}[], box: number[] | null,
 *   count: number, index: number, score: number}} Candidate what a click tool shows
 */

const DEFAULTS = {
  tool: "brush",
  target: /** @type {"mask" | "ignore"} */ ("mask"),
  mode: /** @type {"correct" | "blind" | "audit"} */ ("correct"),
  source: "region",
  walkOrder: "threshold",
  walkOpinion: "first",
  radius: 6,
  tolerance: 18,
  opacity: 0.45,
  brightness: 1,
  contrast: 1,
  outline: false,
  dark: true,
  side: "proposals",
  keys: /** @type {Record<string, string>} */ ({}),
  layers: ["warped", "live", "detector", "objects_live", "doi", "prediction"],
  spare: /** @type {string[]} */ ([]),
};
const KEPT = /** @type {(keyof typeof DEFAULTS)[]} */ (Object.keys(DEFAULTS));
const FINISHED = ["submitted", "approved", "confirmed_empty", "skipped"];
const MOST_REVEALED = 5000;

export class State {
  constructor() {
    this.tool = DEFAULTS.tool;
    /** Which layer the tools draw: the change mask, or the ill-posed pixels that are not scored. */
    this.target = DEFAULTS.target;
    this.mode = DEFAULTS.mode;
    /** Which proposals the list shows. */
    this.source = DEFAULTS.source;
    /** In what order the audit walks the regions, and whose opinions it asks for. */
    this.walkOrder = DEFAULTS.walkOrder;
    this.walkOpinion = DEFAULTS.walkOpinion;
    this.radius = DEFAULTS.radius;
    this.tolerance = DEFAULTS.tolerance;
    this.opacity = DEFAULTS.opacity;
    this.brightness = DEFAULTS.brightness;
    this.contrast = DEFAULTS.contrast;
    this.outline = DEFAULTS.outline;
    this.dark = DEFAULTS.dark;
    /** The open tab of the side. */
    this.side = DEFAULTS.side;
    /** Keys that the person changed, by action. */
    this.keys = { ...DEFAULTS.keys };
    this.layers = [...DEFAULTS.layers];
    /** The pair in doubt whose warp the person wants to see all the same. @type {number | null} */
    this.warpWanted = null;
    /** Layers of panes that are closed: they come back with their panes. */
    this.spare = [...DEFAULTS.spare];
    /** @type {Pair | null} */
    this.pair = null;
    /** @type {ViewState} */
    this.view = { scale: 1, x: 0, y: 0 };
    /** @type {string | null} */
    this.run = null;
    /** Who is signed in. */
    this.annotator = "";
    this.revision = 0;
    /** @type {Proposal[]} */
    this.proposals = [];
    /** @type {string | null} key of the selected proposal */
    this.selected = null;
    /** @type {Point | null} */
    this.cursor = null;
    /** Pixels of the mask and of the ignore layer, counted when they change. */
    this.area = { mask: 0, ignore: 0 };
    /** Whether the view shows the whole image because nobody zoomed; a resize fits it again. */
    this.fitted = true;
    /** @type {Point[]} outline that a tool draws, in the image */
    this.sketch = [];
    /** @type {Candidate | null} */
    this.candidate = null;
    /** A stroke is under way. */
    this.drawing = false;
    this.blinking = false;
    this.swiping = false;
    this.hidden = false;
    /** Pairs whose blind phase is over for this person, newest last. @type {number[]} */
    this.revealed = [];
  }

  /** The layer that stands for the reference: as it was taken, where the warp is in doubt.
   * @returns {"warped" | "reference"} */
  get past() {
    return this.pair?.doubt && this.warpWanted !== this.pair.id ? "reference" : "warped";
  }

  /** The layers as the panes show them. */
  get shownLayers() {
    return this.layers.map((layer) => (layer === "warped" ? this.past : layer));
  }

  /** Show a layer in a pane. Going back from a doubtful warp changes nothing for other pairs.
   * @param {number} index @param {string} layer */
  showLayer(index, layer) {
    const back = layer === "reference" && this.layers[index] === "warped" && this.warpWanted === this.pair?.id;
    if (!back) this.layers[index] = layer;
    if (back || layer === "warped") this.warpWanted = back ? null : this.pair?.id ?? null;
  }

  get locked() {
    return FINISHED.includes(this.pair?.state ?? "");
  }

  /** Whether the person must not see yet what machines propose. */
  get blind() {
    return this.mode === "blind" && !this.locked && !this.revealed.includes(this.pair?.id ?? 0);
  }

  /** Whether the person, having submitted blind, looks at where the machines disagree. */
  get reviewing() {
    return this.mode === "blind" && !this.blind;
  }

  /** Whether the person gives second opinions, and must not see the first. */
  get second() {
    return this.mode === "audit" && this.walkOpinion === "second";
  }

  /** The regions as this person may see them: a second opinion is given without seeing the first.
   * @returns {Region[]} */
  get regions() {
    const regions = this.pair?.regions ?? [];
    if (!this.second) return regions;
    return regions.map((region) => region.audited_by === this.annotator ? region
      : { ...region, verdict: null, audited_by: null, verdict_reason: "", comment: "" });
  }

  /** @returns {Proposal | null} */
  get proposal() {
    return this.proposals.find((proposal) => proposal.key === this.selected) ?? null;
  }

  /** The region under DoI that is selected. @returns {Region | null} */
  get region() {
    const id = this.proposal?.region_id;
    return this.regions.find((region) => region.id === id) ?? null;
  }

  /** The blind phase of the open pair is over. @param {Storage} storage @param {string} person */
  reveal(storage, person) {
    if (!this.pair || this.revealed.includes(this.pair.id)) return;
    this.revealed = [...this.revealed, this.pair.id].slice(-MOST_REVEALED);
    storage.setItem(`reviewer.revealed.${person}`, JSON.stringify(this.revealed));
  }

  /** @param {Storage} storage @param {string} person */
  restore(storage, person) {
    const text = storage.getItem(`reviewer.settings.${person}`);
    if (text) Object.assign(this, JSON.parse(text));
    this.revealed = JSON.parse(storage.getItem(`reviewer.revealed.${person}`) ?? "[]");
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
    const { run, view, selected, fitted } = this;
    session.setItem("reviewer.place", JSON.stringify({ pair: this.pair.id, run, view, selected, fitted }));
  }

  /** Return where the person was looking last, null for nowhere. @param {Storage} session
   * @returns {{pair: number, run: string | null, view: ViewState, selected: string | null, fitted: boolean} | null} */
  lastPlace(session) {
    return JSON.parse(session.getItem("reviewer.place") ?? "null");
  }

  /** Return the place when it is of this pair. @param {Storage} session @param {number} id */
  place(session, id) {
    const place = this.lastPlace(session);
    return place?.pair === id ? place : null;
  }
}
