/**
 * How a person works through the pairs: correct, blind first, audit. What "submit" and "next" mean
 * in each.
 * @typedef {{open: (id: number, run: string | null) => Promise<void>, settings: () => void,
 *   notice: (text: string, bad?: boolean) => void, shown: (action: string) => string,
 *   reveal: () => void, redraw: () => void, next: (by: 1 | -1) => boolean}} Parts
 *   next: ask for the pair after or before, false when the server cannot be reached
 */
import { AuditWalk } from "./audit_walk.js";
import { $, waiting } from "./chrome.js";

export const MODES = ["correct", "blind", "audit"];

export class Modes {
  /** @param {import("./state.js").State} state @param {import("./desk.js").PairDesk} desk
   * @param {import("./side.js").Side} side @param {Parts} parts */
  constructor(state, desk, side, parts) {
    this.state = state;
    this.desk = desk;
    this.side = side;
    this.parts = parts;
    this.walk = new AuditWalk();
    /** @type {Promise<unknown>} the way to a region in doubt */
    this.moving = Promise.resolve();
  }

  /** @param {string} mode */
  async change(mode) {
    const { state, parts, walk } = this;
    state.mode = /** @type {any} */ (mode);
    parts.settings();
    $("walk").textContent = "";
    if (mode === "audit") {
      state.source = "region";
      waiting("looking for regions…");
      await walk.begin(state.run, state.walkOrder, state.walkOpinion).finally(() => waiting(""));
      parts.settings();
      if (!walk.stops.length) parts.notice(state.walkOpinion === "first"
        ? "Every region of this run has a verdict." : "No region waits for a second opinion of yours.");
      else await this.step(1);
    }
    parts.redraw();
  }

  /** Enter: finish what is in the air; else submit. In blind mode the disagreements come first. */
  async submit() {
    const { state, desk, side, parts } = this;
    if (desk.pointing.open || desk.active) return desk.finish();
    if (state.locked) return state.reviewing ? this.step(1) : undefined;
    const { blind } = state;
    if (!await desk.setState("submitted")) return;
    if (!blind) return this.step(1);
    parts.reveal();
    await side.load();
    parts.redraw();
    const count = state.proposals.length;
    if (!count) return this.step(1);
    parts.notice(`${count} disagreement${count > 1 ? "s" : ""} with the prediction. `
      + `Look; reopen (${parts.shown("reopen").toUpperCase()}) to change the mask.`);
  }

  /** @param {1 | -1} by */
  async step(by) {
    if (this.state.mode === "audit") return (this.moving = this.walkOn(by));
    if (!this.parts.next(by)) this.parts.notice("The server cannot be reached just now.", true);
  }

  /** Go to the next region in doubt, on whichever pair. @param {1 | -1} by */
  async walkOn(by) {
    const { walk, state, side, parts } = this;
    const stop = walk.step(by);
    if (!stop) return parts.notice(by > 0 ? "This was the last region in doubt." : "This is the first region of the walk.");
    $("walk").textContent = walk.progress;
    if (stop.pair !== state.pair?.id) await parts.open(stop.pair, walk.run);
    await side.load();
    const proposal = state.proposals.find((each) => each.region_id === stop.region);
    if (proposal) side.select(proposal.key, true);
  }

  /** Wait until what is being opened is there. */
  arrived() {
    return Promise.all([this.moving, this.side.loading]);
  }
}
