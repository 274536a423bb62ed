/**
 * Autosave: every finished action is a change of its own, sent at once and in order, one request at
 * a time, with the revision it started from. What is not acknowledged stays in the journal and is
 * sent again: after an outage, and after a reload. A change that the server refuses parks its pair
 * until somebody decides about it; one that the server fails at makes its pair wait, and is sent
 * again by and by. Other pairs go on in both cases.
 * @typedef {{seq: number, tab: string, id: number, revision: number, width: number, height: number,
 *   counts: string, ignore: string | null, log: Record<string, unknown>[], seconds: number}} Change
 *   revision: what it was made from, as far as is known; ignore: null keeps the parent's
 * @typedef {"saved" | "saving" | "offline" | "conflict" | "locked" | "refused" | "not saved"} Status
 */
import { ApiError } from "./api.js";

const PATIENCE_MS = 1500;
const WAITS = [1000, 2000, 4000, 8000];
const PAIR_WAITS = [3000, 10_000, 30_000, 60_000];
/** @type {Record<number, Status>} */
const REFUSALS = { 409: "conflict", 423: "locked" };

export class Saver {
  /**
   * @param {{put: (id: number, revision: number, change: import("./wire.js").MaskChange) => Promise<import("./wire.js").Committed>,
   *   status: (status: Status, detail: string, id: number) => void,
   *   saved: (id: number, revision: number) => void}} parts
   */
  constructor(parts) {
    this.parts = parts;
    /** @type {import("./journal.js").Journal | null} */
    this.journal = null;
    /** @type {Change[]} not acknowledged, oldest first */
    this.waiting = [];
    /** @type {Map<number, Status>} pairs that wait for a decision */
    this.parked = new Map();
    /** @type {Map<number, {timer: any, failures: number, why: string}>} pairs whose change the server
     * failed at; a pair without a timer is due */
    this.failing = new Map();
    /** @type {Map<number, number>} newest acknowledged revision of a pair */
    this.newest = new Map();
    this.tab = crypto.getRandomValues(new Uint32Array(2)).join("-");
    this.flying = false;
    this.failures = 0;
    /** @type {any} runs while the server cannot be reached */
    this.timer = 0;
  }

  /** Take the journal, and send what is left from before.
   * @param {import("./journal.js").Journal} journal @returns {Promise<number>} what was left */
  async begin(journal) {
    this.journal = journal;
    const left = (await journal.queue()).filter((change) => change.tab !== this.tab);
    const others = await livingTabs();
    const mine = left.filter((change) => !others.has(change.tab));
    this.waiting = [...mine, ...this.waiting];
    hold(this.tab);
    for (const change of mine) {
      this.forget([{ ...change }]);
      change.tab = this.tab;
    }
    for (const change of this.waiting) this.keep(change);
    if (mine.length) this.parts.status("saving", "", 0);
    this.pump();
    return mine.length;
  }

  /** Hand in the layers after an action. @param {Omit<Change, "seq" | "tab">} made */
  save(made) {
    const seq = Math.max(Date.now(), (this.waiting.at(-1)?.seq ?? 0) + 1);
    const change = { ...made, seq, tab: this.tab };
    this.waiting.push(change);
    this.keep(change);
    if (!this.held(made.id)) this.parts.status("saving", "", made.id);
    this.pump();
  }

  /** The newest change of a pair that is not acknowledged. @param {number} id */
  unsent(id) {
    return this.waiting.findLast((change) => change.id === id) ?? null;
  }

  /** The revision that a pair's unsent changes started from. @param {number} id */
  base(id) {
    return this.waiting.find((change) => change.id === id)?.revision ?? 0;
  }

  /** Its ignore layer: of the newest unsent change that drew one. @param {number} id */
  unsentIgnore(id) {
    return this.waiting.findLast((change) => change.id === id && change.ignore !== null)?.ignore ?? null;
  }

  /** Wait until the changes of a pair are acknowledged, but not for long.
   * @param {number} id @returns {Promise<boolean>} whether they are */
  async settled(id) {
    const end = performance.now() + PATIENCE_MS;
    while (this.unsent(id) && !this.held(id) && performance.now() < end) {
      await new Promise((done) => setTimeout(done, 15));
    }
    return !this.unsent(id);
  }

  /** Whether a pair's changes are not sent now. @param {number} id */
  held(id) {
    return this.parked.has(id) || Boolean(this.failing.get(id)?.timer);
  }

  get idle() {
    return this.waiting.length === 0;
  }

  /** Whether nothing is left to send but what waits for a decision. */
  get sent() {
    return this.waiting.every(({ id }) => this.parked.has(id));
  }

