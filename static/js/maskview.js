/**
 * The mask as canvases: a filled one and its rim, repainted only where the mask changed.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 */
import { clip } from "./raster.js";

const COLOUR = [0, 214, 143];

export class MaskView {
  constructor() {
    this.fill = new OffscreenCanvas(1, 1);
    this.rim = new OffscreenCanvas(1, 1);
    this.alone = new OffscreenCanvas(1, 1);
  }

  /** @param {Mask} mask @param {Box | null} [dirty] only this box changed */
  paint(mask, dirty) {
    const { width, height, data } = mask;
    const fresh = this.fill.width !== width || this.fill.height !== height;
    if (fresh) {
      for (const canvas of [this.fill, this.rim, this.alone]) {
        canvas.width = width;
        canvas.height = height;
      }
    }
    const all = { x0: 0, y0: 0, x1: width, y1: height };
    const grown = dirty && !fresh
      ? { x0: dirty.x0 - 1, y0: dirty.y0 - 1, x1: dirty.x1 + 1, y1: dirty.y1 + 1 }
      : all;
    const box = clip(mask, grown);
    if (!box) return;
    const w = box.x1 - box.x0;
    const h = box.y1 - box.y0;
    const fill = new ImageData(w, h);
    const rim = new ImageData(w, h);
    const alone = new ImageData(w, h);
    const [red, green, blue] = COLOUR;
    for (let y = box.y0, o = 0; y < box.y1; y++) {
      for (let x = box.x0; x < box.x1; x++, o += 4) {
        const i = y * width + x;
        const set = data[i];
        alone.data[o] = alone.data[o + 1] = alone.data[o + 2] = set ? 255 : 0;
        alone.data[o + 3] = 255;
        if (!set) continue;
        fill.data[o] = red;
        fill.data[o + 1] = green;
        fill.data[o + 2] = blue;
        fill.data[o + 3] = 255;
        const inner = x > 0 && data[i - 1] && x < width - 1 && data[i + 1] &&
          y > 0 && data[i - width] && y < height - 1 && data[i + width];
        if (inner) continue;
        rim.data[o] = red;
        rim.data[o + 1] = green;
        rim.data[o + 2] = blue;
        rim.data[o + 3] = 255;
      }
    }
    const layers = /** @type {const} */ ([[this.fill, fill], [this.rim, rim], [this.alone, alone]]);
    for (const [canvas, pixels] of layers) {
      canvas.getContext("2d")?.putImageData(pixels, box.x0, box.y0);
    }
  }
}
