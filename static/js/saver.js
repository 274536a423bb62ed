/**
 * Autosave: every finished action is sent at once, one request at a time, with the revision it
 * started from. What is not acknowledged stays in localStorage, under the database, the person and
 * the pair, and is sent again: after an outage, and after a reload. A change that the server refuses
 * is parked until somebody decides about it; other pairs go on.
 * @typedef {{id: number, revision: number, width: number, height: number, counts: string,
 *   log: object[], seconds: number}} Unsent
 * @typedef {"saved" | "saving" | "offline" | "conflict" | "locked" | "refused"} Status
 */
import { ApiError } from "./api.js";

const WAITS = [1000, 2000, 4000, 8000];
const LONGEST_LOG = 500;
/** @type {Record<number, Status>} */
const REFUSALS = { 409: "conflict", 423: "locked" };

export class Saver {
  /**
   * @param {{put: (id: number, revision: number, change: object) => Promise<{revision: number}>,
   *   storage: Storage, status: (status: Status, detail: string, id: number) => void,
   *   saved: (id: number, revision: number) => void}} parts
   */
  constructor(parts) {
    this.parts = parts;
    this.prefix = "";
    /** @type {Map<number, Unsent>} */
    this.waiting = new Map();
    /** @type {Map<number, Status>} pairs that wait for a decision */
    this.parked = new Map();
    /** @type {Map<number, number>} newest acknowledged revision of a pair */
    this.newest = new Map();
    /** @type {Unsent | null} what the request in flight carries */
    this.flying = null;
    this.failures = 0;
    /** @type {any} runs while the server cannot be reached */
    this.timer = 0;
  }

  /** Say whose work this is, and send what is left from before. @param {string} owner */
  begin(owner) {
    this.prefix = `reviewer.unsent.${owner}.`;
    const { storage } = this.parts;
    const keys = Array.from({ length: storage.length }, (_, k) => storage.key(k) ?? "");
    for (const key of keys.filter((name) => name.startsWith(this.prefix))) {
      const change = JSON.parse(storage.getItem(key) ?? "null");
      if (change && !this.waiting.has(change.id)) this.waiting.set(change.id, change);
    }
    if (!this.idle) this.parts.status("saving", "", 0);
    this.pump();
    return this.waiting.size;
  }

  /** Hand in the mask after an action. @param {Unsent} change */
  save(change) {
    this.put(merge(this.waiting.get(change.id), change));
    if (!this.parked.has(change.id)) this.parts.status("saving", "", change.id);
    this.pump();
  }

  /** What a pair has that is not acknowledged. @param {number} id @returns {Unsent | null} */
  unsent(id) {
    return this.waiting.get(id) ?? (this.flying?.id === id ? this.flying : null);
  }

  get idle() {
    return !this.flying && this.waiting.size === 0;
  }

  /** Decide about a parked pair: send again from a revision, or (null) give the change up.
   * @param {number} id @param {number | null} revision */
  resolve(id, revision) {
    const change = this.waiting.get(id);
    this.parked.delete(id);
    if (revision === null) {
      this.waiting.delete(id);
      this.parts.storage.removeItem(this.prefix + id);
    } else if (change) {
      this.put({ ...change, revision });
    }
    this.parts.status(this.idle ? "saved" : "saving", "", id);
    this.pump();
  }

  /** Try now what waits for the server to come back. */
  retry() {
    if (!this.timer) return;
    clearTimeout(this.timer);
    this.timer = 0;
    this.pump();
  }

  /** @param {Unsent} change */
  put(change) {
    this.waiting.set(change.id, change);
    try {
      this.parts.storage.setItem(this.prefix + change.id, JSON.stringify(change));
    } catch {
      // Storage is full: the change still goes out, it just would not survive a reload.
      this.parts.status("saving", "browser storage is full", change.id);
    }
  }

  async pump() {
    if (this.flying || this.timer) return;
    const change = [...this.waiting.values()].find(({ id }) => !this.parked.has(id));
    if (!change) return;
    this.flying = change;
    this.waiting.delete(change.id);
    try {
      const { id, revision, width, height, counts, log, seconds } = change;
      const reply = await this.parts.put(id, revision, {
        mask: { height, width, counts },
        active_seconds: Math.round(seconds * 10) / 10,
        tool_log: log,
      });
      this.acknowledge(change, reply.revision);
    } catch (error) {
      this.refuse(change, error);
    }
    this.pump();
  }

  /** @param {Unsent} change @param {number} revision */
  acknowledge(change, revision) {
    this.flying = null;
    this.failures = 0;
    this.newest.set(change.id, revision);
    const later = this.waiting.get(change.id);
    if (later) this.put({ ...later, revision });
    else this.parts.storage.removeItem(this.prefix + change.id);
    this.parts.saved(change.id, revision);
    if (this.idle) this.parts.status("saved", "", change.id);
  }

  /** @param {Unsent} change @param {unknown} error */
  refuse(change, error) {
    this.flying = null;
    const later = this.waiting.get(change.id);
    this.put(later ? { ...merge(change, later), revision: change.revision } : change);
    const status = error instanceof ApiError ? error.status : 0;
    if (status >= 400 && status < 500 && status !== 401) {
      const parked = REFUSALS[status] ?? "refused";
      this.parked.set(change.id, parked);
      this.parts.status(parked, /** @type {Error} */ (error).message, change.id);
      return;
    }
    this.parts.status("offline", status === 401 ? "signed out: sign in again in another tab" : "", change.id);
    this.timer = setTimeout(() => this.retry(), WAITS[Math.min(this.failures++, WAITS.length - 1)]);
  }
}

/** The later mask with the actions and the seconds of both.
 * @param {Unsent | undefined} earlier @param {Unsent} later @returns {Unsent} */
function merge(earlier, later) {
  if (!earlier) return later;
  const log = [...earlier.log, ...later.log].slice(-LONGEST_LOG);
  return { ...later, revision: earlier.revision, log, seconds: earlier.seconds + later.seconds };
}
