/**
 * A mask as canvases: a filled one, its rim, and (where asked for) white on black; repainted only
 * where the mask changed.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 */
import { outlineOf } from "./outline.js";
import { boxOf, clip, join } from "./raster.js";

export class MaskView {
  /** @param {number[]} colour red, green, blue @param {{hatched?: boolean, alone?: boolean}} [how] */
  constructor(colour, { hatched = false, alone = false } = {}) {
    this.colour = colour;
    this.hatched = hatched;
    this.fill = new OffscreenCanvas(1, 1);
    this.rim = new OffscreenCanvas(1, 1);
    this.alone = alone ? new OffscreenCanvas(1, 1) : null;
    /** Whether there may be something to draw. */
    this.filled = false;
    /** Counts changes of what there is to draw. */
    this.version = 0;
    /** @type {Box | null} holds every set pixel: only that much needs drawing */
    this.box = null;
    /** Lines around a mask that was shown as a whole. */
    this.outline = new Path2D();
  }

  /** Paint a mask that has little in common with the one before: where either has pixels.
   * @param {Mask} mask */
  show(mask) {
    const box = boxOf(mask);
    this.paint(mask, join(this.box, box) ?? { x0: 0, y0: 0, x1: 0, y1: 0 });
    this.box = box;
    this.outline = new Path2D();
    if (!box) return;
    for (const [x0, y0, x1, y1] of outlineOf(mask, box)) {
      this.outline.moveTo(x0, y0);
      this.outline.lineTo(x1, y1);
    }
  }

  /** @param {Mask} mask @param {Box | null} [dirty] only this box changed */
  paint(mask, dirty) {
    const { width, height, data } = mask;
    const fresh = this.fill.width !== width || this.fill.height !== height;
    const canvases = [this.fill, this.rim, this.alone].filter((canvas) => canvas !== null);
    if (fresh) {
      for (const canvas of canvases) {
        canvas.width = width;
        canvas.height = height;
      }
    }
    this.filled = true;
    this.version++;
    const all = { x0: 0, y0: 0, x1: width, y1: height };
    const grown = dirty && !fresh
      ? { x0: dirty.x0 - 1, y0: dirty.y0 - 1, x1: dirty.x1 + 1, y1: dirty.y1 + 1 }
      : all;
    this.box = grown === all ? boxOf(mask) : join(this.box, dirty ?? null);
    const box = clip(mask, grown);
    if (!box) return;
    const w = box.x1 - box.x0;
    const h = box.y1 - box.y0;
    const pictures = canvases.map(() => new ImageData(w, h));
    // A pixel at a time as one 32-bit number: little-endian, so alpha comes first.
    const [fill, rim, alone] = pictures.map((picture) => new Uint32Array(picture.data.buffer));
    const [red, green, blue] = this.colour;
    const full = ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
    for (let y = box.y0, o = 0; y < box.y1; y++) {
      for (let x = box.x0; x < box.x1; x++, o++) {
        const i = y * width + x;
        const set = data[i];
        if (alone) alone[o] = set ? 0xffffffff : 0xff000000;
        if (!set) continue;
        if (!this.hatched || (x + y) % 6 < 3) fill[o] = full;
        const inner = x > 0 && data[i - 1] && x < width - 1 && data[i + 1] &&
          y > 0 && data[i - width] && y < height - 1 && data[i + width];
        if (!inner) rim[o] = full;
      }
    }
    canvases.forEach((canvas, k) => canvas.getContext("2d")?.putImageData(pictures[k], box.x0, box.y0));
  }

  /** Draw nothing any more. */
  clear() {
    if (this.filled) this.version++;
    this.filled = false;
  }
}
