/**
 * The workbench's state. It changes through the methods here alone, and each tells those who
 * subscribed. What of it outlives a reload is kept by `memory.js`.
 * @typedef {import("./geometry.js").View} ViewState
 * @typedef {{x: number, y: number}} Point
 * @typedef {import("./wire.js").RegionInfo} Region
 * @typedef {import("./wire.js").ProposalInfo} Proposal
 * @typedef {import("./wire.js").PairDetail} Pair
 * @typedef {{points: {x: number, y: number, positive: boolean}[], box: number[] | null,
 *   count: number, index: number, score: number}} Candidate what a click tool shows
 * @typedef {import("./history.js").Layer} Layer
 * @typedef {import("./raster.js").Box} Box
 * @typedef {typeof DEFAULTS} Settings
 * @typedef {{settings: [], pair: [fresh: boolean], selection: [], look: [], cursor: [],
 *   candidate: [shown: import("./raster.js").Mask | null, asking: boolean], sketch: [], mask: [layer: Layer, box: Box | null], area: [], saved: [], revealed: [], swept: [],
 *   judged: [], stored: []}} Told
 *   pair: fresh for another one than before; look: view, or what is held; mask: a layer was drawn
 *   in a box, null for everywhere; judged: what was made of a proposal was taken back or done again;
 *   stored: queue and map have something new to read
 */
import { News } from "./news.js";

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
  veiled: false,
  dark: true,
  side: "proposals",
  keys: /** @type {Record<string, string>} */ ({}),
  drawer: true,
  advance: true,
  tabOn: false,
  openAtProposal: false,
  blinkMs: 320,
  toured: false,
  layers: ["warped", "live"],
  spare: /** @type {string[]} */ ([]),
};
export const SETTINGS = /** @type {(keyof typeof DEFAULTS)[]} */ (Object.keys(DEFAULTS));
const FINISHED = ["submitted", "approved", "confirmed_empty", "skipped"];
const MOST_REVEALED = 5000;

/** @extends {News<Told>} */
export class State extends News {
  constructor() {
    super();
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
    /** Whether what the run has not seen is veiled on live and reference. */
    this.veiled = DEFAULTS.veiled;
    this.dark = DEFAULTS.dark;
    /** The open tab of the side. */
    this.side = DEFAULTS.side;
    /** Keys that the person changed, by action. */
    this.keys = { ...DEFAULTS.keys };
    /** Whether the drawer with the queue is open. */
    this.drawer = DEFAULTS.drawer;
    /** Whether a decision selects the next proposal, and Tab after the last one opens the next pair. */
    this.advance = DEFAULTS.advance;
    this.tabOn = DEFAULTS.tabOn;
    /** Whether a new pair opens at its first proposal; else it is seen whole. */
    this.openAtProposal = DEFAULTS.openAtProposal;
    /** How long each picture stands while it blinks. */
    this.blinkMs = DEFAULTS.blinkMs;
    /** Whether the person has seen the tour, or skipped it. */
    this.toured = DEFAULTS.toured;
    this.layers = [...DEFAULTS.layers];
    /** A layer that is looked at in place of a pane's own, as long as the pointer rests on its
     * picture. @type {{pane: number, layer: string} | null} */
    this.preview = null;
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
    /** Who is signed in, and whose work is kept here: the person in this store. */
    this.annotator = "";
    this.owner = "";
    this.revision = 0;
    /** @type {Proposal[]} */
    this.proposals = [];
    /** @type {string | null} key of the selected proposal */
    this.selected = null;
    /** @type {number | null} the revision that is looked at */
    this.looked = null;
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
    /** The box of the tile that is looked at in a sweep: x0, y0, x1, y1. @type {number[] | null} */
    this.tile = null;
    this.blinking = false;
    /** When the blinking began, as the page counts. */
    this.blinkedAt = 0;
    /** The place under the cursor is shown large. */
    this.magnifying = false;
    this.swiping = false;
    this.hidden = false;
    /** Pairs whose blind phase is over for this person, newest last. @type {number[]} */
    this.revealed = [];
  }

  /** @param {Partial<Settings>} settings that the person changes */
  change(settings) {
    Object.assign(this, settings);
    this.tell("settings");
  }

  /** @param {string} annotator @param {string} store */
  signIn(annotator, store) {
    this.annotator = annotator;
    this.owner = `${store}.${annotator}`;
  }

  /** @param {number[]} revealed pairs whose blind phase is over */
  recall(revealed) {
    this.revealed = revealed;
  }

  /** The blind phase of the open pair is over. */
  reveal() {
    if (!this.pair || this.revealed.includes(this.pair.id)) return;
    this.revealed = [...this.revealed, this.pair.id].slice(-MOST_REVEALED);
    this.tell("revealed");
  }

  /** A pair was read; another one has nothing selected yet.
   * @param {Pair} pair @param {number} revision that its mask is of */
  open(pair, revision) {
    const fresh = this.pair?.id !== pair.id;
    this.pair = pair;
    this.run = pair.run;
    this.revision = revision;
    if (fresh) {
      this.proposals = [];
      this.selected = null;
      this.looked = null;
    }
    this.tell("pair", fresh);
  }

