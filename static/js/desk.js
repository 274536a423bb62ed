/**
 * One open pair: loads it, edits its two layers, saves them, sets its state.
 * Everything that happens to the state happens here; `main` wires it to the page.
 * @typedef {import("./state.js").State} State
 * @typedef {import("./history.js").Layer} Layer
 * @typedef {Brush | Area | Bucket | Magnetic} Tool
 * @typedef {{tool: string, [more: string]: unknown}} Action an entry of the tool log
 */
import { Activity } from "./activity.js";
import { api, ApiError } from "./api.js";
import { History } from "./history.js";
import { APPLY } from "./proposals.js";
import { askClick, edgePath } from "./questions.js";
import { emptyMask } from "./raster.js";
import { decode, encode } from "./rle.js";
import { RleCache } from "./rle_cache.js";
import { Area } from "./tools/area.js";
import { Brush } from "./tools/brush.js";
import { Bucket } from "./tools/bucket.js";
import { Magnetic } from "./tools/magnetic.js";
import { Pointing } from "./tools/pointing.js";
import { Verdicts } from "./verdicts.js";

/** @type {Layer[]} */
const LAYERS = ["mask", "ignore"];

export class PairDesk {
  /** @param {State} state @param {import("./saver.js").Saver} saver
   * @param {{mask: (layer: Layer, box: import("./raster.js").Box | null) => void,
   *   pair: (fresh: boolean) => void, candidate: () => void, sketch: () => void, judged: () => void,
   *   saved: () => void,
   *   notice: (text: string, bad?: boolean) => void, waiting: (text: string) => void,
   *   shown: (action: string) => string, why: (region: number) => {reason: string, comment: string},
   *   given: (region: number) => void,
   *   changed: () => void, pixels: () => Uint8ClampedArray | null}} on pixels: RGBA of the live
   *   picture */
  constructor(state, saver, on) {
    this.state = state;
    this.saver = saver;
    this.on = on;
    /** @type {import("./history.js").Masks} */
    this.masks = { mask: emptyMask(1, 1), ignore: emptyMask(1, 1) };
    this.runs = { mask: new RleCache(), ignore: new RleCache() };
    this.history = new History();
    this.verdicts = new Verdicts(this);
    this.activity = new Activity(() => performance.now() / 1000);
    /** Names this window among the person's others, so that its newer clicks drop its older. */
    this.client = saver.tab;
    /** @type {Record<string, Tool>} */
    this.tools = {
      brush: new Brush(1),
      eraser: new Brush(0),
      polygon: new Area("polygon"),
      lasso: new Area("lasso"),
      magnetic: new Magnetic((from, to) => edgePath(state, from, to), () => this.sketch()),
      box: new Area("box"),
      fill: new Bucket(() => on.pixels(), () => state.tolerance),
    };
    this.pointing = new Pointing({ ask: (body, signal) => askClick(state, this.client, body, signal),
      changed: () => this.showCandidate(), notice: on.notice, waiting: on.waiting });
    this.request = 0;
    this.options = { radius: 1, subtract: false, line: false, scale: 1 };
    /** @type {number | null} the pair asked for last */
    this.wanted = null;
    this.busy = false;
    /** @type {Tool | null} */
    this.active = null;
  }

  /** The layer that tools draw. */
  get mask() {
    return this.masks[this.state.target];
  }

