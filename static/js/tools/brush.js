/**
 * Brush and eraser: a small state machine, idle -> dragging -> idle. Escape takes the stroke in the
 * air back. One entry of the history a stroke.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {import("../raster.js").Box} Box
 * @typedef {{x: number, y: number}} Point
 */
import { copyBox, join, paintSegment, pasteBox } from "../raster.js";

export class Brush {
  /** @param {0 | 1} value 1 paints, 0 erases */
  constructor(value) {
    this.name = value ? "brush" : "eraser";
    this.value = value;
    /** @type {{before: Mask, last: Point, box: Box | null, samples: number} | null} */
    this.stroke = null;
  }

  get dragging() {
    return this.stroke !== null;
  }

  /** @param {Mask} mask @param {Point} at @param {number} radius @returns {Box | null} */
  begin(mask, at, radius) {
    const before = { width: mask.width, height: mask.height, data: mask.data.slice() };
    const box = paintSegment(mask, at, at, radius, this.value);
    this.stroke = { before, last: at, box, samples: 1 };
    return box;
  }

  /** @param {Mask} mask @param {Point} at @param {number} radius @returns {Box | null} */
  move(mask, at, radius) {
    if (!this.stroke) return null;
    const box = paintSegment(mask, this.stroke.last, at, radius, this.value);
    this.stroke.last = at;
    this.stroke.box = join(this.stroke.box, box);
    this.stroke.samples++;
    return box;
  }

  /** End the stroke. @returns {{before: Mask, box: Box | null, samples: number} | null} */
  end() {
    const stroke = this.stroke;
    this.stroke = null;
    return stroke;
  }

  /** Take the stroke back. @param {Mask} mask @returns {Box | null} */
  cancel(mask) {
    const stroke = this.end();
    if (!stroke || !stroke.box) return null;
    pasteBox(mask, stroke.box, copyBox(stroke.before, stroke.box));
    return stroke.box;
  }
}
