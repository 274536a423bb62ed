/**
 * What is told of saving: the line, the notices, the question about a conflict; and scores, queue and
 * map are brought up to date after it.
 */
import { attempt, notice } from "./chrome.js";
import { addressOf } from "./layers.js";
import { showConflict } from "./panels/conflict.js";

const PAUSE_MS = 700;

export class SaveStatus {
  /** @param {import("./state.js").State} state @param {import("./standing.js").Standing} standing
   * @param {import("./layers.js").Pictures} pictures
   * @param {{open: (id: number) => void, shown: (action: string) => string}} on shown: the key of an action */
  constructor(state, standing, pictures, on) {
    this.state = state;
    this.standing = standing;
    this.pictures = pictures;
    this.on = on;
    /** @type {Map<number, string>} of the pairs that were opened here */
    this.titles = new Map();
    this.timer = 0;
    state.subscribe("pair", () => {
      const { pair } = state;
      if (pair) this.titles.set(pair.id, `${pair.split}/${pair.name}`);
    });
  }

  /** @param {import("./saver.js").Saver} saver @param {string} status @param {string} [detail]
   * @param {number} [id] the pair it is about */
  show(saver, status, detail = "", id = 0) {
    const { on, state } = this;
    const waits = [...saver.parked][0];
    const [about, told] = status === "saved" && waits ? waits : [id, status];
    const name = this.titles.get(about) ?? `Pair ${about}`;
    this.standing.saving(told, detail, saver.parked.has(about) ? name : "");
    if (status === "conflict") {
      const picture = state.pair?.id === id ? this.pictures.get(addressOf(state, "live")).bitmap : null;
      attempt(showConflict(id, name, saver, picture, (which) => { if (state.pair?.id === which) on.open(which); }));
    }
    if (status === "locked") notice(`${detail} Your work is kept and sent when you reopen it (${on.shown("reopen")}).`, true);
    if (status === "refused") notice(`Not saved, but kept in this browser: ${detail}`, true);
  }

  /** Bring scores, queue and map up to date, once the person pauses: that costs a stroke its fluency.
   * @param {import("./saver.js").Saver} saver @param {import("./pair_session.js").PairSession} session */
  refreshSoon(saver, session) {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      if (this.state.drawing || !saver.idle) return this.refreshSoon(saver, session);
      this.state.tell("stored");
      attempt(session.refresh());
    }, PAUSE_MS);
  }
}