  /** Open a pair, or read the open one again; a stale answer is dropped.
   * @param {number} id @param {string | null} run @returns {Promise<boolean>} whether it is open */
  async open(id, run) {
    const request = ++this.request;
    this.wanted = id;
    await this.verdicts.settled();
    const [pair, reply] = await Promise.all([api.pair(id, run), this.newestMask(id)]);
    if (request !== this.request) return false;
    const unsent = this.saver.unsent(id);
    const fits = unsent?.width === pair.width && unsent?.height === pair.height;
    const shown = unsent && fits ? unsent.counts : reply.mask.counts;
    const ignored = (fits && this.saver.unsentIgnore(id)) || (reply.ignore ?? "");
    const same = this.state.pair?.id === id;
    // The person's own undo history holds as long as nobody else's mask came in.
    const kept = same && (unsent !== null || reply.revision === this.state.revision);
    const story = kept ? null : await this.saver.journal?.recall(id, shown, ignored);
    if (request !== this.request) return false;
    this.finish();
    const { state } = this;
    state.pair = pair;
    state.run = pair.run;
    state.revision = unsent ? unsent.revision : reply.revision;
    if (!kept) {
      this.masks.mask = decode(shown, pair.width, pair.height);
      this.masks.ignore = ignored ? decode(ignored, pair.width, pair.height) : emptyMask(pair.width, pair.height);
      this.history = new History(story?.done, story?.undone);
    }
    if (!same) {
      this.activity.take();
      state.proposals = [];
      state.selected = null;
    }
    for (const layer of LAYERS) this.on.mask(layer, null);
    this.on.pair(!same);
    return true;
  }

  /** The ground truth, not older than what was acknowledged here. @param {number} id */
  async newestMask(id) {
    const reply = await api.mask(id);
    return reply.revision < (this.saver.newest.get(id) ?? 0) ? api.mask(id) : reply;
  }

  /** Read regions, scores and layers again; the mask stays. */
  async refresh() {
    const { pair } = this.state;
    if (!pair) return;
    const request = this.request;
    const fresh = await api.pair(pair.id, pair.run);
    if (request === this.request) this.accept(fresh);
  }

  /** @param {import("./state.js").Pair} pair */
  accept(pair) {
    if (this.state.pair?.id !== pair.id) return;
    this.state.pair = pair;
    this.on.pair(false);
  }

  /** Whether the mask may be changed; if not, the person is told. */
  get editable() {
    const { pair } = this.state;
    if (pair && this.state.locked) {
      this.on.notice(`This pair is ${pair.state.replace("_", " ")}. Press ${this.on.shown("reopen")} to reopen it.`);
    }
    return pair !== null && !this.state.locked && !this.verdicts.stepping;
  }

  /** @param {{x: number, y: number}} at in the image of the pane
   * @param {{shift: boolean, alt: boolean, right: boolean}} keys @param {string} picture */
  begin(at, keys, picture) {
    if (!this.editable) return;
    if (this.state.tool === "click") return this.press(at, keys, picture);
    this.active = this.tools[this.state.tool];
    this.state.drawing = true;
    this.options = { radius: this.state.radius, subtract: keys.alt, line: keys.shift, scale: this.state.view.scale };
    this.paint(this.active.begin(this.mask, at, this.options));
    if (this.active.multi && this.active.done) this.end();
  }

  /** @param {{x: number, y: number}} at @param {{shift: boolean, alt: boolean, right: boolean}} keys
   * @param {string} picture */
  press(at, keys, picture) {
    const known = picture === "live" ? "live" : "reference";
    this.pointing.press(at, keys, known, this.state.view.scale);
    if (picture !== "raw reference") return;
    // The reference as it was taken has a frame of its own: its click belongs elsewhere in the live one.
    this.pointing.pressed = null;
    const { pair } = this.state;
    if (!pair) return;
    api.livePoint(pair.id, pair.run, at).then((there) => {
      if (this.state.pair?.id !== pair.id) return;
      this.pointing.press(there, keys, known, this.state.view.scale);
      return this.pointing.release(this.mask);
    }).catch((error) => this.on.notice(error.message, true));
  }

  /** @param {import("./raster.js").Box | null} box what a tool touched */
  paint(box) {
    this.state.sketch = this.active?.points ?? [];
    if (box) this.on.mask(this.state.target, box);
  }

  sketch() {
    this.state.sketch = this.active?.points ?? [];
    this.on.sketch();
  }

  /** The pointer was released; a polygon goes on until it is closed. */
  release() {
    if (this.state.tool === "click") return this.pointing.release(this.mask);
    if (this.active?.done) this.end();
  }

  /** @param {{x: number, y: number}} at */
  move(at) {
    if (this.pointing.pressed) {
      this.pointing.drag(at);
      this.on.sketch();
    } else if (this.active) {
      this.paint(this.active.move(this.mask, at, this.options));
    }
  }

