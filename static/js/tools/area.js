/**
 * Tools that mark an area and fill it when it is closed: lasso and box (drag), polygon (clicks). The
 * mask does not change before that; `points` is the outline so far, which the view shows.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {import("../raster.js").Box} Box
 * @typedef {import("./hand.js").Point} Point
 * @typedef {import("./hand.js").Options} Options
 */
import { fillPolygon } from "../fill.js";

const CLOSE_PX = 8;

export class Area {
  /** @param {"lasso" | "box" | "polygon"} name */
  constructor(name) {
    this.name = name;
    /** Whether it goes on between presses. */
    this.multi = name === "polygon";
    /** @type {Point[]} */
    this.points = [];
    this.subtract = false;
    this.finished = false;
  }

  /** @param {Mask} _mask @param {Point} at @param {Options} options @returns {Box | null} */
  enter(_mask, at, options) {
    if (this.name !== "polygon" || !this.points.length) {
      this.points = [at];
      this.finished = false;
      this.subtract = options.subtract;
      if (this.name === "polygon") this.points.push(at);
      return null;
    }
    const [first] = this.points;
    const near = Math.hypot(first.x - at.x, first.y - at.y) * options.scale < CLOSE_PX;
    if (near && this.points.length > 3) this.finished = true;
    else this.points.push(at);
    return null;
  }

  /** @param {Mask} _mask @param {Point} at @returns {Box | null} */
  move(_mask, at) {
    const [first] = this.points;
    if (this.name === "lasso") this.points.push(at);
    else if (this.name === "polygon") this.points[this.points.length - 1] = at;
    else this.points = [first, { x: at.x, y: first.y }, at, { x: first.x, y: at.y }];
    return null;
  }

  /** The pointer was released: a lasso or a box is complete, a polygon waits for its next corner. */
  get done() {
    return this.name !== "polygon" || this.finished;
  }

  /** Close the outline and fill it. @param {Mask} mask
   * @returns {{before: Mask, box: Box | null, samples: number} | null} */
  complete(mask) {
    const points = this.name === "polygon" ? this.points.slice(0, -1) : this.points;
    this.points = [];
    this.finished = false;
    if (points.length < 3) return null;
    const before = { width: mask.width, height: mask.height, data: mask.data.slice() };
    const box = fillPolygon(mask, points, this.subtract ? 0 : 1);
    return { before, box, samples: points.length };
  }

  /** Give the outline up. @returns {Box | null} */
  cancel() {
    this.points = [];
    this.finished = false;
    return null;
  }
}
