/**
 * The click tool: positive and negative clicks and a box on one object, candidates from the server,
 * of which one is offered until it is taken or given up. Nothing of the mask changes before that.
 * A first click on a part of the mask corrects that part.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {{x: number, y: number}} Point
 * @typedef {"live" | "reference"} Picture
 * @typedef {{mask: Mask | null, counts: string, score: number, width: number, height: number}} Found
 *   mask: once it was asked for
 * @typedef {import("../wire.js").ClickReply} Reply
 */
import { componentAt } from "../cleanup.js";
import { decode, encode } from "../rle.js";

const DRAG_PX = 5;
const HOVER_MS = 90;
const PATIENCE_MS = 300;

export class Pointing {
  /** @param {{ask: (body: object, signal: AbortSignal) => Promise<Reply>,
   *   locate: (at: Point) => Promise<Point>, mask: () => Mask, changed: () => void,
   *   notice: (text: string, bad?: boolean) => void, waiting: (text: string) => void}} on
   *   locate: where a point of the reference as it was taken lies in the live image;
   *   mask: the layer that is drawn, as it is now */
  constructor(on) {
    this.on = on;
    this.name = "click";
    this.multi = true;
    this.floats = true;
    this.done = false;
    /** It draws no outline. @type {Point[]} */
    this.points = [];
    /** Counts what was begun, so that a place that comes too late is dropped. */
    this.begun = 0;
    /** @type {AbortController | null} */
    this.request = null;
    this.index = 0;
    /** @type {any} */
    this.hovering = 0;
    this.reset();
  }

  reset() {
    this.request?.abort();
    this.request = null;
    this.begun++;
    /** @type {{x: number, y: number, positive: boolean}[]} */
    this.clicks = [];
    /** @type {number[] | null} x0, y0, x1, y1 */
    this.box = null;
    /** @type {Found[]} */
    this.found = [];
    this.index = 0;
    this.model = "";
    /** @type {Picture} */
    this.picture = "live";
    this.crop = false;
    /** @type {Uint8Array | null} the part of the mask that is corrected */
    this.part = null;
    /** @type {{at: Point, to: Point, positive: boolean, crop: boolean, picture: Picture, scale: number} | null} */
    this.pressed = null;
    /** @type {Mask | null} what a click here would find */
    this.preview = null;
    clearTimeout(this.hovering);
  }

  /** Whether there is something to take or give up. */
  get open() {
    return this.clicks.length > 0 || this.box !== null;
  }

  /** @returns {Found | null} */
  get chosen() {
    return this.found[this.index] ?? null;
  }

  /** The pixels of the chosen candidate. @returns {Mask | null} */
  get mask() {
    const { chosen } = this;
    if (chosen) chosen.mask ??= decode(chosen.counts, chosen.width, chosen.height);
    return chosen?.mask ?? null;
  }

  /** What is offered. @returns {import("./hand.js").Suggestion} */
  get suggestion() {
    const { clicks, box, found, index, chosen, dragged, open } = this;
    return {
      candidate: open || dragged
        ? { points: clicks, box: box ?? dragged, count: found.length, index, score: chosen?.score ?? 0 } : null,
      mask: this.mask ?? (open ? null : this.preview),
      asking: open && this.request !== null,
    };
  }

  /** @param {Mask} mask @param {Point} at @param {import("./hand.js").Options} options */
  enter(mask, at, options) {
    if (options.picture === "raw reference") this.enterElsewhere(at, options);
    else this.press(at, options);
    return null;
  }

  /** @param {Point} at @param {import("./hand.js").Options} options */
  press(at, { right, subtract, line, picture, scale }) {
    this.pressed = { at, to: at, positive: !right && !subtract, crop: line, picture: frameOf(picture), scale };
  }

  /** The reference as it was taken has a frame of its own: its click belongs elsewhere in the live one.
   * @param {Point} at @param {import("./hand.js").Options} options */
  async enterElsewhere(at, options) {
    const { begun } = this;
    this.pressed = null;
    try {
      const there = await this.on.locate(at);
      if (begun !== this.begun) return;
      this.press(there, options);
      // It may have been cleaned up meanwhile.
      await this.release(this.on.mask());
    } catch (error) {
      this.on.notice(error instanceof Error ? error.message : String(error), true);
    }
  }

  /** @param {Mask} _mask @param {Point} at */
  move(_mask, at) {
    if (this.pressed) this.pressed.to = at;
    return null;
  }

  /** What is offered becomes part of the mask. @param {Mask} _mask
   * @param {string} [way] "reject" gives it up @returns {import("./hand.js").Made | null} */
  complete(_mask, way = "add") {
    const { mask, part, story } = this;
    this.reset();
    // A corrected part gives way to the candidate.
    return mask && way !== "reject" ? { pixels: mask.data, part: way === "add" ? part : null, story } : null;
  }

