/**
 * The two small pictures on a card: the place of a proposal on the reference and on the live image.
 * Drawn only while the card is in sight.
 */

/** A place is shown with so much around it, and never closer than this many pixels. */
const AROUND = 1.8;
const LEAST_PX = 48;

export class Crops {
  /** @param {HTMLElement} list that scrolls @param {import("../state.js").State} state
   * @param {(layer: "warped" | "reference" | "live") => ImageBitmap | null} picture */
  constructor(list, state, picture) {
    this.state = state;
    this.picture = picture;
    /** @type {Map<Element, number[]>} boxes by the canvas pair that is in sight */
    this.boxes = new Map();
    /** @type {Set<Element>} */
    this.inSight = new Set();
    this.watcher = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (isIntersecting) this.inSight.add(target);
        else this.inSight.delete(target);
      }
      this.draw();
    }, { root: list, rootMargin: "80px" });
  }

  /** The list is drawn anew. */
  clear() {
    this.watcher.disconnect();
    this.boxes.clear();
    this.inSight.clear();
  }

  /** @param {number[]} box x0, y0, x1, y1 @returns {HTMLElement} the two pictures */
  make(box) {
    const seen = document.createElement("div");
    seen.className = "seen";
    seen.setAttribute("aria-hidden", "true");
    for (const title of ["Reference", "Live"]) {
      const canvas = document.createElement("canvas");
      canvas.title = title;
      seen.append(canvas);
    }
    this.boxes.set(seen, box);
    this.watcher.observe(seen);
    return seen;
  }

  /** Draw those in sight: a picture may have come. */
  draw() {
    const { pair, past } = this.state;
    if (!pair) return;
    const ratio = window.devicePixelRatio || 1;
    for (const seen of this.inSight) {
      const [x0, y0, x1, y1] = /** @type {number[]} */ (this.boxes.get(seen));
      for (const [place, canvas] of seen.querySelectorAll("canvas").entries()) {
        const bitmap = this.picture(place ? "live" : past);
        const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.round(side * ratio));
        if (!bitmap || !width || canvas.dataset.drawn === `${pair.id} ${place}`) continue;
        canvas.dataset.drawn = `${pair.id} ${place}`;
        canvas.width = width;
        canvas.height = height;
        const scale = Math.min(width / Math.max(LEAST_PX, (x1 - x0) * AROUND), height / Math.max(LEAST_PX, (y1 - y0) * AROUND));
        const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
        context.setTransform(scale, 0, 0, scale, width / 2 - (scale * (x0 + x1)) / 2, height / 2 - (scale * (y0 + y1)) / 2);
        context.drawImage(bitmap, 0, 0, pair.width, pair.height);
        context.strokeStyle = "#2bb3bf";
        context.lineWidth = 1.5 / scale;
        context.strokeRect(x0 - 2 / scale, y0 - 2 / scale, x1 - x0 + 4 / scale, y1 - y0 + 4 / scale);
      }
    }
  }
}