  /** Decide about a parked pair: send again from a revision, or (null) give its changes up.
   * @param {number} id @param {number | null} revision */
  resolve(id, revision) {
    this.parked.delete(id);
    this.due(id);
    this.failing.delete(id);
    const own = this.waiting.filter((change) => change.id === id);
    if (revision === null) {
      this.waiting = this.waiting.filter((change) => change.id !== id);
      this.forget(own);
    } else if (own.length) {
      own[0].revision = revision;
      this.newest.set(id, revision);
      this.keep(own[0]);
    }
    this.parts.status(this.sent ? "saved" : "saving", "", id);
    this.pump();
  }

  /** Try now what waits for the server to come back. */
  retry() {
    clearTimeout(this.timer);
    this.timer = 0;
    for (const id of this.failing.keys()) this.due(id);
    this.pump();
  }

  /** Let a pair's change be sent again. @param {number} id */
  due(id) {
    const failing = this.failing.get(id);
    clearTimeout(failing?.timer);
    if (failing) failing.timer = 0;
  }

  /** @param {Change} change */
  keep(change) {
    this.journal?.put(change).catch((error) => {
      // Storage is full, say: the change still goes out, it just would not survive a reload.
      this.parts.status("saving", `cannot be kept in this browser, ${error}`, change.id);
    });
  }

  /** @param {Change[]} changes */
  forget(changes) {
    this.journal?.drop(changes).catch((error) => this.parts.status("saving", String(error), 0));
  }

  async pump() {
    if (this.flying || this.timer) return;
    const change = this.waiting.find(({ id }) => !this.held(id));
    if (!change) return this.tellFailing();
    this.flying = true;
    try {
      const { id, revision, width, height, counts, ignore, log, seconds } = change;
      const reply = await this.parts.put(id, Math.max(revision, this.newest.get(id) ?? 0), {
        mask: { height, width, counts },
        ignore,
        active_seconds: Math.round(seconds * 10) / 10,
        tool_log: log,
      });
      this.acknowledge(change, reply.revision);
    } catch (error) {
      this.refuse(change, error);
    }
    this.pump();
  }

  /** @param {Change} change @param {number} revision */
  acknowledge(change, revision) {
    this.flying = false;
    this.failures = 0;
    this.due(change.id);
    this.failing.delete(change.id);
    this.newest.set(change.id, revision);
    this.waiting = this.waiting.filter((each) => each !== change);
    const next = this.waiting.find(({ id }) => id === change.id);
    if (next) {
      next.revision = revision;
      this.keep(next);
    }
    this.forget([change]);
    this.parts.saved(change.id, revision);
    if (this.sent) this.parts.status("saved", "", change.id);
  }

  /** Say which pair the server fails at, when nothing else is to be sent. */
  tellFailing() {
    const [id, failing] = [...this.failing].find(([, { timer }]) => timer) ?? [];
    if (id && failing) this.parts.status("not saved", `tried again by and by; ${failing.why}`, id);
  }

  /** @param {Change} change @param {unknown} error */
  refuse(change, error) {
    this.flying = false;
    const status = error instanceof ApiError ? error.status : 0;
    if (status >= 400 && status < 500 && status !== 401) {
      const parked = REFUSALS[status] ?? "refused";
      this.parked.set(change.id, parked);
      this.parts.status(parked, /** @type {Error} */ (error).message, change.id);
      return;
    }
    if (status >= 500) {
      const failures = (this.failing.get(change.id)?.failures ?? 0) + 1;
      const wait = PAIR_WAITS[Math.min(failures, PAIR_WAITS.length) - 1];
      const timer = setTimeout(() => { this.due(change.id); this.pump(); }, wait);
      this.failing.set(change.id, { timer, failures, why: /** @type {Error} */ (error).message });
      return;
    }
    this.parts.status("offline", status === 401 ? "signed out: sign in again in another tab" : "", change.id);
    this.timer = setTimeout(() => this.retry(), WAITS[Math.min(this.failures++, WAITS.length - 1)]);
  }
}

const LOCK = "reviewer.tab.";

/** Say that this tab lives, as long as it does: its changes are its own to send. @param {string} tab */
function hold(tab) {
  // Without a secure context (plain HTTP to another host) there are no locks.
  navigator.locks?.request(LOCK + tab, () => new Promise(() => {}));
}

/** @returns {Promise<Set<string>>} tabs of this browser that live */
async function livingTabs() {
  const held = (await navigator.locks?.query())?.held ?? [];
  return new Set(held.map((lock) => lock.name?.replace(LOCK, "") ?? ""));
}
