/**
 * Brush and eraser: a small state machine, idle -> dragging -> idle. Escape takes the stroke in the
 * air back. One entry of the history a stroke. With Shift a straight line comes from where the last
 * stroke ended.
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
    /** @type {Point | null} where the last stroke ended */
    this.ended = null;
    /** @type {Point[]} */
    this.points = [];
    this.done = true;
    this.multi = false;
  }

  /** @param {Mask} mask @param {Point} at @param {import("./hand.js").Options} options
   * @returns {Box | null} */
  enter(mask, at, { radius, line }) {
    const before = { width: mask.width, height: mask.height, data: mask.data.slice() };
    const from = line && this.ended ? this.ended : at;
    const box = paintSegment(mask, from, at, radius, this.value);
    this.stroke = { before, last: at, box, samples: 1 };
    return box;
  }

  /** @param {Mask} mask @param {Point} at @param {import("./hand.js").Options} options
   * @returns {Box | null} */
  move(mask, at, { radius }) {
    if (!this.stroke) return null;
    const box = paintSegment(mask, this.stroke.last, at, radius, this.value);
    this.stroke.last = at;
    this.stroke.box = join(this.stroke.box, box);
    this.stroke.samples++;
    return box;
  }

  /** End the stroke. @returns {{before: Mask, box: Box | null, samples: number} | null} */
  complete() {
    const stroke = this.stroke;
    this.stroke = null;
    if (stroke) this.ended = stroke.last;
    return stroke;
  }

  /** Take the stroke back. @param {Mask} mask @returns {Box | null} */
  cancel(mask) {
    const stroke = this.complete();
    if (!stroke || !stroke.box) return null;
    pasteBox(mask, stroke.box, copyBox(stroke.before, stroke.box));
    return stroke.box;
  }
}

/** Whether a tool has a size. @param {string} tool */
export function keepsRadius(tool) {
  return tool === "brush" || tool === "eraser";
}
