/**
 * Magnetic lasso: clicks set anchors, and the outline between them follows edges. The paths come
 * from the server (intelligent scissors); until one is there, or where none can be had, the line is
 * straight. Closed as a polygon is.
 * @typedef {import("./hand.js").Point} Point
 * @typedef {import("../raster.js").Mask} Mask
 */
import { fillPolygon } from "../fill.js";

const CLOSE_PX = 8;

export class Magnetic {
  /** @param {(from: Point, to: Point) => Promise<Point[]>} path @param {() => void} changed */
  constructor(path, changed) {
    this.name = "magnetic";
    this.multi = true;
    this.path = path;
    this.changed = changed;
    this.request = 0;
    this.done = false;
    this.reset();
  }

  reset() {
    /** @type {Point[]} outline up to the last anchor */
    this.fixed = [];
    /** @type {Point[]} from there to the pointer */
    this.loose = [];
    this.subtract = false;
    this.done = false;
    this.request++;
    this.asking = false;
    /** @type {Point | null} where the pointer was last */
    this.wanted = null;
  }

  get points() {
    return [...this.fixed, ...this.loose];
  }

  /** @param {Mask} _mask @param {Point} at @param {import("./hand.js").Options} options */
  enter(_mask, at, options) {
    const [first] = this.fixed;
    if (!first) {
      this.reset();
      this.subtract = options.subtract;
      this.fixed = [at];
      return null;
    }
    const end = this.loose.at(-1);
    const arrived = end && Math.hypot(end.x - at.x, end.y - at.y) < 2;
    this.fixed.push(...(arrived ? this.loose : [at]));
    this.loose = [];
    this.wanted = null;
    this.request++;
    const near = Math.hypot(first.x - at.x, first.y - at.y) * options.scale < CLOSE_PX;
    this.done = near && this.fixed.length > 3;
    return null;
  }

  /** @param {Mask} _mask @param {Point} at */
  move(_mask, at) {
    if (!this.fixed.length || this.done) return null;
    this.wanted = at;
    if (!this.loose.length) this.loose = [at];
    this.follow();
    return null;
  }

  /** Ask for the path to the pointer, one request at a time, the newest place each time. */
  async follow() {
    const to = this.wanted;
    const from = this.fixed.at(-1);
    if (this.asking || !to || !from) return;
    this.asking = true;
    const { request } = this;
    const points = await this.path(from, to).catch(() => [to]);
    this.asking = false;
    if (request === this.request && this.fixed.length) {
      this.loose = points;
      this.changed();
    }
    if (this.wanted !== to) this.follow();
  }

  /** Close the outline and fill it. @param {Mask} mask */
  complete(mask) {
    const points = this.fixed;
    const { subtract } = this;
    this.reset();
    if (points.length < 3) return null;
    const before = { width: mask.width, height: mask.height, data: mask.data.slice() };
    return { before, box: fillPolygon(mask, points, subtract ? 0 : 1), samples: points.length };
  }

  /** Give the outline up. */
  cancel() {
    this.reset();
    return null;
  }
}
