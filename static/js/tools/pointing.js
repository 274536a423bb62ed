/**
 * The click tool: positive and negative clicks and a box on one object, candidates from the server,
 * of which one is shown until it is accepted or given up. Nothing of the mask changes before that.
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
  /** @param {{ask: (body: object, signal: AbortSignal) => Promise<Reply>, changed: () => void,
   *   notice: (text: string, bad?: boolean) => void, waiting: (text: string) => void}} on */
  constructor(on) {
    this.on = on;
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
    /** @type {{x: number, y: number, positive: boolean}[]} */
    this.points = [];
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

  /** Whether there is something to accept or give up. */
  get open() {
    return this.points.length > 0 || this.box !== null;
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

  /** @param {Point} at @param {{right: boolean, alt: boolean, shift: boolean}} keys
   * @param {Picture} picture @param {number} scale screen pixels a pixel */
  press(at, keys, picture, scale) {
    this.pressed = { at, to: at, positive: !keys.right && !keys.alt, crop: keys.shift, picture, scale };
  }

  /** @param {Point} at */
  drag(at) {
    if (this.pressed) this.pressed.to = at;
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
      this.points.push({ ...at, positive: pressed.positive });
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
    const asked = this.on.ask({ picture: this.picture, clicks: this.points, box: this.box,
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
      this.points.pop();
      if (!this.points.length) this.reset();
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

  /** Show the next candidate. @param {number} by */
  cycle(by) {
    const count = this.found.length;
    if (!count) return;
    this.index = (this.index + by + count) % count;
    this.on.changed();
  }

  /** The pointer rests or moves: show what a click would find, when nothing else is asked.
   * @param {Point} at @param {Picture} picture @param {Mask} mask */
  hover(at, picture, mask) {
    clearTimeout(this.hovering);
    if (this.open || this.request) return;
    this.hovering = setTimeout(async () => {
      const request = new AbortController();
      this.request = request;
      const reply = await this.on.ask({ picture, clicks: [{ ...at, positive: true }], preview: true },
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
      clicks: this.points.map(({ x, y, positive }) => [round(x), round(y), positive ? 1 : 0]),
      ...(this.box ? { box: this.box.map(round) } : {}),
      picture: this.picture,
      model: this.model,
      candidate: this.index,
      score: Math.round((this.chosen?.score ?? 0) * 1000) / 1000,
      ...(this.crop ? { crop: true } : {}),
    };
  }
}