  /** Give it up. */
  cancel() {
    this.reset();
    return null;
  }

  /** The box that is being dragged. @returns {number[] | null} */
  get dragged() {
    if (!this.pressed) return null;
    const { at, to, scale } = this.pressed;
    if (Math.max(Math.abs(to.x - at.x), Math.abs(to.y - at.y)) * scale < DRAG_PX) return null;
    return [Math.min(at.x, to.x), Math.min(at.y, to.y), Math.max(at.x, to.x), Math.max(at.y, to.y)];
  }

  /** The pointer was released: a click or a box. @param {Mask} mask */
  async release(mask) {
    const { pressed, dragged } = this;
    this.pressed = null;
    if (!pressed) return;
    const inside = (/** @type {number} */ v, /** @type {number} */ most) => Math.min(Math.max(v, 0), most);
    if (dragged) {
      const [x0, y0, x1, y1] = dragged;
      this.box = [inside(x0, mask.width), inside(y0, mask.height), inside(x1, mask.width), inside(y1, mask.height)];
    } else {
      const at = { x: inside(pressed.at.x, mask.width - 0.01), y: inside(pressed.at.y, mask.height - 0.01) };
      if (!this.open) this.part = componentAt(mask, at);
      if (!this.open && !pressed.positive && !this.part) {
        return this.on.notice("There is nothing to take away here. Click an object first.");
      }
      this.clicks.push({ ...at, positive: pressed.positive });
    }
    this.picture = pressed.picture;
    this.crop = pressed.crop;
    await this.find(mask);
  }

  /** @param {Mask} mask */
  async find(mask) {
    this.request?.abort();
    this.preview = null;
    clearTimeout(this.hovering);
    const request = new AbortController();
    this.request = request;
    const slow = setTimeout(() => this.on.waiting("Finding the object…"), PATIENCE_MS);
    const { chosen, part } = this;
    const previous = chosen ? { counts: chosen.counts, score: chosen.score }
      : part && { counts: encode({ ...mask, data: part }), score: 0 };
    // The question goes out before the click is drawn.
    const asked = this.on.ask({ picture: this.picture, clicks: this.clicks, box: this.box,
      previous: previous || null, crop: this.crop }, request.signal);
    this.on.changed();
    try {
      const reply = await asked;
      if (request !== this.request) return;
      this.model = reply.model;
      const { width, height } = mask;
      this.found = reply.candidates.map((candidate) => ({ ...candidate, width, height, mask: null }));
      this.index = 0;
    } catch (error) {
      if (request.signal.aborted) return;
      this.clicks.pop();
      if (!this.clicks.length) this.reset();
      this.on.notice(error instanceof Error ? error.message : String(error), true);
    } finally {
      clearTimeout(slow);
      if (request === this.request) {
        this.request = null;
        this.on.waiting("");
      }
    }
    this.on.changed();
  }

  /** Offer the next candidate. @param {number} by @returns {boolean} whether there is any */
  cycle(by) {
    const count = this.found.length;
    if (!count) return false;
    this.index = (this.index + by + count) % count;
    this.on.changed();
    return true;
  }

  /** The pointer rests or moves: show what a click would find, when nothing else is asked.
   * @param {Mask} mask @param {Point} at @param {string} picture */
  hover(mask, at, picture) {
    if (picture === "raw reference") return;
    clearTimeout(this.hovering);
    if (this.open || this.request) return;
    this.hovering = setTimeout(async () => {
      const request = new AbortController();
      this.request = request;
      const reply = await this.on.ask({ picture: frameOf(picture), clicks: [{ ...at, positive: true }], preview: true },
        request.signal).catch(() => null);
      if (request !== this.request) return;
      this.request = null;
      this.preview = reply && decode(reply.candidates[0].counts, mask.width, mask.height);
      this.on.changed();
    }, HOVER_MS);
  }

  /** The pointer left: nothing is hovered any more. */
  leave() {
    clearTimeout(this.hovering);
    if (this.preview) {
      this.preview = null;
      this.on.changed();
    }
  }

  /** What the accepted candidate is for the tool log. */
  get story() {
    const round = (/** @type {number} */ v) => Math.round(v * 10) / 10;
    return {
      clicks: this.clicks.map(({ x, y, positive }) => [round(x), round(y), positive ? 1 : 0]),
      ...(this.box ? { box: this.box.map(round) } : {}),
      picture: this.picture,
      model: this.model,
      candidate: this.index,
      score: Math.round((this.chosen?.score ?? 0) * 1000) / 1000,
      ...(this.crop ? { crop: true } : {}),
    };
  }
}

/** The image that a click on a picture means. @param {string} picture @returns {Picture} */
const frameOf = (picture) => (picture === "live" ? "live" : "reference");
