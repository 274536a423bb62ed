/**
 * Flood fill with tolerance on the live picture: one click, one action. The pixels are passed in.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {import("../raster.js").Box} Box
 */
import { floodFill } from "../fill.js";

export class Bucket {
  /** @param {() => Uint8ClampedArray | null} pixels RGBA of the live picture @param {() => number} tolerance */
  constructor(pixels, tolerance) {
    this.name = "fill";
    this.pixels = pixels;
    this.tolerance = tolerance;
    this.points = [];
    this.done = true;
    this.multi = false;
    /** @type {{before: Mask, box: Box | null, samples: number} | null} */
    this.stroke = null;
  }

  /** @param {Mask} mask @param {{x: number, y: number}} at @param {import("./hand.js").Options} options */
  enter(mask, at, options) {
    const pixels = this.pixels();
    if (!pixels) return null;
    const before = { width: mask.width, height: mask.height, data: mask.data.slice() };
    const box = floodFill(mask, pixels, at, this.tolerance(), options.subtract ? 0 : 1);
    this.stroke = { before, box, samples: 1 };
    return box;
  }

  move() {
    return null;
  }

  complete() {
    const { stroke } = this;
    this.stroke = null;
    return stroke;
  }

  /** @param {Mask} mask @returns {Box | null} */
  cancel(mask) {
    const stroke = this.complete();
    if (stroke?.box) mask.data.set(stroke.before.data);
    return stroke?.box ?? null;
  }
}
