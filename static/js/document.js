/**
 * The document that is edited: the two layers of the open pair, their history and run-lengths. Every
 * action is one entry of the history and one save. Knows no tool and no page.
 * @typedef {import("./state.js").State} State
 * @typedef {import("./history.js").Layer} Layer
 * @typedef {import("./history.js").Entry} Entry
 * @typedef {import("./history.js").Patch} Patch
 * @typedef {import("./history.js").Rejection} Rejection
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 * @typedef {{tool: string, [more: string]: unknown}} Action an entry of the tool log
 */
import { Activity } from "./activity.js";
import { History } from "./history.js";
import { APPLY } from "./proposals.js";
import { emptyMask } from "./raster.js";
import { decode, encode } from "./rle.js";
import { RleCache } from "./rle_cache.js";

/** @type {Layer[]} */
const LAYERS = ["mask", "ignore"];

export class PairDocument {
  /** @param {State} state @param {import("./saver.js").Saver} saver
   * @param {(text: string, bad?: boolean) => void} notice */
  constructor(state, saver, notice) {
    this.state = state;
    this.saver = saver;
    this.notice = notice;
    /** @type {import("./history.js").Masks} */
    this.masks = { mask: emptyMask(1, 1), ignore: emptyMask(1, 1) };
    this.runs = { mask: new RleCache(), ignore: new RleCache() };
    this.history = new History();
    this.activity = new Activity(() => performance.now() / 1000);
  }

  /** The layer that tools draw. */
  get mask() {
    return this.masks[this.state.target];
  }

  /** Put the layers of a pair here, and the history that led to them.
   * @param {{width: number, height: number}} size @param {string} mask @param {string} ignore
   * run-lengths, "" for none @param {{done: Entry[], undone: Entry[]} | undefined} story */
  load({ width, height }, mask, ignore, story) {
    this.masks.mask = decode(mask, width, height);
    this.masks.ignore = ignore ? decode(ignore, width, height) : emptyMask(width, height);
    this.history = new History(story?.done, story?.undone);
  }

  /** Show the layers anew. */
  show() {
    for (const layer of LAYERS) this.state.draw(layer, null);
  }

  /** Note what an action did to a layer. @param {Layer} layer @param {Mask} before
   * @param {Box | null} box where it may have changed @param {Action} action
   * @returns {boolean} whether anything changed */
  commit(layer, before, box, action) {
    const patch = this.history.record(layer, before, this.masks[layer], box, action);
    this.state.draw(layer, box);
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

  /** Put pixels into a layer, as one action. @param {Layer} layer @param {string} way "add",
   * "subtract", "replace" or "ill-posed" @param {Uint8Array} pixels @param {Action} action
   * @param {Uint8Array | null} [part] of the layer that gives way */
  put(layer, way, pixels, action, part = null) {
    const before = this.masks[layer];
    const rest = part ? { ...before, data: before.data.map((v, i) => (part[i] ? 0 : v)) } : before;
    return this.replace(layer, APPLY[way](rest, pixels), action);
  }

  /** Reject proposals, as one action: it draws nothing, and can be taken back all the same.
   * @param {import("./state.js").Proposal[]} proposals */
  reject(proposals) {
    const before = Object.fromEntries(proposals.map(({ key, outcome }) => [key, outcome]));
    const [key, ...more] = Object.keys(before);
    const action = { tool: "reject", ...(more.length ? { proposals: [key, ...more] } : { proposal: key }) };
    const entry = { before, action };
    this.history.push(entry);
    this.save(action, "mask", entry);
    this.state.judge(proposals, "reject");
  }

  /** Take the newest action back, or do it again. @param {"undo" | "redo"} way
   * @param {Patch | Rejection} entry */
  step(way, entry) {
    this.history[way](this.masks);
    const { tool, proposal, proposals } = /** @type {Action} */ (entry.action);
    const action = { tool: way, of: tool, ...(proposal ? { proposal } : {}), ...(proposals ? { proposals } : {}) };
    if ("before" in entry) {
      this.save(action, "mask", null);
      const judged = this.state.proposals.filter(({ key }) => key in entry.before);
      for (const each of judged) each.outcome = way === "undo" ? entry.before[each.key] : tool;
      this.state.tell("pair", false);
      return;
    }
    this.runs[entry.layer].touch(this.masks[entry.layer], entry.box);
    this.state.draw(entry.layer, entry.box);
    this.save(action, entry.layer, null);
    if (proposal) this.state.tell("judged");
  }

  /** Hand the layers in. @param {Action} action @param {Layer} layer which the action drew
   * @param {Entry | null} patch new in the history */
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
   * @param {Entry | null} entry new in it @returns {import("./journal.js").Head} */
  remember(entry) {
    const mask = this.runs.mask.encode(this.masks.mask);
    const ignore = this.masks.ignore.data.includes(1) ? this.runs.ignore.encode(this.masks.ignore) : "";
    const { done, undone } = this.history;
    const head = { done: done.length, total: done.length + undone.length, mask, ignore };
    const { pair } = this.state;
    if (pair) this.saver.journal?.remember(pair.id, head, entry).catch((error) => this.notice(String(error), true));
    return head;
  }
}
