/**
 * The audit mode's way: from region to region across pairs, most doubtful first.
 * @typedef {import("./wire.js").DoubtfulRegionInfo} Stop
 */
import { api } from "./api.js";

export class AuditWalk {
  constructor() {
    /** @type {Stop[]} */
    this.stops = [];
    this.place = -1;
    /** @type {string | null} */
    this.run = null;
  }

  /** Read the regions that wait for a verdict.
   * @param {string | null} run @param {string} order @param {string} opinion */
  async begin(run, order, opinion) {
    this.stops = await api.auditQueue(run, order, opinion);
    this.place = -1;
    this.run = run;
  }

  /** @param {number} by @returns {Stop | null} the next stop, null at either end */
  step(by) {
    const place = this.place + by;
    if (place < 0 || place >= this.stops.length) return null;
    this.place = place;
    return this.stops[place];
  }

  /** Go to a region that the walk has. @param {number} region @returns {Stop | null} */
  find(region) {
    const place = this.stops.findIndex((stop) => stop.region === region);
    if (place < 0) return null;
    this.place = place;
    return this.stops[place];
  }

  /** Leave out the regions of a pair. @param {number} pair */
  leave(pair) {
    const kept = (/** @type {Stop} */ stop) => stop.pair !== pair;
    this.place = this.stops.slice(0, this.place + 1).filter(kept).length - 1;
    this.stops = this.stops.filter(kept);
  }

  /** "3 of 120", and why this one comes here @returns {string} */
  get progress() {
    const stop = this.stops[this.place];
    if (!stop) return "";
    const why = stop.opposed ? ", opposed"
      : stop.gain_px !== null && stop.gain_px > 0 ? `, flipping gains ${stop.gain_px} px` : "";
    return `${this.place + 1} of ${this.stops.length}${why}`;
  }
}
