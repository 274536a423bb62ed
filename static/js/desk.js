/**
 * One open pair: loads it, edits its mask, saves it, gives verdicts, sets its state.
 * Everything that happens to the state happens here; `main` wires it to the page.
 * @typedef {import("./state.js").State} State
 * @typedef {Brush | Area | Bucket} Tool
 */
import { Activity } from "./activity.js";
import { api, ApiError } from "./api.js";
import { History } from "./history.js";
import { APPLY } from "./proposals.js";
import { emptyMask } from "./raster.js";
import { decode, encode } from "./rle.js";
import { Area } from "./tools/area.js";
import { Brush } from "./tools/brush.js";
import { Bucket } from "./tools/bucket.js";

export class PairDesk {
  /** @param {State} state @param {import("./saver.js").Saver} saver
   * @param {{mask: (box: import("./raster.js").Box | null) => void, pair: (fresh: boolean) => void,
   *   notice: (text: string, bad?: boolean) => void, changed: () => void,
   *   pixels: () => Uint8ClampedArray | null}} on pixels: RGBA of the live picture */
  constructor(state, saver, on) {
    this.state = state;
    this.saver = saver;
    this.on = on;
    this.mask = emptyMask(1, 1);
    this.history = new History();
    this.activity = new Activity(() => performance.now() / 1000);
    /** @type {Record<string, Tool>} */
    this.tools = {
      brush: new Brush(1),
      eraser: new Brush(0),
      polygon: new Area("polygon"),
      lasso: new Area("lasso"),
      box: new Area("box"),
      fill: new Bucket(() => on.pixels(), () => state.tolerance),
    };
    this.request = 0;
    this.options = { radius: 1, subtract: false, line: false, scale: 1 };
    /** @type {number | null} the pair asked for last */
    this.wanted = null;
    this.busy = false;
    /** @type {Tool | null} */
    this.active = null;
  }

