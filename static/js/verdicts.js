/**
 * Verdicts on regions: given, taken back and given again. Each is an entry of the pair's history,
 * in its turn among the strokes, and moves there only once the server has it.
 * @typedef {{region: number, audit: number, action: {tool: string}}} Judged an entry of the history;
 *   audit: the verdict's key on the server
 * @typedef {{of: (region: number) => {reason: string, comment: string}, given: (region: number) => void}} Why
 *   of: what was picked for a region; given: it went along with the verdict
 */
import { api, ApiError } from "./api.js";

export class Verdicts {
  /** @param {import("./state.js").State} state @param {import("./document.js").PairDocument} document
   * @param {(text: string, bad?: boolean) => void} notice */
  constructor(state, document, notice) {
    this.state = state;
    this.document = document;
    this.notice = notice;
    /** A verdict is being taken back or given again: nothing may come between. */
    this.stepping = false;
    /** @type {Promise<unknown>} what is on its way */
    this.pending = Promise.resolve();
    /** How many were asked for, here: what was read before the last of them is out of date. */
    this.count = 0;
  }

  /** @param {import("./wire.js").VerdictChange["verdict"]} verdict on the selected region @param {Why} why
   * @returns {Promise<boolean>} whether it was given */
  give(verdict, why) {
    this.count += 1;
    const work = this.send(verdict, why);
    this.pending = work;
    return work;
  }

  /** Wait until what is on its way has arrived, or failed: who asked for it tells. */
  settled() {
    return Promise.allSettled([this.pending]);
  }

  /** @param {import("./wire.js").VerdictChange["verdict"]} verdict @param {Why} why */
  async send(verdict, why) {
    const { document, state } = this;
    const { region } = state;
    if (!region || (verdict === "adopt" && !region.has_object)) {
      this.notice(region ? "This region has no object that could be adopted." : "Select a DoI region first: press Tab.");
      return false;
    }
    const fresh = await api.audit(region.id, verdict, why.of(region.id));
    why.given(region.id);
    if (fresh.id === state.pair?.id) {
      const entry = { region: region.id, audit: fresh.audit, action: { tool: verdict } };
      document.history.push(entry);
      document.remember(entry);
    }
    if (fresh.run === state.run) state.accept(fresh);
    return true;
  }

  /** Take a verdict back, or give it again. @param {"undo" | "redo"} way @param {Judged} entry */
  step(way, entry) {
    this.count += 1;
    const work = this.move(way, entry);
    this.pending = work;
    return work;
  }

  /** @param {"undo" | "redo"} way @param {Judged} entry */
  async move(way, entry) {
    const { document, state } = this;
    this.stepping = true;
    try {
      const fresh = await api.standing(entry.audit, way === "redo");
      if (fresh.run === state.run) state.accept(fresh);
    } catch (error) {
      // What is gone on the server must not stand in the way of the strokes before it.
      if (!(error instanceof ApiError && [404, 409].includes(error.status))) throw error;
      this.notice(error.message, true);
    } finally {
      this.stepping = false;
    }
    document.history[way](document.masks);
    document.remember(null);
  }
}
