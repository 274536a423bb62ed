/**
 * How a person works through the pairs: correct, blind first, audit. What "submit" and "next" mean
 * in each.
 * @typedef {{open: (id: number, run: string | null) => Promise<void>,
 *   shown: (action: string) => string, next: (by: 1 | -1) => boolean}} Parts
 *   next: ask for the pair after or before, false when the server cannot be reached
 */
import { api } from "./api.js";
import { AuditWalk } from "./audit_walk.js";
import { $, attempt, notice, waiting } from "./chrome.js";

export const MODES = ["correct", "blind", "audit"];

export class Modes {
  /** @param {import("./state.js").State} state @param {import("./pair_session.js").PairSession} session
   * @param {import("./side.js").Side} side @param {Parts} parts */
  constructor(state, session, side, parts) {
    this.state = state;
    this.session = session;
    this.side = side;
    this.parts = parts;
    this.walk = new AuditWalk();
    /** @type {Promise<unknown>} the way to a region in doubt */
    this.moving = Promise.resolve();
    /** The region judged last, which the walk has left: where undo goes back to, as long as nothing
     * was done on the pair that came next.
     * @type {{region: number, history: import("./history.js").History, length: number} | null} */
    this.left = null;
  }

  /** @param {string} mode */
  async change(mode) {
    const { state, walk } = this;
    state.change({ mode: /** @type {import("./state.js").State["mode"]} */ (mode) });
    $("walk").textContent = "";
    if (mode === "audit") {
      state.change({ source: "region" });
      waiting("looking for regions…");
      await walk.begin(state.run, state.walkOrder, state.walkOpinion).finally(() => waiting(""));
      if (!walk.stops.length) notice(state.walkOpinion === "first"
        ? "Every region of this run has a verdict." : "No region waits for a second opinion of yours.");
      else await this.step(1);
    }
    state.tell("pair", false);
  }

  /** Enter: finish what is in the air; else submit, and go on. */
  async submit() {
    const { hand } = this.session;
    if (hand.offering || hand.busy) return hand.complete();
    return this.close("submitted");
  }

  /** Confirm that nothing changed, and go on. */
  confirmEmpty() {
    return this.close("confirmed_empty");
  }

  /** Approve, what is submitted already too, and go on. */
  approve() {
    // A skipped pair is taken up again first; asking whether it may be changed tells so.
    if (this.state.pair?.state === "skipped" && !this.session.editable) return undefined;
    return this.settle("approved");
  }

  /** Set a state that a finished pair keeps; a pair that is reviewed is left.
   * @param {import("./wire.js").StateChange["state"]} next */
  async close(next) {
    const { state } = this;
    if (!state.locked) return this.settle(next);
    if (state.reviewing) return this.step(1);
  }

  /** Set a state and go on; in blind mode the disagreements come first. @param {import("./wire.js").StateChange["state"]} next */
  async settle(next) {
    const { state, session, side, parts } = this;
    const { blind } = state;
    if (!await session.setState(next)) return;
    if (!blind) return this.step(1);
    state.reveal();
    await side.load();
    state.tell("pair", false);
    const count = state.proposals.length;
    if (!count) return this.step(1);
    notice(`${count} disagreement${count > 1 ? "s" : ""} with the prediction. `
      + `Look; reopen (${parts.shown("reopen").toUpperCase()}) to change the mask.`);
  }

  /** The pair cannot be compared: skip it, and go on; the notice offers the way back. */
  async skip() {
    const { session, state, walk } = this;
    const { pair } = state;
    if (!pair || !session.editable) return;
    session.hand.complete();
    await session.verdicts.settled();
    const fresh = await api.skip(pair.id, pair.run, true);
    state.accept(fresh);
    state.tell("stored");
    walk.leave(pair.id);
    await this.step(1);
    const count = fresh.regions.length;
    const rejected = count ? `: ${count} region${count > 1 ? "s" : ""} rejected` : "";
    notice(`${pair.split}/${pair.name} is skipped as badly aligned${rejected}.`, false,
      { title: "Undo", act: () => attempt(this.takeUp(pair.id)) });
  }

  /** Take a skipped pair up again. @param {number} id */
  async takeUp(id) {
    const { state, parts } = this;
    const fresh = await api.skip(id, state.run, false);
    if (state.pair?.id === id) state.accept(fresh);
    else await parts.open(id, state.run);
    state.tell("stored");
  }

  /** @param {1 | -1} by */
  async step(by) {
    if (this.state.mode === "audit") return (this.moving = this.walkOn(by));
    if (!this.parts.next(by)) notice("The server cannot be reached just now.", true);
  }

  /** Give a verdict on the selected region; the audit walks on. @param {import("./wire.js").VerdictChange["verdict"]} verdict */
  async judge(verdict) {
    const { session, side, state } = this;
    await this.arrived();
    const { region } = state;
    if (!await side.judge(verdict) || !region) return;
    if (state.mode !== "audit") return side.goOn();
    await this.step(1);
    const { history } = session.document;
    this.left = { region: region.id, history, length: history.done.length };
  }

  /** Undo what was done last: in the audit that may be a verdict on a pair that the walk has left. */
  async takeBack() {
    const { session, state, walk } = this;
    await this.arrived();
    const { left } = this;
    const walked = state.mode === "audit";
    const { history } = session.document;
    const untouched = left?.history === history && left.length === history.done.length;
    const back = walked && left && untouched ? walk.find(left.region) : null;
    this.left = null;
    if (back) await this.show(back);
    const entry = await session.step("undo");
    const again = walked && entry && "audit" in entry ? walk.find(entry.region) : null;
    if (again) await this.show(again);
  }

  /** Go to the next region in doubt, on whichever pair. @param {1 | -1} by */
  async walkOn(by) {
    const stop = this.walk.step(by);
    if (stop) return this.show(stop);
    notice(by > 0 ? "This was the last region in doubt." : "This is the first region of the walk.");
  }

  /** Show a region of the walk. @param {import("./audit_walk.js").Stop} stop */
  async show(stop) {
    const { walk, state, side, parts } = this;
    if (stop.pair !== state.pair?.id) await parts.open(stop.pair, walk.run);
    await side.load();
    const proposal = state.proposals.find((each) => each.region_id === stop.region);
    if (proposal) side.select(proposal.key, true);
    // The count is of what is seen, not of what is on its way.
    $("walk").textContent = walk.progress;
  }

  /** Wait until what is being opened is there. */
  arrived() {
    return Promise.all([this.moving, this.side.loading]);
  }
}
