/**
 * Autosave: every finished action is sent at once, one request at a time, with the revision it
 * started from. What is not acknowledged stays in localStorage and is sent again: after an outage,
 * and after a reload. A conflict stops the line until the person has chosen.
 * @typedef {{id: number, revision: number, width: number, height: number, counts: string,
 *   log: object[], seconds: number}} Unsent
 */
import { ApiError } from "./api.js";

const PREFIX = "reviewer.unsent.";
const WAITS = [1000, 2000, 4000, 8000];

export class Saver {
  /**
   * @param {{put: (id: number, revision: number, change: object) => Promise<{revision: number}>,
   *   storage: Storage, status: (status: string, detail?: string) => void,
   *   saved: (id: number, revision: number) => void}} parts
   */
  constructor(parts) {
    this.parts = parts;
    /** @type {Map<number, Unsent>} */
    this.waiting = new Map();
    /** @type {Unsent | null} what the request in flight carries */
    this.flying = null;
    this.stopped = false;
    this.failures = 0;
    /** @type {any} */
    this.timer = 0;
  }

  /** Hand in the mask after an action. @param {Unsent} change */
  save(change) {
    const earlier = this.waiting.get(change.id);
    const merged = earlier
      ? { ...change, log: [...earlier.log, ...change.log], seconds: earlier.seconds + change.seconds }
      : change;
    this.waiting.set(change.id, merged);
    this.keep(merged);
    this.parts.status("saving");
    this.pump();
  }

  /** What a pair has unsent, also from before a reload. @param {number} id @returns {Unsent | null} */
  unsent(id) {
    const text = this.parts.storage.getItem(PREFIX + id);
    return this.waiting.get(id) ?? (text ? JSON.parse(text) : null);
  }

  get idle() {
    return !this.flying && this.waiting.size === 0;
  }

  /** Go on after a conflict: send again from another revision, or give the change up.
   * @param {number} id @param {number | null} revision null gives it up */
  resolve(id, revision) {
    const change = this.waiting.get(id);
    if (revision === null || !change) {
      this.waiting.delete(id);
      this.parts.storage.removeItem(PREFIX + id);
    } else {
      this.waiting.set(id, { ...change, revision });
    }
    this.stopped = false;
    this.parts.status(this.idle ? "saved" : "saving");
    this.pump();
  }

  /** Try now what waits for its turn. */
  retry() {
    if (!this.timer) return;
    clearTimeout(this.timer);
    this.timer = 0;
    this.stopped = false;
    this.pump();
  }

  /** @param {Unsent} change */
  keep(change) {
    this.parts.storage.setItem(PREFIX + change.id, JSON.stringify(change));
  }

  async pump() {
    if (this.flying || this.stopped) return;
    const next = this.waiting.values().next();
    if (next.done) return;
    const change = next.value;
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
    if (!this.flying) this.pump();
  }

  /** @param {Unsent} change @param {number} revision */
  acknowledge(change, revision) {
    this.flying = null;
    this.failures = 0;
    const later = this.waiting.get(change.id);
    if (later) {
      const moved = { ...later, revision };
      this.waiting.set(change.id, moved);
      this.keep(moved);
    } else {
      this.parts.storage.removeItem(PREFIX + change.id);
    }
    this.parts.saved(change.id, revision);
    if (this.idle) this.parts.status("saved");
  }

  /** @param {Unsent} change @param {unknown} error */
  refuse(change, error) {
    const later = this.waiting.get(change.id);
    const again = later
      ? { ...later, revision: change.revision, log: [...change.log, ...later.log],
          seconds: change.seconds + later.seconds }
      : change;
    this.waiting.set(change.id, again);
    this.keep(again);
    this.flying = null;
    if (error instanceof ApiError && error.status < 500 && error.status !== 401) {
      this.stopped = true;
      this.parts.status(error.status === 409 ? "conflict" : "refused", error.message);
      return;
    }
    const signedOut = error instanceof ApiError && error.status === 401;
    this.parts.status("offline", signedOut ? "signed out: sign in again in another tab" : "");
    this.stopped = true;
    this.timer = setTimeout(() => this.retry(), WAITS[Math.min(this.failures++, WAITS.length - 1)]);
  }
}
