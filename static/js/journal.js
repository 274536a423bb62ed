/**
 * What must survive a reload or a crash, in IndexedDB, a database for each person and store: the
 * queue of actions that the server has not acknowledged, in order, and the undo history of pairs.
 * @typedef {import("./saver.js").Change} Change
 * @typedef {import("./history.js").Entry} Entry
 * @typedef {{done: number, total: number, mask: string, ignore: string}} Head where a pair's history
 *   stands, and the run-lengths of its layers there
 */

const VERSION = 1;

export class Journal {
  /** @param {IDBDatabase} db */
  constructor(db) {
    this.db = db;
  }

  /** @param {string} owner store and person @returns {Promise<Journal>} */
  static async open(owner) {
    const request = indexedDB.open(`reviewer.${owner}`, VERSION);
    request.onupgradeneeded = () => {
      const { result } = request;
      result.createObjectStore("queue", { keyPath: ["seq", "tab"] });
      result.createObjectStore("patches");
      result.createObjectStore("heads");
    };
    return new Journal(await settled(request));
  }

  /** Return what is not acknowledged, oldest first. @returns {Promise<Change[]>} */
  queue() {
    return settled(this.db.transaction("queue").objectStore("queue").getAll());
  }

  /** @param {Change} change new, or with another revision */
  put(change) {
    return this.write(["queue"], (store) => store("queue").put(change));
  }

  /** @param {Change[]} changes acknowledged, or given up */
  drop(changes) {
    return this.write(["queue"], (store) => changes.forEach(({ seq, tab }) => store("queue").delete([seq, tab])));
  }

  /** Keep where a pair's history stands, and its newest entry; what was undone before is gone.
   * @param {number} pair @param {Head} head @param {Entry | null} patch */
  remember(pair, head, patch) {
    return this.write(["patches", "heads"], (store) => {
      if (patch) {
        store("patches").delete(IDBKeyRange.bound([pair, head.done - 1], [pair, Infinity]));
        store("patches").put(patch, [pair, head.done - 1]);
      }
      store("heads").put(head, pair);
    });
  }

  /** Return the history of a pair, if it led to these layers; one that led elsewhere is dropped.
   * @param {number} pair @param {string} mask @param {string} ignore run-lengths
   * @returns {Promise<{done: Entry[], undone: Entry[]}>} */
  async recall(pair, mask, ignore) {
    const transaction = this.db.transaction(["patches", "heads"]);
    const range = IDBKeyRange.bound([pair, 0], [pair, Infinity]);
    const [head, patches] = await Promise.all([
      settled(transaction.objectStore("heads").get(pair)),
      settled(transaction.objectStore("patches").getAll(range)),
    ]);
    const fits = head?.mask === mask && head.ignore === ignore && patches.length === head.total;
    if (!fits) {
      if (head) await this.forget(pair);
      return { done: [], undone: [] };
    }
    return { done: patches.slice(0, head.done), undone: patches.slice(head.done).reverse() };
  }

  /** @param {number} pair */
  forget(pair) {
    return this.write(["patches", "heads"], (store) => {
      store("patches").delete(IDBKeyRange.bound([pair, 0], [pair, Infinity]));
      store("heads").delete(pair);
    });
  }

  /** @param {string[]} names @param {(store: (name: string) => IDBObjectStore) => void} work
   * @returns {Promise<void>} when it is written */
  write(names, work) {
    const transaction = this.db.transaction(names, "readwrite", { durability: "relaxed" });
    work((name) => transaction.objectStore(name));
    transaction.commit();
    return new Promise((done, fail) => {
      transaction.oncomplete = () => done();
      transaction.onerror = transaction.onabort = () => fail(transaction.error);
    });
  }
}

/** @template T @param {IDBRequest<T>} request @returns {Promise<T>} */
function settled(request) {
  return new Promise((done, fail) => {
    request.onsuccess = () => done(request.result);
    request.onerror = () => fail(request.error);
  });
}
