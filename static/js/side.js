/**
 * The side panel: proposals that are walked and applied, and the history of the pair. Loads what it
 * shows; what is chosen goes to the session.
 * @typedef {import("./state.js").State} State
 */
import { api } from "./api.js";
import { $, attempt, notice, waiting } from "./chrome.js";
import { drawHistory } from "./panels/history_list.js";
import { Crops } from "./panels/crops.js";
import { drawDecisions } from "./panels/decide.js";
import { drawLabels } from "./panels/label_list.js";
import { drawProposals, drawScores } from "./panels/proposal_list.js";
import { Reasons } from "./panels/reasons.js";
import { askedFor, predictionOf, SOURCES } from "./proposals.js";
import { decode } from "./rle.js";

export class Side {
  /** @param {State} state @param {import("./pair_session.js").PairSession} session
   * @param {Record<"candidate" | "proposal", import("./maskview.js").MaskView>} masks
   * @param {import("./looking.js").Looking} looking
   * @param {(action: string) => string} shown the key of an action
   * @param {(layer: "warped" | "reference" | "live") => ImageBitmap | null} picture
   * @param {(verdict: import("./wire.js").VerdictChange["verdict"]) => unknown} decide a verdict is pressed */
  constructor(state, session, masks, looking, shown, picture, decide) {
    this.state = state;
    this.session = session;
    this.masks = masks;
    this.looking = looking;
    this.shown = shown;
    this.reasons = new Reasons(state, shown);
    this.crops = new Crops($("proposal-list"), state, picture);
    /** Whether the pair was opened just now, and nothing of it was shown yet. */
    this.fresh = false;
    /** What the list holds: of which pair, run, source and version. */
    this.loaded = "";
    /** @type {Promise<void>} the reading of that */
    this.loading = Promise.resolve();
    /** What the bar at the foot does. */
    this.decisions = { shown, apply: (/** @type {string} */ way) => attempt(this.apply(way)),
      verdict: (/** @type {import("./wire.js").VerdictChange["verdict"]} */ verdict) => attempt(decide(verdict)) };
    /** @type {import("./panels/history_list.js").Revision[]} */
    this.revisions = [];
    state.subscribe("pair", (fresh) => {
      if (fresh) this.reset();
      attempt(this.load());
    });
    state.subscribe("judged", () => attempt(this.load(true)));
    state.subscribe("selection", () => {
      this.show();
      this.draw();
    });
  }

  /** Offer the sources: those of the run, and the predictions of the other runs.
   * @param {{name: string}[]} runs */
  offer(runs) {
    const options = Object.entries(SOURCES).map(([name, { title }]) => new Option(title, name));
    options.push(...runs.map(({ name }) => new Option(`Prediction of ${name}`, predictionOf(name))));
    $("source").replaceChildren(...options);
    const known = options.some((option) => option.value === this.state.source);
    if (!known && runs.length) this.state.change({ source: "region" });
    $("source").value = this.state.source;
  }

  /** Show the next source. */
  async nextSource() {
    const { options } = /** @type {HTMLSelectElement} */ ($("source"));
    const place = [...options].findIndex((option) => option.value === this.state.source);
    this.state.change({ source: options[(place + 1) % options.length].value });
    await this.load();
  }

  /** Read what the panel shows, where it is not what it shows already. @param {boolean} [again] */
  async load(again = false) {
    const { state } = this;
    const { pair } = state;
    if (!pair) return;
    if (state.side === "history") await this.loadHistory();
    const source = state.reviewing ? "disagreement" : state.source;
    const wanted = [pair.id, pair.run, pair.version, source, state.blind].join();
    if (again || wanted !== this.loaded) {
      this.loaded = wanted;
      this.loading = this.read(pair, source, wanted);
    }
    await this.loading;
    this.draw();
  }

  /** @param {import("./state.js").Pair} pair @param {string} source @param {string} wanted */
  async read(pair, source, wanted) {
    const { state } = this;
    const found = state.blind || !pair.run ? [] : await this.fetch(pair, source);
    if (this.loaded !== wanted || state.pair?.id !== pair.id) return;
    state.propose(found);
    this.show();
    const opens = this.fresh && state.openAtProposal && state.mode !== "audit" && state.fitted && found.length > 0;
    this.fresh = false;
    if (opens) this.select(found[0].key, true);
  }

  /** @param {import("./state.js").Pair} pair @param {string} source */
  fetch(pair, source) {
    const came = this.session.cameWith(pair, source);
    if (came) return came;
    const { sources, run } = askedFor(source);
    return api.proposals(pair.id, run ?? pair.run, sources);
  }

