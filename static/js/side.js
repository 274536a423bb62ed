/**
 * The side panel: proposals that are walked and applied, and the history of the pair. Loads what it
 * shows; what is chosen goes to the desk.
 * @typedef {import("./state.js").State} State
 */
import { api } from "./api.js";
import { $, waiting } from "./chrome.js";
import { drawHistory } from "./panels/history_list.js";
import { drawLabels } from "./panels/label_list.js";
import { drawProposals, drawScores } from "./panels/proposal_list.js";
import { Reasons } from "./panels/reasons.js";
import { SOURCES } from "./proposals.js";
import { decode } from "./rle.js";

const OTHER_RUN = "run:";

export class Side {
  /** @param {State} state @param {import("./desk.js").PairDesk} desk
   * @param {Record<"candidate" | "proposal", import("./maskview.js").MaskView>} masks
   * @param {{selected: (go: boolean) => void, attempt: (work: unknown) => void,
   *   notice: (text: string, bad?: boolean) => void, shown: (action: string) => string,
   *   redraw: () => void}} on */
  constructor(state, desk, masks, on) {
    this.state = state;
    this.desk = desk;
    this.masks = masks;
    this.on = on;
    this.reasons = new Reasons(state, on);
    /** What the list holds: of which pair, run, source and version. */
    this.loaded = "";
    /** @type {Promise<void>} the reading of that */
    this.loading = Promise.resolve();
    /** @type {import("./panels/history_list.js").Revision[]} */
    this.revisions = [];
    /** @type {number | null} the revision that is looked at */
    this.looked = null;
  }

  /** Offer the sources: those of the run, and the predictions of the other runs.
   * @param {{name: string}[]} runs */
  offer(runs) {
    const options = Object.entries(SOURCES).map(([name, { title }]) => new Option(title, name));
    options.push(...runs.map(({ name }) => new Option(`Prediction of ${name}`, OTHER_RUN + name)));
    $("source").replaceChildren(...options);
    const known = options.some((option) => option.value === this.state.source);
    if (!known && runs.length) this.state.source = "region";
    $("source").value = this.state.source;
  }

  /** Show the next source. */
  nextSource() {
    const { options } = /** @type {HTMLSelectElement} */ ($("source"));
    const place = [...options].findIndex((option) => option.value === this.state.source);
    this.state.source = options[(place + 1) % options.length].value;
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
    state.proposals = found;
    if (!state.proposal) state.selected = null;
    this.show();
  }

  /** @param {import("./state.js").Pair} pair @param {string} source */
  fetch(pair, source) {
    if (source.startsWith(OTHER_RUN)) return api.proposals(pair.id, source.slice(OTHER_RUN.length), ["prediction"]);
    return api.proposals(pair.id, pair.run, (SOURCES[source] ?? SOURCES.region).sources);
  }

  draw() {
    const { state, on } = this;
    const { pair } = state;
    if (!pair) return;
    drawProposals($("proposal-list"), state.proposals, state.regions, state.selected, {
      select: (key) => this.select(key, true),
      verdict: (key, verdict) => { this.select(key, false); on.attempt(this.desk.verdicts.give(verdict)); },
      apply: (key, way) => { this.select(key, false); on.attempt(this.desk.apply(way)); },
      shown: on.shown,
    });
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
    drawLabels($("label-list"), pair.labels, (number, label) => this.on.attempt(this.relabel(number, label)));
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
      this.desk.accept(await api.label(pair.id, pair.run, number, label));
      this.desk.on.changed();
    } catch (error) {
      await this.desk.refresh();
      throw error;
    } finally {
      waiting("");
    }
  }

  /** @param {string | null} key @param {boolean} go show its place */
  select(key, go) {
    this.state.selected = key;
    this.show();
    this.draw();
    this.on.selected(go);
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
    drawHistory($("history-list"), this.revisions, this.looked, {
      show: (number) => this.on.attempt(this.look(number)),
      restore: (number) => this.on.attempt(this.restore(number)),
    });
  }

  /** Look at a revision: its rim over the mask of today; null for none. @param {number | null} number */
  async look(number) {
    const { pair } = this.state;
    this.looked = number;
    this.masks.candidate.clear();
    this.drawHistory();
    if (pair && number !== null) {
      const reply = await api.revision(pair.id, number);
      if (this.looked !== number || this.state.pair?.id !== pair.id) return;
      this.masks.candidate.show(decode(reply.mask.counts, pair.width, pair.height));
    }
    this.on.redraw();
  }

  /** Make a revision the newest one, as an action that can be undone. @param {number} number */
  async restore(number) {
    const { pair } = this.state;
    if (!pair || !this.desk.editable) return;
    const reply = await api.revision(pair.id, number);
    if (this.state.pair?.id !== pair.id) return;
    const action = { tool: "restore", revision: number };
    const size = pair.width * pair.height;
    const ignored = reply.ignore ? decode(reply.ignore, pair.width, pair.height).data : new Uint8Array(size);
    const changed = [
      this.desk.replace("ignore", ignored, action),
      this.desk.replace("mask", decode(reply.mask.counts, pair.width, pair.height).data, action),
    ];
    if (!changed.some(Boolean)) this.on.notice(`Revision ${number} is what you see already.`);
    await this.look(null);
  }

  /** Another pair is open. */
  reset() {
    this.looked = null;
    this.masks.candidate.clear();
    this.masks.proposal.clear();
    $("proposal-list").replaceChildren();
    $("history-list").replaceChildren();
  }
}
