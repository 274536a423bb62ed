/**
 * The link to the desk on the server's side: which pair to show, what to load ahead, and back to it
 * what is shown, what has changed and how the page looks.
 * @typedef {import("./state.js").State} State
 */
import { api, openDesk } from "./api.js";
import { $, attempt, notice } from "./chrome.js";
import { LAYERS } from "./layers.js";
import { proposedIn } from "./pair_session.js";

const SHOWN_MS = 150;

export class DeskLink {
  /** @param {State} state @param {import("./pair_session.js").PairSession} session
   * @param {import("./surroundings.js").Surroundings} around
   * @param {{here: () => void, away: () => void, start: () => Promise<void>,
   *   settled: (first: boolean) => Promise<void>, runs: (runs: import("./wire.js").RunInfo[]) => void,
   *   ahead: (pair: import("./state.js").Pair, layer: string) => void}} on
   *   start: it is known who is signed in; settled: the first pair is there; ahead: a picture may
   *   be wanted soon */
  constructor(state, session, around, on) {
    this.state = state;
    this.session = session;
    this.around = around;
    this.on = on;
    /** Of the server that gave this page. */
    this.version = "";
    this.timer = 0;
    /** @type {boolean | null} how the desk has it */
    this.dark = null;
    this.socket = openDesk(() => around.joining(state), {
      message: (message) => this.receive(message),
      here: on.here,
      away: () => { around.left(); on.away(); },
    });
    state.subscribe("stored", () => this.socket.send({ type: "changed" }));
    state.subscribe("settings", () => this.sendTheme());
  }

  /** @param {import("./wire.js").ToFrame} message from the server's side of the desk */
  async receive(message) {
    const { around, session, state } = this;
    if (message.type === "ready") {
      await this.begin(message);
    } else if (message.type === "error") {
      notice(message.detail, true);
    } else if (message.type === "open" && message.pair) {
      if (message.pair !== session.wanted || message.run !== state.run) await this.open(message.pair, message.run);
    } else if (message.type === "queue") {
      around.filtered(message);
    } else if (message.type === "here") {
      const others = message.names.filter((name) => name !== state.annotator);
      $("here").textContent = others.length ? `Also here: ${others.join(", ")}` : "Nobody else is here.";
    } else if (message.type === "map") {
      around.mapped(message.there);
    } else if (message.type === "ahead") {
      for (const id of message.pairs) this.loadAhead(id);
    } else if (message.type === "end") {
      notice(message.by > 0 ? "This is the last pair of the queue." : "This is the first pair of the queue.");
    }
  }

  /** The desk has answered. @param {import("./wire.js").Ready} message */
  async begin(message) {
    const { around, on, state } = this;
    around.joined(message.annotator);
    const first = !state.owner;
    this.version ||= message.version;
    if (message.version !== this.version) notice("The server has been updated. Load the page again to work with what is new.", true);
    state.signIn(message.annotator, message.store);
    if (first) await on.start();
    const linked = first && message.fresh && Number(new URLSearchParams(location.search).get("pair"));
    const wanted = linked || message.pair;
    if (!wanted) notice("There are no pairs yet. Import some: reviewer import DIR", true);
    else if (wanted !== state.pair?.id || message.run !== state.run) await this.open(wanted, message.run);
    else this.showingSoon();
    const runs = await api.runs();
    $("run").replaceChildren(...runs.map((run) => new Option(run.name, run.name)));
    $("run").value = state.run ?? "";
    on.runs(runs);
    await on.settled(first);
  }

  /** @param {number} id @param {string | null} run */
  async open(id, run) {
    await attempt(this.session.open(id, run).then((open) => open && this.showingSoon()));
  }

  /** Ask for the pair after or before. @param {1 | -1} by
   * @returns {boolean} false when the server cannot be reached */
  next(by) {
    clearTimeout(this.timer);
    return this.socket.send({ type: "step", by });
  }

  /** Tell the desk what is shown, once it is: queue, map and the work ahead wait for it. */
  showingSoon() {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      const { wanted } = this.session;
      // Another one may be on its way: then this one is not what the desk should think of.
      if (this.state.pair?.id === wanted) this.socket.send({ type: "showing", pair: wanted });
    }, SHOWN_MS);
  }

  /** Tell the desk whether the page is dark, where it has it otherwise. */
  sendTheme() {
    const { dark, owner } = this.state;
    if (!owner || dark === this.dark) return;
    this.dark = dark;
    this.socket.send({ type: "theme", dark });
  }

  /** Decode the pictures of a pair before it is asked for. @param {number} id */
  async loadAhead(id) {
    const { state } = this;
    const { pair } = await api.open(id, state.run, proposedIn(state));
    for (const name of new Set(state.layers.flatMap((layer) => [LAYERS[layer].base, LAYERS[layer].overlay]))) {
      if (name && pair.layers.includes(name)) this.on.ahead(pair, name);
    }
  }
}
