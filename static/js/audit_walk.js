/**
 * The audit mode's way: from region to region across pairs, most doubtful first.
 * @typedef {{region: number, pair: number}} Stop
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

  /** Read the regions that nobody judged yet. @param {string | null} run */
  async begin(run) {
    this.stops = await api.auditQueue(run);
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

  /** "3 of 120" @returns {string} */
  get progress() {
    return this.stops.length ? `${this.place + 1} of ${this.stops.length}` : "";
  }
}