  /** Open a pair, or read the open one again; a stale answer is dropped.
   * @param {number} id @param {string | null} run @returns {Promise<boolean>} whether it is open */
  async open(id, run) {
    const request = ++this.request;
    this.wanted = id;
    const [pair, reply] = await Promise.all([api.pair(id, run), this.newestMask(id)]);
    if (request !== this.request) return false;
    this.end();
    const { state } = this;
    const same = state.pair?.id === id;
    const unsent = this.saver.unsent(id);
    const fits = unsent?.width === pair.width && unsent?.height === pair.height;
    const shown = unsent && fits ? unsent.counts : reply.mask.counts;
    // The person's own undo history holds as long as nobody else's mask came in.
    const kept = same && (unsent !== null || reply.revision === state.revision);
    const mask = kept ? this.mask : decode(shown, pair.width, pair.height);
    state.pair = pair;
    state.run = pair.run;
    state.region = same ? Math.min(state.region, pair.regions.length - 1) : -1;
    state.revision = unsent ? unsent.revision : reply.revision;
    if (!kept) {
      this.mask = mask;
      this.history = new History();
    }
    if (!same) this.activity.take();
    this.on.mask(null);
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

  /** @param {{x: number, y: number}} at @param {{shift: boolean, alt: boolean}} keys */
  begin(at, keys) {
    if (!this.state.pair) return;
    if (this.state.locked) {
      this.on.notice(`This pair is ${this.state.pair.state.replace("_", " ")}. Press O to reopen it.`);
      return;
    }
    this.active = this.tools[this.state.tool];
    this.state.drawing = true;
    this.options = { radius: this.state.radius, subtract: keys.alt, line: keys.shift, scale: this.state.view.scale };
    this.paint(this.active.begin(this.mask, at, this.options));
    if (this.active.name === "polygon" && this.active.done) this.end();
  }

  /** @param {import("./raster.js").Box | null} box what a tool touched */
  paint(box) {
    this.state.sketch = this.active?.points ?? [];
    if (box) this.on.mask(box);
  }

  /** The pointer was released; a polygon goes on until it is closed. */
  release() {
    if (this.active?.done) this.end();
  }

  /** @param {{x: number, y: number}} at */
  move(at) {
    if (this.active) this.paint(this.active.move(this.mask, at, this.options));
  }

  /** Finish what the tool began: one entry of the history, one save. */
  end() {
    const tool = this.active;
    const stroke = tool?.end(this.mask);
    this.state.sketch = [];
    this.active = null;
    this.state.drawing = false;
    if (!tool || !stroke) return;
    if (stroke.box) this.on.mask(stroke.box);
    if (this.history.record(tool.name, stroke.before, this.mask, stroke.box)) {
      this.save({ tool: tool.name, radius: this.state.radius, samples: stroke.samples });
    }
  }

  cancel() {
    const box = this.active?.cancel(this.mask);
    this.active = null;
    this.state.drawing = false;
    this.state.sketch = [];
    if (box) this.on.mask(box);
  }

  /** @param {"undo" | "redo"} way */
  step(way) {
    if (this.state.locked || this.active) return;
    const patch = this.history[way](this.mask);
    if (!patch) return;
    this.on.mask(patch.box);
    this.save({ tool: way });
  }

  /** Put other pixels in place of the whole mask, as one action.
   * @param {Uint8Array} data @param {string} tool @param {object} [from] where the pixels come from */
  replace(data, tool, from = {}) {
    const before = this.mask;
    this.mask = { width: before.width, height: before.height, data };
    const box = { x0: 0, y0: 0, x1: before.width, y1: before.height };
    if (!this.history.record(tool, before, this.mask, box)) return;
    this.on.mask(null);
    this.save({ tool, ...from });
  }

  /** Put the selected region into the mask: its object where it has one, else the detector's pixels.
   * @param {string} way a name of `APPLY` */
  async applyRegion(way) {
    const { pair, region } = this.state;
    const chosen = pair?.regions[region];
    if (!pair || !chosen) return this.on.notice("Select a region first: press Tab.");
    const found = await api.proposals(pair.id, pair.run, ["region"]);
    const proposed = found.find((/** @type {any} */ each) => each.region_id === chosen.id);
    if (this.state.pair?.id !== pair.id || this.state.locked || this.active) return;
    const proposal = decode(proposed.counts, pair.width, pair.height);
    this.replace(APPLY[way](this.mask, proposal.data), way, { proposal: proposed.key });
  }

  /** @param {object} action */
  save(action) {
    const { pair, revision } = this.state;
    if (!pair) return;
    this.saver.save({
      id: pair.id,
      revision,
      width: pair.width,
      height: pair.height,
      counts: encode(this.mask),
      log: [action],
      seconds: this.activity.take(),
    });
  }

  /** The store has a mask. @param {number} id @param {number} revision */
  saved(id, revision) {
    const { state } = this;
    if (state.pair?.id !== id) return;
    state.revision = revision;
    if (state.pair.state === "todo") state.pair.state = "in_progress";
    this.refresh();
  }

  /** @param {string} verdict */
  async verdict(verdict) {
    const { pair, region } = this.state;
    const chosen = pair?.regions[region];
    if (!pair || !chosen) {
      this.on.notice("Select a region first: press Tab.");
      return;
    }
    if (verdict === "adopt" && !chosen.has_object) {
      this.on.notice("This region has no object that could be adopted.");
      return;
    }
    const request = this.request;
    const fresh = await api.audit(chosen.id, verdict);
    if (request === this.request) this.accept(fresh);
  }

  /** @param {string} next @returns {Promise<boolean>} whether the state was set */
  async setState(next) {
    const { pair, revision } = this.state;
    if (!pair || this.busy) return false;
    const reopening = next === "in_progress";
    if (!reopening && this.saver.unsent(pair.id)) {
      this.on.notice("The last change is not saved yet; try again in a moment.");
      return false;
    }
    this.busy = true;
    try {
      const reply = await api.putState(pair.id, next, reopening ? null : revision);
      pair.state = reply.state;
      if (reopening && this.saver.parked.has(pair.id)) this.saver.resolve(pair.id, reply.revision);
      if (this.state.pair !== pair) return false;
      if (reply.revision !== this.state.revision) await this.open(pair.id, pair.run);
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
