/**
 * The session on one open pair: opens it, reads it again, takes back and does again, puts proposals
 * into it, gives verdicts, sets its state. Drawing is the hand's, the layers are the document's.
 * @typedef {import("./state.js").State} State
 * @typedef {import("./state.js").Pair} Pair
 */
import { api, ApiError } from "./api.js";
import { PairDocument } from "./document.js";
import { askedFor } from "./proposals.js";
import { askClick, edgePath, livePoint } from "./questions.js";
import { decode } from "./rle.js";
import { Hand } from "./tools/hand.js";
import { Pointing } from "./tools/pointing.js";
import { toolbox } from "./tools/toolbox.js";
import { Verdicts } from "./verdicts.js";

export class PairSession {
  /** @param {State} state @param {import("./saver.js").Saver} saver
   * @param {{notice: (text: string, bad?: boolean) => void, waiting: (text: string) => void,
   *   shown: (action: string) => string, pixels: () => Uint8ClampedArray | null}} parts
   *   shown: the key of an action; pixels: RGBA of the live picture */
  constructor(state, saver, parts) {
    this.state = state;
    this.saver = saver;
    this.parts = parts;
    this.document = new PairDocument(state, saver, parts.notice);
    const changed = () => this.hand.show();
    const pointing = new Pointing({
      // The tab names this window among the person's others, so that its newer clicks drop its older.
      ask: (body, signal) => askClick(state, saver.tab, body, signal),
      locate: (at) => livePoint(state, at),
      mask: () => this.document.mask,
      changed, notice: parts.notice, waiting: parts.waiting,
    });
    const tools = toolbox(pointing, { pixels: parts.pixels, tolerance: () => state.tolerance,
      path: (from, to) => edgePath(state, from, to), changed });
    this.hand = new Hand(state, this.document, tools, () => this.editable);
    this.verdicts = new Verdicts(state, this.document, parts.notice);
    this.request = 0;
    /** @type {number | null} the pair asked for last */
    this.wanted = null;
    this.busy = false;
    /** @type {{pair: Pair, source: string, proposals: import("./state.js").Proposal[]} | null} */
    this.came = null;
  }

  /** Open a pair, or read the open one again; a stale answer is dropped.
   * @param {number} id @param {string | null} run @returns {Promise<boolean>} whether it is open */
  async open(id, run) {
    const request = ++this.request;
    this.wanted = id;
    await this.verdicts.settled();
    const source = this.state.source;
    const { pair, mask: reply, proposals } = await this.read(id, run);
    if (request !== this.request) return false;
    const { state, saver, document } = this;
    const unsent = saver.unsent(id);
    const fits = unsent?.width === pair.width && unsent?.height === pair.height;
    const shown = unsent && fits ? unsent.counts : reply.mask.counts;
    const ignored = (fits && saver.unsentIgnore(id)) || (reply.ignore ?? "");
    const same = state.pair?.id === id;
    // The person's own undo history holds as long as nobody else's mask came in.
    const kept = same && (unsent !== null || reply.revision === state.revision);
    const story = kept ? undefined : await saver.journal?.recall(id, shown, ignored);
    if (request !== this.request) return false;
    this.hand.complete();
    if (!kept) document.load(pair, shown, ignored, story);
    if (!same) document.activity.take();
    document.show();
    this.came = this.state.mode === "blind" ? null : { pair, source, proposals };
    state.open(pair, unsent ? unsent.revision : reply.revision);
    return true;
  }

  /** All of a pair, its ground truth not older than what was acknowledged here.
   * @param {number} id @param {string | null} run */
  async read(id, run) {
    const asked = proposedIn(this.state);
    const opened = await api.open(id, run, asked);
    return opened.mask.revision < (this.saver.newest.get(id) ?? 0) ? api.open(id, run, asked) : opened;
  }

  /** The proposals that a pair was opened with, once: later they may be others.
   * @param {Pair} pair @param {string} source */
  cameWith(pair, source) {
    const { came } = this;
    this.came = null;
    return came?.pair === pair && came.source === source ? came.proposals : null;
  }

