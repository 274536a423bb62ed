/**
 * The strip of small layers under the panes: one shows a layer in a pane as long as the pointer
 * rests on it, a click or its digit puts it there. Pictures of it are drawn once those of the panes
 * are; and the place where the panes look, when that is not the whole image.
 * @typedef {import("./state.js").State} State
 */
import { toImage } from "./geometry.js";
import { LAYERS } from "./layers.js";

/** In the order of their digits. */
export const STRIP = ["difference", "detector", "objects_live", "doi", "prediction", "ground_truth", "warped", "live",
  "reference", "objects_reference", "unseen", "ignore"];
const OVERVIEW_PX = 84;

export class Strip {
  /** @param {HTMLElement} root @param {State} state @param {import("./view.js").View} view
   * @param {import("./panes.js").Panes} panes @param {(action: string) => string} shown the key of an action */
  constructor(root, state, view, panes, shown) {
    this.state = state;
    this.view = view;
    this.panes = panes;
    this.shown = shown;
    /** The pane that the pointer was over last: a digit means that one. */
    this.pointed = 0;
    this.asked = false;
    this.items = STRIP.map((layer) => this.item(layer));
    root.replaceChildren(...this.items.map(({ button }) => button));
    root.addEventListener("pointerleave", () => state.glance(null));
    for (const told of /** @type {const} */ (["settings", "pair", "area", "revealed"])) state.subscribe(told, () => this.ask());
    new ResizeObserver(() => this.ask()).observe(root);
  }

  /** @param {string} layer */
  item(layer) {
    const button = document.createElement("button");
    button.className = "thumb";
    button.dataset.layer = layer;
    const canvas = document.createElement("canvas");
    const title = document.createElement("span");
    title.textContent = LAYERS[layer].title;
    button.append(canvas, title);
    button.onpointerenter = () => this.state.glance(button.disabled ? null : { pane: 0, layer });
    button.onclick = () => { this.put(layer, 0); button.blur(); };
    return { layer, button, canvas, ground: { canvas: new OffscreenCanvas(1, 1), key: "" } };
  }

  /** Show a layer in a pane. @param {string} layer @param {number} [pane] */
  put(layer, pane = this.pointed) {
    if (this.hides(layer)) return;
    this.state.swap(pane < this.state.layers.length ? pane : 0, layer);
  }

  /** Whether a person who looks for changes unprompted must not see a layer. @param {string} layer */
  hides(layer) {
    return this.state.blind && Boolean(LAYERS[layer].machine);
  }

  /** Draw soon. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw();
    });
  }

  draw() {
    const { panes, state, view } = this;
    const { pair } = state;
    const drawn = Boolean(pair) && panes.root.dataset.shown === String(pair?.id);
    const ratio = window.devicePixelRatio || 1;
    for (const [place, item] of this.items.entries()) {
      const { button, canvas, layer } = item;
      const { base, overlay } = LAYERS[layer];
      const there = [base, overlay].every((name) => !name || pair?.layers.includes(name));
      button.disabled = !there || this.hides(layer);
      button.setAttribute("aria-pressed", String(state.layers.includes(layer)));
      const key = this.shown(`layer-${place + 1}`);
      button.title = `${LAYERS[layer].title}${key ? ` (${key})` : ""}`;
      const [width, height] = [button.clientWidth * ratio, button.clientHeight * ratio].map(Math.round);
      if (canvas.width !== width) canvas.width = width;
      if (canvas.height !== height) canvas.height = height;
      // The picture of a warp in doubt is not asked for by itself.
      const doubted = base === "warped" && layer !== "warped" && state.past !== "warped";
      if (!drawn || !there || doubted) canvas.getContext("2d")?.clearRect(0, 0, width, height);
      else if (width && height) view.drawSmall(item, layer === "warped" ? state.past : layer);
    }
  }
}

/** Show where the panes look: the part of the image, in a small picture of its outline.
 * @param {HTMLElement} root @param {State} state @param {{width: number, height: number}} pane its size */
export function showOverview(root, state, pane) {
  const { pair, view } = state;
  const low = toImage(view, pane, { x: 0, y: 0 });
  const high = toImage(view, pane, { x: pane.width, y: pane.height });
  root.hidden = !pair || (low.x <= 0.5 && low.y <= 0.5 && high.x >= pair.width - 0.5 && high.y >= pair.height - 0.5);
  if (!pair || root.hidden) return;
  const scale = OVERVIEW_PX / Math.max(pair.width, pair.height);
  const part = /** @type {HTMLElement} */ (root.firstElementChild);
  const inside = (/** @type {number} */ v, /** @type {number} */ most) => Math.min(Math.max(v, 0), most) * scale;
  const [x, y] = [inside(low.x, pair.width), inside(low.y, pair.height)];
  Object.assign(root.style, { width: `${pair.width * scale}px`, height: `${pair.height * scale}px` });
  Object.assign(part.style, { left: `${x}px`, top: `${y}px`, width: `${Math.max(4, inside(high.x, pair.width) - x)}px`,
    height: `${Math.max(4, inside(high.y, pair.height) - y)}px` });
}