  /** What else is known of the open pair was read again; of another one it is dropped.
   * @param {Pair} pair */
  accept(pair) {
    if (this.pair?.id !== pair.id) return;
    this.pair = pair;
    this.tell("pair", false);
  }

  /** The state of a pair was set. @param {number} id
   * @param {import("./wire.js").StateReply} reply */
  stand(id, { state, truth }) {
    if (this.pair?.id !== id) return;
    Object.assign(this.pair, { state, truth });
    this.tell("pair", false);
  }

  /** The mask of the open pair is stored. @param {number} revision */
  store(revision) {
    this.revision = revision;
    if (this.pair?.state === "todo") this.pair.state = "in_progress";
    this.tell("saved");
  }

  /** @param {number[] | null} tile that is looked at in a sweep */
  sweep(tile) {
    this.tile = tile;
    this.tell("swept");
  }

  /** @param {number} id of a pair @param {import("./wire.js").SweepInfo} sweep what was looked at of it */
  swept(id, sweep) {
    if (this.pair?.id !== id) return;
    this.pair.sweep = sweep;
    this.tell("swept");
  }

  /** @param {Proposal[]} proposals @param {string} outcome what was made of them */
  judge(proposals, outcome) {
    for (const proposal of proposals) proposal.outcome = outcome;
    this.tell("pair", false);
  }

  /** @param {Proposal[]} proposals of the open pair */
  propose(proposals) {
    this.proposals = proposals;
    if (!this.proposal) this.selected = null;
  }

  /** @param {string | null} key of a proposal */
  select(key) {
    this.selected = key;
    this.tell("selection");
  }

  /** @param {number | null} number of the revision to look at, null for today's mask */
  lookBack(number) {
    this.looked = number;
    this.tell("look");
  }

  /** A layer was drawn. @param {Layer} layer @param {Box | null} box where, null for everywhere */
  draw(layer, box) {
    this.tell("mask", layer, box);
  }

  /** @param {ViewState} view @param {boolean} fitted whether it shows the whole image */
  look(view, fitted) {
    this.view = view;
    this.fitted = fitted;
    this.tell("look");
  }

  /** @param {Partial<Record<"hidden" | "blinking" | "swiping" | "magnifying", boolean>>} held down, or let go */
  hold(held) {
    if (held.blinking && !this.blinking) this.blinkedAt = performance.now();
    Object.assign(this, held);
    this.tell("look");
  }

  /** @param {Point | null} at where the cursor is in the image */
  point(at) {
    this.cursor = at;
    this.tell("cursor");
  }

  /** @param {Point[]} points outline that a tool draws @param {boolean} drawing it is under way */
  sketchOut(points, drawing) {
    this.sketch = points;
    this.drawing = drawing;
    this.tell("sketch");
  }

  /** @param {import("./tools/hand.js").Suggestion} suggestion of a tool */
  suggest({ candidate, mask, asking }) {
    this.candidate = candidate;
    this.tell("candidate", mask, asking);
  }

  /** @param {{mask: number, ignore: number}} area in pixels */
  count(area) {
    this.area = area;
    this.tell("area");
  }

  /** The layer that stands for the reference: as it was taken, where the warp is in doubt.
   * @returns {"warped" | "reference"} */
  get past() {
    return this.pair?.doubt && this.warpWanted !== this.pair.id ? "reference" : "warped";
  }

  /** The layers that the panes are set to, with the one that is looked at for a moment. */
  get wantedLayers() {
    const { preview } = this;
    return this.layers.map((layer, index) => (preview?.pane === index ? preview.layer : layer));
  }

  /** The layers as the panes show them. */
  get shownLayers() {
    return this.wantedLayers.map((layer) => (layer === "warped" ? this.past : layer));
  }

  /** @param {{pane: number, layer: string} | null} preview a layer to look at for a moment */
  glance(preview) {
    this.preview = preview;
    this.tell("look");
  }

  /** Show a layer in a pane; the pane that has it already takes this one's.
   * @param {number} index @param {string} layer */
  swap(index, layer) {
    const there = this.layers.indexOf(layer);
    if (there >= 0) this.layers[there] = this.layers[index];
    this.preview = null;
    this.showLayer(index, layer);
  }

  /** Show a layer in a pane. Going back from a doubtful warp changes nothing for other pairs.
   * @param {number} index @param {string} layer */
  showLayer(index, layer) {
    const back = layer === "reference" && this.layers[index] === "warped" && this.warpWanted === this.pair?.id;
    if (!back) this.layers[index] = layer;
    if (back || layer === "warped") this.warpWanted = back ? null : this.pair?.id ?? null;
    this.tell("settings");
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

  /** The proposals that nobody has decided on: nothing was made of them, and no verdict is given. */
  get undecided() {
    const judged = new Set(this.regions.filter(({ verdict }) => verdict).map(({ id }) => id));
    return this.proposals.filter(({ outcome, region_id: id }) => !outcome && !(id && judged.has(id)));
  }

  /** The region under DoI that is selected. @returns {Region | null} */
  get region() {
    const id = this.proposal?.region_id;
    return this.regions.find((region) => region.id === id) ?? null;
  }
}
