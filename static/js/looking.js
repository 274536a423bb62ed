/**
 * Where the person looks: the view over the panes, fitted or zoomed, never past the picture; kept
 * for after a reload.
 */
import { clamp, fit, fitBox } from "./geometry.js";
import { lastPlace, rememberPlace } from "./memory.js";

const REST_MS = 200;

export class Looking {
  /** @param {import("./state.js").State} state @param {import("./panes.js").Panes} panes
   * @param {Storage} storage of the window */
  constructor(state, panes, storage) {
    this.state = state;
    this.panes = panes;
    this.storage = storage;
    this.timer = 0;
    state.subscribe("pair", (fresh) => (fresh ? this.arrive() : this.rememberSoon()));
    state.subscribe("selection", () => this.rememberSoon());
  }

  /** Another pair is open: look where the person looked last, or at all of it. */
  arrive() {
    const { panes, state } = this;
    const { pair } = state;
    if (!pair) return;
    panes.aspect = pair.width / pair.height;
    panes.arrange();
    const last = lastPlace(this.storage);
    const place = last?.pair === pair.id ? last : null;
    if (place && !place.fitted) this.go(place.view);
    else this.fitAll();
    if (place?.selected) state.select(place.selected);
  }

  /** Look elsewhere. @param {import("./geometry.js").View} there */
  go(there) {
    const { panes, state } = this;
    if (!state.pair) return;
    state.look(clamp(there, state.pair, panes.size()), false);
    this.rememberSoon();
  }

  fitAll() {
    const { panes, state } = this;
    if (!state.pair) return;
    state.look(fit(state.pair, panes.size()), true);
    this.rememberSoon();
  }

  /** The panes have another size. */
  resized() {
    const { panes, state } = this;
    if (state.fitted) this.fitAll();
    else if (state.pair) state.look(clamp(state.view, state.pair, panes.size()), false);
  }

  /** Show the place of the selected proposal. */
  goToProposal() {
    const box = this.state.proposal?.box_xyxy;
    if (box && box[2] > box[0]) this.go(fitBox(box, this.panes.size()));
  }

  rememberSoon() {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => rememberPlace(this.state, this.storage), REST_MS);
  }
}
