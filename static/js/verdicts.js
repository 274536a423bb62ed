/**
 * Verdicts on regions: given, taken back and given again. Each is an entry of the pair's history,
 * in its turn among the strokes, and moves there only once the server has it.
 * @typedef {{region: number, audit: number, action: {tool: string}}} Judged an entry of the history;
 *   audit: the verdict's key on the server
 */
import { api, ApiError } from "./api.js";

export class Verdicts {
  /** @param {import("./desk.js").PairDesk} desk */
  constructor(desk) {
    this.desk = desk;
    /** A verdict is being taken back or given again: nothing may come between. */
    this.stepping = false;
    /** @type {Promise<unknown>} what is on its way */
    this.pending = Promise.resolve();
  }

  /** @param {string} verdict @returns {Promise<boolean>} whether it was given */
  give(verdict) {
    const work = this.send(verdict);
    this.pending = work;
    return work;
  }

  /** Wait until what is on its way has arrived, or failed: who asked for it tells. */
  settled() {
    return Promise.allSettled([this.pending]);
  }

  /** @param {string} verdict */
  async send(verdict) {
    const { desk } = this;
    const { region } = desk.state;
    if (!region || (verdict === "adopt" && !region.has_object)) {
      desk.on.notice(region ? "This region has no object that could be adopted." : "Select a DoI region first: press Tab.");
      return false;
    }
    const fresh = await api.audit(region.id, verdict, desk.on.why(region.id));
    desk.on.given(region.id);
    if (fresh.id === desk.state.pair?.id) {
      const entry = { region: region.id, audit: fresh.audit, action: { tool: verdict } };
      desk.history.push(entry);
      desk.remember(entry);
    }
    if (fresh.run === desk.state.run) desk.accept(fresh);
    return true;
  }

  /** Take a verdict back, or give it again. @param {"undo" | "redo"} way @param {Judged} entry */
  step(way, entry) {
    const work = this.move(way, entry);
    this.pending = work;
    return work;
  }

  /** @param {"undo" | "redo"} way @param {Judged} entry */
  async move(way, entry) {
    const { desk } = this;
    this.stepping = true;
    try {
      const fresh = await api.standing(entry.audit, way === "redo");
      if (fresh.run === desk.state.run) desk.accept(fresh);
    } catch (error) {
      // What is gone on the server must not stand in the way of the strokes before it.
      if (!(error instanceof ApiError && [404, 409].includes(error.status))) throw error;
      desk.on.notice(error.message, true);
    } finally {
      this.stepping = false;
    }
    desk.history[way](desk.masks);
    desk.remember(null);
  }
}