  /** The pointer moves with no button down. @param {{x: number, y: number}} at @param {string} picture */
  hover(at, picture) {
    if (this.active?.multi) this.move(at);
    else if (this.state.tool === "click" && this.state.pair && !this.state.locked && picture !== "raw reference") {
      this.pointing.hover(at, picture === "live" ? "live" : "reference", this.mask);
    }
  }

  /** Finish what a tool began, whichever it is: what is shown becomes part of the mask. */
  finish() {
    if (this.pointing.chosen) this.applyCandidate("add");
    else this.end();
    this.pointing.reset();
    this.showCandidate();
  }

  /** Finish what the tool began: one entry of the history, one save. */
  end() {
    const tool = this.active;
    const stroke = tool?.end(this.mask);
    this.state.sketch = [];
    this.active = null;
    this.state.drawing = false;
    if (!tool || !stroke) return;
    this.commit(this.state.target, stroke.before, stroke.box,
      { tool: tool.name, radius: this.state.radius, samples: stroke.samples });
  }

  cancel() {
    this.pointing.reset();
    this.showCandidate();
    const box = this.active?.cancel(this.mask);
    this.active = null;
    this.state.drawing = false;
    this.state.sketch = [];
    if (box) this.on.mask(this.state.target, box);
  }

  /** @param {"undo" | "redo"} way @returns {Promise<import("./history.js").Entry | null>} what was
   * taken back or done again */
  async step(way) {
    const patch = this.history.next(way);
    if (!patch || this.active || this.verdicts.stepping) return null;
    if ("audit" in patch) {
      await this.verdicts.step(way, patch);
      return patch;
    }
    if (this.state.locked) return null;
    this.history[way](this.masks);
    this.runs[patch.layer].touch(this.masks[patch.layer], patch.box);
    this.on.mask(patch.layer, patch.box);
    const { tool, proposal } = /** @type {Action} */ (patch.action);
    this.save({ tool: way, of: tool, ...(proposal ? { proposal } : {}) }, patch.layer, null);
    if (proposal) this.on.judged();
    return patch;
  }

  /** Note what an action did to a layer: one entry of the history, one save.
   * @param {Layer} layer @param {import("./raster.js").Mask} before @param {import("./raster.js").Box | null} box
   * @param {Action} action @returns {boolean} whether anything changed */
  commit(layer, before, box, action) {
    const patch = this.history.record(layer, before, this.masks[layer], box, action);
    this.on.mask(layer, box);
    if (!patch) return false;
    this.runs[layer].touch(this.masks[layer], patch.box);
    this.save(action, layer, patch);
    return true;
  }

  /** Put other pixels in place of a whole layer, as one action.
   * @param {Layer} layer @param {Uint8Array} data @param {Action} action */
  replace(layer, data, action) {
    const before = this.masks[layer];
    this.masks[layer] = { width: before.width, height: before.height, data };
    return this.commit(layer, before, { x0: 0, y0: 0, x1: before.width, y1: before.height }, action);
  }

  /** Put the candidate, or else the selected proposal, into the mask or the ignore layer.
   * @param {string} way "add", "subtract", "replace", "reject" or "ill-posed" */
  apply(way) {
    if (this.pointing.open) return this.applyCandidate(way);
    const { pair, proposal } = this.state;
    if (!pair || !proposal) return this.on.notice("Select a proposal first: press Tab.");
    if (!this.editable || this.active) return;
    const action = { tool: way, proposal: proposal.key };
    const layer = way === "ill-posed" ? "ignore" : "mask";
    const pixels = decode(proposal.counts, pair.width, pair.height).data;
    const changed = way !== "reject" && this.replace(layer, APPLY[way](this.masks[layer], pixels), action);
    // What was judged and changed nothing is still worth remembering.
    if (!changed) this.save(action, layer, null);
    proposal.outcome = way;
    this.on.pair(false);
  }

