import assert from "node:assert/strict";
import { mock, test } from "node:test";
import fc from "fast-check";

import { ApiError } from "../../static/js/api.js";
import { Saver } from "../../static/js/saver.js";

/** The server's side: it takes a change that was made from the newest revision of its pair, and
 * fails as it is told. */
class Server {
  constructor() {
    /** @type {Map<number, number[]>} numbers of the actions that were taken, by pair */
    this.taken = new Map();
    /** What the next requests meet: "away", or the status of a refusal; null for nothing. */
    this.failures = [];
    this.flying = 0;
    this.sent = [];
  }

  revision(id) {
    return this.taken.get(id)?.length ?? 0;
  }

  async put(id, revision, change) {
    assert.equal(++this.flying, 1, "one request at a time");
    await Promise.resolve();
    this.flying--;
    const [{ n }] = change.tool_log;
    this.sent.push(n);
    const failure = this.failures.shift() ?? null;
    if (failure === "away") throw new Error("fetch failed");
    if (failure !== null) throw new ApiError(failure, `status ${failure}`);
    if (revision !== this.revision(id)) throw new ApiError(409, "newer");
    this.taken.set(id, [...this.taken.get(id) ?? [], n]);
    return { revision: this.revision(id) };
  }
}

/** Keeps changes as the browser does: by their number and tab. */
class Shelf {
  constructor(changes = []) {
    this.kept = new Map(changes.map((change) => [`${change.seq} ${change.tab}`, change]));
  }

  async queue() { return [...this.kept.values()].sort((a, b) => a.seq - b.seq); }

  async put(change) { this.kept.set(`${change.seq} ${change.tab}`, structuredClone(change)); }

  async drop(changes) { for (const { seq, tab } of changes) this.kept.delete(`${seq} ${tab}`); }
}

const made = (id, n, revision = 0) => ({ id, revision, width: 2, height: 1, counts: "2", ignore: null, log: [{ tool: "brush", n }], seconds: 0 });

function start(t) {
  mock.timers.enable({ apis: ["setTimeout", "Date"] });
  t?.after(() => mock.timers.reset());
  const server = new Server();
  const told = [];
  const saved = [];
  const saver = new Saver({
    put: (id, revision, change) => server.put(id, revision, change),
    status: (status, detail, id) => told.push({ status, detail, id }),
    saved: (id, revision) => saved.push([id, revision]),
  });
  saver.journal = new Shelf();
  return { server, saver, told, saved, shelf: saver.journal };
}

/** Let what is under way come to its end. */
const quiet = () => new Promise((done) => setImmediate(done));

/** Let hours pass. */
async function wait(saver) {
  for (let k = 0; k < 300 && !saver.sent; k++) {
    await quiet();
    mock.timers.tick(60_000);
  }
  await quiet();
}

test("changes go out in order, each from the revision that the one before it made", async (t) => {
  const { server, saver, saved, told, shelf } = start(t);
  for (const n of [1, 2, 3]) saver.save(made(5, n));
  assert.equal(saver.idle, false);
  await quiet();
  assert.deepEqual(server.taken.get(5), [1, 2, 3]);
  assert.deepEqual(saved, [[5, 1], [5, 2], [5, 3]]);
  assert.deepEqual(told.at(-1), { status: "saved", detail: "", id: 5 });
  assert.deepEqual([saver.idle, shelf.kept.size, saver.newest.get(5)], [true, 0, 3]);
});

test("while the server is away nothing is lost, and the order holds", async (t) => {
  const { server, saver, told, shelf } = start(t);
  server.failures = ["away", "away"];
  saver.save(made(1, 1));
  await quiet();
  assert.equal(told.at(-1).status, "offline");
  saver.save(made(2, 2));
  saver.save(made(1, 3));
  await quiet();
  assert.deepEqual([server.sent, shelf.kept.size], [[1], 3]);
  mock.timers.tick(1000);
  await quiet();
  assert.deepEqual(server.sent, [1, 1]);
  mock.timers.tick(1999);
  await quiet();
  assert.deepEqual(server.sent, [1, 1], "the second wait is longer");
  mock.timers.tick(1);
  await quiet();
  assert.deepEqual([server.taken.get(1), server.taken.get(2)], [[1, 3], [2]]);
  assert.equal(told.at(-1).status, "saved");
});

test("who is signed out is told, and what waits goes out when somebody tries again", async (t) => {
  const { server, saver, told } = start(t);
  server.failures = [401];
  saver.save(made(1, 1));
  await quiet();
  assert.deepEqual(told.at(-1), { status: "offline", detail: "signed out: sign in again in another tab", id: 1 });
  saver.retry();
  await quiet();
  assert.deepEqual(server.taken.get(1), [1]);
});

for (const [status, told] of [[409, "conflict"], [423, "locked"], [422, "refused"]]) {
  test(`a refusal (${status}) parks its pair as "${told}", and other pairs go on`, async (t) => {
    const { server, saver, told: heard } = start(t);
    server.failures = [status];
    saver.save(made(1, 1));
    saver.save(made(1, 2));
    saver.save(made(2, 3));
    await quiet();
    assert.deepEqual([server.sent, server.taken.get(2)], [[1, 3], [3]]);
    assert.equal(saver.parked.get(1), told);
    assert.deepEqual(heard.filter((each) => each.status === told), [{ status: told, detail: `status ${status}`, id: 1 }]);
    assert.deepEqual([saver.held(1), saver.held(2), saver.sent, saver.idle], [true, false, true, false]);
  });
}

