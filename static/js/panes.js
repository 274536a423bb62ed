/**
 * The grid of panes: DOM, sizes, the layer picker of each. Draws nothing and decides nothing.
 */
import { LAYERS } from "./layers.js";

/**
 * @typedef {{canvas: HTMLCanvasElement, ground: Drawn}} Small a layer that is shown small
 * @typedef {Small & {element: HTMLElement, select: HTMLSelectElement, note: HTMLElement, still: Drawn}} Pane
 *   ground: what lies under the masks, still: what lies under the cursor, as drawn last
 * @typedef {{canvas: OffscreenCanvas, key: string}} Drawn
 */

export const COUNTS = [1, 2, 3, 4, 6, 8];
const GAP = 2;

/** Share out layers to another number of panes: those of closed panes are kept, and come back first.
 * @param {number} count @param {string[]} layers @param {string[]} spare
 * @returns {{layers: string[], spare: string[]}} */
export function shareOut(count, layers, spare) {
  const known = [...layers, ...spare];
  const all = [...known, ...Object.keys(LAYERS).filter((layer) => !known.includes(layer))];
  return { layers: all.slice(0, count), spare: all.slice(count, Math.max(count, known.length)) };
}

export class Panes {
  /** @param {HTMLElement} root @param {(index: number, layer: string) => void} chosen
   * @param {() => void} resized */
  constructor(root, chosen, resized) {
    this.root = root;
    this.chosen = chosen;
    /** @type {Pane[]} */
    this.items = [];
    this.observer = new ResizeObserver(() => {
      this.arrange();
      resized();
    });
    this.observer.observe(root);
    this.aspect = 4 / 3;
  }

  /** Make as many panes as there are layers. @param {string[]} layers */
  build(layers) {
    this.items = layers.map((layer, index) => {
      const element = document.createElement("div");
      element.className = "pane";
      const canvas = document.createElement("canvas");
      canvas.dataset.pane = String(index);
      const select = document.createElement("select");
      select.setAttribute("aria-label", `Layer of pane ${index + 1}`);
      select.title = "What this pane shows";
      for (const [name, { title }] of Object.entries(LAYERS)) select.add(new Option(title, name));
      select.value = layer;
      select.onchange = () => {
        this.chosen(index, select.value);
        select.blur();
      };
      const note = document.createElement("p");
      element.append(canvas, note, select);
      const [ground, still] = [0, 1].map(() => ({ canvas: new OffscreenCanvas(1, 1), key: "" }));
      return { element, canvas, select, note, ground, still };
    });
    this.root.replaceChildren(...this.items.map((item) => item.element));
    this.arrange();
  }

  /** Choose the number of columns that shows the image largest. */
  arrange() {
    const count = this.items.length;
    const { clientWidth, clientHeight } = this.root;
    let best = { columns: 1, width: 0 };
    for (let columns = 1; columns <= count; columns++) {
      const rows = Math.ceil(count / columns);
      const width = Math.min(
        (clientWidth - GAP * columns) / columns,
        ((clientHeight - GAP * rows) / rows) * this.aspect,
      );
      if (width > best.width) best = { columns, width };
    }
    this.root.style.gridTemplateColumns = `repeat(${best.columns}, minmax(0, 1fr))`;
    this.root.style.gridAutoRows = "minmax(0, 1fr)";
    const ratio = window.devicePixelRatio || 1;
    for (const { element, canvas } of this.items) {
      const width = Math.max(1, Math.round(element.clientWidth * ratio));
      const height = Math.max(1, Math.round(element.clientHeight * ratio));
      if (canvas.width !== width) canvas.width = width;
      if (canvas.height !== height) canvas.height = height;
    }
  }

  /** Size of the panes in CSS pixels (all are alike). */
  size() {
    const first = this.items[0]?.element;
    return { width: first?.clientWidth || 1, height: first?.clientHeight || 1 };
  }
}