  draw() {
    const { state } = this;
    const { pair } = state;
    if (!pair) return;
    drawProposals($("proposal-list"), state.proposals, state.regions, state.selected, this.crops,
      (key) => this.select(key, true));
    drawDecisions({ verdicts: $("verdicts"), ways: $("ways") }, state, this.decisions);
    this.reasons.draw();
    $("proposal-count").textContent = String(state.proposals.length);
    $("source").disabled = state.blind || state.reviewing;
    const note = state.blind ? "Hidden until you have submitted. Draw what changed, then press Submit."
      : state.proposals.length ? ""
      : state.reviewing ? "You and the prediction agree. Submit again for the next pair."
      : pair.run ? "Nothing is proposed here." : "There is no run yet.";
    $("proposal-note").textContent = note;
    $("proposal-note").hidden = !note;
    $("labels").hidden = state.blind || !(pair.reads_labels || pair.labels.length);
    $("label-use").textContent = pair.reads_labels ? "searched for on both images" : "of what changed";
    drawLabels($("label-list"), pair.labels, (number, label) => attempt(this.relabel(number, label)));
    $("scores").hidden = state.blind;
    const { audited: _, ...decided } = pair.scores;
    drawScores($("scores"), state.second ? decided : pair.scores);
  }

  /** Search the pair for another name. @param {number} number @param {string} label */
  async relabel(number, label) {
    const { pair } = this.state;
    if (!pair) return;
    waiting(pair.reads_labels ? `searching ${label || "nothing"}…` : "saving…");
    try {
      this.state.accept(await api.label(pair.id, pair.run, number, label));
      this.state.tell("stored");
    } catch (error) {
      await this.session.refresh();
      throw error;
    } finally {
      waiting("");
    }
  }

  /** @param {string | null} key @param {boolean} go show its place */
  select(key, go) {
    this.state.select(key);
    if (go) this.looking.goToProposal();
  }

  /** Put the selected proposal into the mask; then comes the next one.
   * @param {string} way "add", "subtract", "replace", "reject" or "ill-posed" */
  async apply(way) {
    const { session, state } = this;
    const { proposal } = state;
    const offered = session.hand.offering;
    await session.apply(way);
    if (!offered && proposal?.outcome === way) this.goOn();
  }

  /** Select the proposal after the one that was decided on, where the person wants that. */
  goOn() {
    const { advance, proposals, selected } = this.state;
    const next = proposals[proposals.findIndex(({ key }) => key === selected) + 1];
    if (advance && selected && next) this.select(next.key, true);
  }

  /** Whether there is no proposal after the selected one. */
  get atEnd() {
    const { proposals, selected } = this.state;
    return !proposals.length || proposals[proposals.length - 1].key === selected;
  }

  /** @param {import("./wire.js").VerdictChange["verdict"]} verdict on the selected region @returns {Promise<boolean>} whether it was given */
  judge(verdict) {
    return this.session.verdicts.give(verdict, this.reasons);
  }

  /** Paint the selected proposal's rim. */
  show() {
    const { pair, proposal } = this.state;
    if (pair && proposal) this.masks.proposal.show(decode(proposal.counts, pair.width, pair.height));
    else this.masks.proposal.clear();
  }

  /** @param {number} by */
  async walk(by) {
    // The key may come before the list does.
    await this.loading;
    const { proposals, selected } = this.state;
    if (!proposals.length) return;
    const here = proposals.findIndex((proposal) => proposal.key === selected);
    const there = (here + by + (here < 0 && by < 0 ? 1 : 0) + proposals.length) % proposals.length;
    this.select(proposals[there].key, true);
  }

  async loadHistory() {
    const { pair } = this.state;
    if (!pair) return;
    const revisions = await api.revisions(pair.id);
    if (this.state.pair?.id !== pair.id) return;
    this.revisions = revisions;
    this.drawHistory();
  }

  drawHistory() {
    drawHistory($("history-list"), this.revisions, this.state.looked, {
      show: (number) => attempt(this.look(number)),
      restore: (number) => attempt(this.restore(number)),
    });
  }

  /** Look at a revision: its rim over the mask of today; null for none. @param {number | null} number */
  async look(number) {
    const { pair } = this.state;
    this.state.lookBack(number);
    this.masks.candidate.clear();
    this.drawHistory();
    if (pair && number !== null) {
      const reply = await api.revision(pair.id, number);
      if (this.state.looked !== number || this.state.pair?.id !== pair.id) return;
      this.masks.candidate.show(decode(reply.mask.counts, pair.width, pair.height));
      this.state.tell("look");
    }
  }

  /** Make a revision the newest one, as an action that can be undone. @param {number} number */
  async restore(number) {
    const { pair } = this.state;
    if (!pair || !this.session.editable) return;
    const reply = await api.revision(pair.id, number);
    if (this.state.pair?.id !== pair.id) return;
    const action = { tool: "restore", revision: number };
    const size = pair.width * pair.height;
    const ignored = reply.ignore ? decode(reply.ignore, pair.width, pair.height).data : new Uint8Array(size);
    const changed = [
      this.session.document.replace("ignore", ignored, action),
      this.session.document.replace("mask", decode(reply.mask.counts, pair.width, pair.height).data, action),
    ];
    if (!changed.some(Boolean)) notice(`Revision ${number} is what you see already.`);
    await this.look(null);
  }

  /** Another pair is open. */
  reset() {
    this.fresh = true;
    this.masks.candidate.clear();
    this.masks.proposal.clear();
    $("proposal-list").replaceChildren();
    $("history-list").replaceChildren();
  }
}
