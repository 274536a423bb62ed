/**
 * The sweep: walks the picture tile by tile from close by, notes each tile that was looked at, and
 * says how many there are. An element of its own in the status bar.
 * @typedef {import("./wire.js").SweepInfo} SweepInfo
 */

/** A tile that was on the screen this long was looked at. */
const LOOK_MS = 400;
/** Screen pixels a picture's pixel, and how much larger than the whole, at least. */
const CLOSE = 2;

/** The tile to look at next: the first after this one that is not swept; with all swept, the next.
 * @param {SweepInfo} sweep @param {number} here -1 before the first */
export function nextTile({ columns, rows, swept }, here) {
  const count = columns * rows;
  const after = Array.from({ length: count }, (_, k) => (here + 1 + k) % count);
  return after.find((tile) => !swept.includes(tile)) ?? after[0];
}

/** The box of a tile: x0, y0, x1, y1. @param {SweepInfo} sweep @param {number} tile
 * @param {{width: number, height: number}} image */
export function tileBox({ columns, rows }, tile, { width, height }) {
  const column = tile % columns;
  const row = Math.floor(tile / columns);
  return [column * width / columns, row * height / rows, (column + 1) * width / columns, (row + 1) * height / rows];
}

export class Sweep {
  /** @param {import("./state.js").State} state @param {import("./looking.js").Looking} looking
   * @param {import("./panes.js").Panes} panes @param {HTMLElement} place before which it says how far it is
   * @param {{note: (pair: number, tile: number) => Promise<SweepInfo>, wrong: (error: unknown) => void}} on */
  constructor(state, looking, panes, place, on) {
    this.state = state;
    this.looking = looking;
    this.panes = panes;
    this.on = on;
    this.timer = 0;
    this.here = -1;
    this.element = document.createElement("span");
    this.element.id = "sweep";
    this.element.setAttribute("role", "status");
    place.before(this.element);
    state.subscribe("pair", (fresh) => {
      if (fresh) this.leave();
      this.draw();
    });
    state.subscribe("swept", () => this.draw());
    state.subscribe("look", () => { if (state.fitted && this.here >= 0) this.leave(); });
  }

  /** Look at the next tile. */
  next() {
    const { looking, panes, state } = this;
    const { pair } = state;
    if (!pair) return;
    this.here = nextTile(pair.sweep, this.here);
    const box = tileBox(pair.sweep, this.here, pair);
    const [x0, y0, x1, y1] = box;
    const size = panes.size();
    const whole = Math.min(size.width / pair.width, size.height / pair.height);
    const tile = Math.min(size.width / (x1 - x0), size.height / (y1 - y0));
    looking.go({ scale: Math.min(tile, Math.max(CLOSE, CLOSE * whole)), x: (x0 + x1) / 2, y: (y0 + y1) / 2 });
    state.sweep(box);
    this.draw();
    clearTimeout(this.timer);
    const { here } = this;
    this.timer = window.setTimeout(() => {
      this.on.note(pair.id, here).then((swept) => state.swept(pair.id, swept), this.on.wrong);
    }, LOOK_MS);
  }

  /** The sweep is over, or the whole is looked at again. */
  leave() {
    clearTimeout(this.timer);
    this.here = -1;
    this.state.sweep(null);
    this.draw();
  }

  draw() {
    const { pair } = this.state;
    const tiles = pair ? pair.sweep.columns * pair.sweep.rows : 0;
    const swept = pair?.sweep.swept.length ?? 0;
    const text = swept || this.here >= 0 ? `swept ${swept} of ${tiles} tiles` : "";
    if (this.element.textContent !== text) this.element.textContent = text;
  }
}
