/**
 * What a workbench knows of the Viser page around it, and what it keeps of the desk, so that a new
 * desk (the server was started again, or Viser was) goes on where the old one was. A workbench that
 * stands alone has nothing around it.
 * @typedef {import("./state.js").State} State
 */
import { lastPlace } from "./memory.js";
import { FOLDED } from "./shell/frame.js";

/** Who was signed in last in this browser, and how wide that person's panels are. */
const PERSON = "reviewer.annotator";
const LAYOUT = "reviewer.layout.";
const QUEUE = "reviewer.queue";
/** A layout counts once it stood this long: before, Viser is still building it. */
const STOOD_MS = 2000;
/** After an edge was let go of, Viser has drawn it. */
const LET_GO_MS = 150;

export class Surroundings {
  /** @param {Storage} session @param {Storage} local */
  constructor(session, local) {
    this.session = session;
    this.local = local;
    /** @type {HTMLElement | null} the frame's element in Viser's page */
    this.frame = /** @type {HTMLElement | null} */ (window.frameElement);
    this.joinedAt = Infinity;
    /** @type {number | null} how wide the drawer was when somebody last let go of its edge: what
     * Viser makes of it while its server is away is nobody's wish */
    this.wide = null;
    if (this.frame) {
      window.parent.addEventListener("pointerup", () => {
        setTimeout(() => { this.wide = this.width() ?? this.wide; }, LET_GO_MS);
      }, true);
    }
  }

  /** Where the desk should go on, as the address of its socket says it.
   * @param {State} state @returns {Record<string, string>} */
  joining(state) {
    const place = lastPlace(this.session);
    return texts({
      client: this.frame?.dataset.client,
      store: (this.session.getItem("reviewer.owner") ?? "").split(".")[0],
      pair: state.pair?.id ?? place?.pair,
      run: state.run ?? place?.run,
      dark: state.dark,
      ...read(this.session, QUEUE),
      ...(this.frame ? read(this.local, this.layout) : {}),
    });
  }

  /** Where this person's layout is kept. */
  get layout() {
    return LAYOUT + (this.local.getItem(PERSON) ?? "");
  }

  /** The desk has answered. @param {string} annotator who is signed in */
  joined(annotator) {
    this.local.setItem(PERSON, annotator);
    this.joinedAt = performance.now();
    if (this.frame) this.frame.dataset.joined = this.frame.dataset.client;
  }

  /** The desk has gone, or the page goes: keep how wide the docked panels are. */
  left() {
    const stood = performance.now() - this.joinedAt > STOOD_MS;
    this.joinedAt = Infinity;
    if (!this.frame || !stood) return;
    const widths = { queue: this.wide };
    this.local.setItem(this.layout, JSON.stringify({ ...read(this.local, this.layout), ...texts(widths) }));
  }

  /** How wide the drawer is; null for one that is shut, folded or elsewhere. */
  width() {
    const region = window.parent.document.querySelector('[data-dock-region="left"]');
    if (!region || region.querySelector(FOLDED)) return null;
    // The region itself has a border that Viser adds to the width that it is given.
    const columns = [...region.querySelectorAll("[data-dock-column]")];
    return Math.round(columns.reduce((sum, column) => sum + column.getBoundingClientRect().width, 0)) || null;
  }

  /** Say in Viser's page whether the drawer is open, and which pair is. @param {State} state */
  arrange({ drawer, pair }) {
    const title = pair ? `${pair.split}/${pair.name} · reviewer` : "reviewer";
    document.title = title;
    if (!this.frame) return;
    window.parent.document.title = title;
    this.frame.dataset.drawer = drawer ? "open" : "shut";
  }

  /** @param {boolean} there whether there is a map of what is open */
  mapped(there) {
    if (this.frame) this.frame.dataset.map = there ? "there" : "none";
  }

  /** Open another tab of Viser's page. @param {string} tab */
  turn(tab) {
    window.parent.dispatchEvent(new CustomEvent("turn", { detail: tab }));
  }

  /** Keep the queue's filters. @param {import("./wire.js").Filtered} filters */
  filtered({ split, state, team, order }) {
    this.session.setItem(QUEUE, JSON.stringify({ split, state, team, order }));
  }
}

/** @param {Storage} session @param {string} name */
const read = (session, name) => JSON.parse(session.getItem(name) ?? "{}");

/** Leave out what is not known. @param {Record<string, unknown>} values @returns {Record<string, string>} */
function texts(values) {
  return Object.fromEntries(Object.entries(values)
    .filter(([, value]) => value !== null && value !== undefined && value !== "")
    .map(([name, value]) => [name, String(value)]));
}