  /** @param {string} way */
  applyCandidate(way) {
    const { pointing } = this;
    const found = pointing.mask;
    if (!found || way === "reject") return this.cancel();
    const layer = way === "ill-posed" ? "ignore" : way === "add" ? this.state.target : "mask";
    const before = this.masks[layer];
    const { part } = pointing;
    // A corrected part gives way to the candidate.
    const rest = part && way === "add" ? { ...before, data: before.data.map((v, i) => (part[i] ? 0 : v)) } : before;
    const action = { tool: "click", ...(way === "add" ? {} : { way }), ...pointing.story };
    pointing.reset();
    this.replace(layer, APPLY[way](rest, found.data), action);
    this.showCandidate();
  }

  /** Tell the state what the click tool shows. */
  showCandidate() {
    const { points, box, found, index, chosen, dragged } = this.pointing;
    this.state.candidate = this.pointing.open || dragged
      ? { points, box: box ?? dragged, count: found.length, index, score: chosen?.score ?? 0 } : null;
    this.on.candidate();
  }

  /** Hand the layers in. @param {Action} action @param {Layer} layer which the action drew
   * @param {import("./history.js").Patch | null} patch new in the history */
  save(action, layer, patch) {
    const { pair, revision, mode } = this.state;
    if (!pair) return;
    const { mask, ignore } = this.remember(patch);
    this.saver.save({
      id: pair.id,
      revision,
      width: pair.width,
      height: pair.height,
      counts: mask,
      // An empty layer is sent as such, so that it clears what was there.
      ignore: layer === "ignore" ? ignore || encode(emptyMask(pair.width, pair.height)) : null,
      log: [mode === "correct" ? action : { ...action, mode }],
      seconds: this.activity.take(),
    });
  }

  /** Keep where the history stands, for after a reload.
   * @param {import("./history.js").Entry | null} entry new in it @returns {import("./journal.js").Head} */
  remember(entry) {
    const mask = this.runs.mask.encode(this.masks.mask);
    const ignore = this.masks.ignore.data.includes(1) ? this.runs.ignore.encode(this.masks.ignore) : "";
    const { done, undone } = this.history;
    const head = { done: done.length, total: done.length + undone.length, mask, ignore };
    const { pair } = this.state;
    if (pair) this.saver.journal?.remember(pair.id, head, entry).catch((error) => this.on.notice(String(error), true));
    return head;
  }

  /** The store has a mask. @param {number} id @param {number} revision */
  saved(id, revision) {
    const { state } = this;
    if (state.pair?.id !== id) return;
    state.revision = revision;
    if (state.pair.state === "todo") state.pair.state = "in_progress";
    this.on.saved();
  }

  /** @param {string} next @returns {Promise<boolean>} whether the state was set */
  async setState(next) {
    const { pair } = this.state;
    if (!pair || this.busy) return false;
    const reopening = next === "in_progress";
    if (!reopening) this.finish();
    this.busy = true;
    try {
      if (!reopening && !(await this.saver.settled(pair.id))) {
        this.on.notice("The last change is not saved yet; try again in a moment.");
        return false;
      }
      const { revision } = this.state;
      const reply = await api.putState(pair.id, next, reopening ? null : revision, this.activity.take());
      pair.state = reply.state;
      if (this.state.pair?.id === pair.id) Object.assign(this.state.pair, { state: reply.state, truth: reply.truth });
      const parked = this.saver.parked.get(pair.id);
      // A conflict is answered part by part, not by sending one version over the other.
      if (reopening && parked && parked !== "conflict") this.saver.resolve(pair.id, reply.revision);
      if (this.state.pair?.id !== pair.id) return false;
      if (reply.revision !== this.state.revision) await this.open(pair.id, pair.run);
      else if (reopening) await this.refresh();
      else this.on.pair(false);
    } catch (error) {
      if (!(error instanceof ApiError && error.status === 409)) throw error;
      // Somebody saved a newer mask meanwhile: show it before anybody answers for it.
      await this.open(pair.id, pair.run);
      this.on.notice("Somebody saved a newer mask of this pair. Look at it, then decide again.", true);
      return false;
    } finally {
      this.busy = false;
    }
    this.on.changed();
    return true;
  }
}