test("a parked pair is sent again from another revision, or given up", async (t) => {
  const { server, saver, shelf } = start(t);
  server.taken.set(1, [100]);
  server.taken.set(2, [200]);
  for (const [id, n] of [[1, 1], [1, 2], [2, 3], [2, 4]]) saver.save(made(id, n));
  await quiet();
  assert.deepEqual([...saver.parked], [[1, "conflict"], [2, "conflict"]]);
  saver.resolve(1, 1);
  // It may be sent after a reload only: what is kept holds the decision, too.
  assert.deepEqual((await shelf.queue()).map(({ id, revision }) => [id, revision]), [[1, 1], [1, 0], [2, 0], [2, 0]]);
  await quiet();
  assert.deepEqual(server.taken.get(1), [100, 1, 2]);
  saver.resolve(2, null);
  await quiet();
  assert.deepEqual(server.taken.get(2), [200]);
  assert.deepEqual([saver.idle, shelf.kept.size], [true, 0]);
});

test("a pair that the server fails at waits, longer each time, while others go on", async (t) => {
  const { server, saver, told } = start(t);
  server.failures = [500, null, 500];
  saver.save(made(1, 1));
  saver.save(made(2, 2));
  await quiet();
  assert.deepEqual([server.sent, server.taken.get(2)], [[1, 2], [2]]);
  assert.deepEqual(told.at(-1), { status: "not saved", detail: "tried again by and by; status 500", id: 1 });
  mock.timers.tick(3000);
  await quiet();
  assert.deepEqual(server.sent, [1, 2, 1]);
  mock.timers.tick(9999);
  await quiet();
  assert.deepEqual(server.sent, [1, 2, 1]);
  mock.timers.tick(1);
  await quiet();
  assert.deepEqual([server.taken.get(1), told.at(-1).status], [[1], "saved"]);
});

test("what a closed tab left is sent before what is new, and from then on is this tab's", async (t) => {
  const { server, saver } = start(t);
  const old = new Shelf([{ ...made(1, 2), seq: 20, tab: "gone" }, { ...made(1, 1), seq: 10, tab: "gone" }]);
  saver.waiting = [{ ...made(1, 3), seq: 30, tab: saver.tab }];
  assert.equal(await saver.begin(old), 2);
  assert.ok([...old.kept.keys()].every((key) => key.endsWith(saver.tab)));
  await wait(saver);
  assert.deepEqual(server.taken.get(1), [1, 2, 3]);
  assert.equal(old.kept.size, 0);
});

test("a change that cannot be kept in the browser is sent all the same, and the person is told", async (t) => {
  const { server, saver, told } = start(t);
  saver.journal.put = () => Promise.reject(new Error("full"));
  saver.save(made(1, 1));
  await quiet();
  assert.deepEqual(server.taken.get(1), [1]);
  assert.ok(told.some(({ detail }) => detail === "cannot be kept in this browser, Error: full"));
});

test("the newest unsent change speaks for its pair, its ignore layer and its base", () => {
  const { saver } = start();
  saver.timer = 1;
  saver.save({ ...made(1, 1, 4), ignore: "11" });
  saver.save(made(2, 2, 7));
  saver.save({ ...made(1, 3, 4), counts: "02" });
  assert.deepEqual([saver.unsent(1)?.counts, saver.unsentIgnore(1), saver.base(1)], ["02", "11", 4]);
  assert.deepEqual([saver.unsent(9), saver.unsentIgnore(2), saver.base(9)], [null, null, 0]);
  mock.timers.reset();
});

test("whatever fails, every pair gets all of its changes, once and in order", async () => {
  const steps = fc.array(fc.oneof(
    { weight: 4, arbitrary: fc.record({ save: fc.integer({ min: 1, max: 3 }) }) },
    { weight: 3, arbitrary: fc.record({ fail: fc.constantFrom("away", 401, 500, 503) }) },
    { weight: 1, arbitrary: fc.constant("retry") },
    { weight: 2, arbitrary: fc.record({ tick: fc.integer({ min: 100, max: 20_000 }) }) },
  ), { maxLength: 40 });
  await fc.assert(fc.asyncProperty(steps, async (story) => {
    const { server, saver, shelf, told } = start();
    try {
      const wanted = new Map();
      for (const [n, step] of story.entries()) {
        if (step === "retry") saver.retry();
        else if ("fail" in step) server.failures.push(step.fail);
        else if ("tick" in step) mock.timers.tick(step.tick);
        else {
          wanted.set(step.save, [...wanted.get(step.save) ?? [], n]);
          saver.save(made(step.save, n));
        }
        await quiet();
        assert.deepEqual((await shelf.queue()).map(({ seq }) => seq), saver.waiting.map(({ seq }) => seq));
      }
      await wait(saver);
      assert.deepEqual(new Map([...server.taken].sort()), new Map([...wanted].sort()));
      assert.deepEqual([saver.idle, shelf.kept.size], [true, 0]);
      if (wanted.size) assert.equal(told.at(-1).status, "saved");
    } finally {
      mock.timers.reset();
    }
  }), { numRuns: 60 });
});