  /** Read regions, scores and layers again; the mask stays. What was read before a verdict was given is
   * read once more: it would hide the verdict. */
  async refresh() {
    const { state, verdicts } = this;
    const { pair } = state;
    if (!pair) return;
    const request = this.request;
    for (;;) {
      const given = verdicts.count;
      await verdicts.settled();
      const fresh = await api.pair(pair.id, pair.run);
      if (request !== this.request) return;
      if (given === verdicts.count) return state.accept(fresh);
    }
  }

  /** Whether the mask may be changed; if not, the person is told. */
  get editable() {
    const { pair, locked } = this.state;
    if (pair && locked) {
      const { notice, shown } = this.parts;
      notice(`This pair is ${pair.state.replace("_", " ")}. Press ${shown("reopen").toUpperCase()} to reopen it.`);
    }
    return pair !== null && !locked && !this.verdicts.stepping;
  }

  /** @param {"undo" | "redo"} way @returns {Promise<import("./history.js").Entry | null>} what was
   * taken back or done again */
  async step(way) {
    const entry = this.document.history.next(way);
    if (!entry || this.hand.busy || this.verdicts.stepping) return null;
    if ("audit" in entry) {
      await this.verdicts.step(way, entry);
      return entry;
    }
    if (this.state.locked) return null;
    this.document.step(way, entry);
    return entry;
  }

  /** Put what the tool offers, or else the selected proposal, into the mask or the ignore layer.
   * @param {string} way "add", "subtract", "replace", "reject" or "ill-posed" */
  apply(way) {
    const { document, hand, parts, state } = this;
    if (hand.offering) return hand.complete(way);
    const { pair, proposal } = state;
    if (!pair || !proposal) return parts.notice("Select a proposal first: press Tab.");
    if (!this.editable || hand.busy) return;
    if (way === "reject") return document.reject([proposal]);
    const action = { tool: way, proposal: proposal.key };
    const layer = way === "ill-posed" ? "ignore" : "mask";
    const { data } = decode(proposal.counts, pair.width, pair.height);
    // What was judged and changed nothing is still worth remembering.
    if (!document.put(layer, way, data, action)) document.save(action, layer, null);
    state.judge([proposal], way);
  }

  /** Reject all proposals of the list that nobody has decided on. */
  rejectRest() {
    const { document, hand, parts, state } = this;
    if (!state.pair || !this.editable || hand.busy) return;
    const { undecided } = state;
    if (!undecided.length) return parts.notice("Every proposal of the list is decided.");
    document.reject(undecided);
    const count = undecided.length;
    parts.notice(`${count} proposal${count > 1 ? "s" : ""} rejected (${parts.shown("undo")} takes that back).`);
  }

  /** The store has a mask. @param {number} id @param {number} revision */
  saved(id, revision) {
    if (this.state.pair?.id === id) this.state.store(revision);
  }

  /** @param {import("./wire.js").StateChange["state"]} next @returns {Promise<boolean>} whether the state was set */
  async setState(next) {
    const { parts, saver, state } = this;
    const { pair } = state;
    if (!pair || this.busy) return false;
    const reopening = next === "in_progress";
    if (!reopening) this.hand.complete();
    this.busy = true;
    try {
      if (!reopening && !(await saver.settled(pair.id))) {
        parts.notice("The last change is not saved yet; try again in a moment.");
        return false;
      }
      const reply = await api.putState(pair.id, next, reopening ? null : state.revision, this.document.activity.take());
      state.stand(pair.id, reply);
      const parked = saver.parked.get(pair.id);
      // A conflict is answered part by part, not by sending one version over the other.
      if (reopening && parked && parked !== "conflict") saver.resolve(pair.id, reply.revision);
      if (state.pair?.id !== pair.id) return false;
      if (reply.revision !== state.revision) await this.open(pair.id, pair.run);
      else if (reopening) await this.refresh();
    } catch (error) {
      if (!(error instanceof ApiError && error.status === 409)) throw error;
      // Somebody saved a newer mask meanwhile: show it before anybody answers for it.
      await this.open(pair.id, pair.run);
      parts.notice("Somebody saved a newer mask of this pair. Look at it, then decide again.", true);
      return false;
    } finally {
      this.busy = false;
    }
    state.tell("stored");
    return true;
  }
}

/** Which proposals a pair is opened with: in blind mode none, they may have to stay hidden.
 * @param {State} state */
export function proposedIn({ mode, source }) {
  return mode === "blind" ? { sources: [], run: null } : askedFor(source);
}
