import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { AuditWalk } from "../../static/js/audit_walk.js";

let walk = new AuditWalk();
beforeEach(() => {
  walk = new AuditWalk();
  walk.stops = [[10, 1, 5, false], [11, 1, null, true], [20, 2, 0, false], [30, 3, -4, false]].map(
    ([region, pair, gain_px, opposed]) => ({ region, pair, gain_px, opposed, split: "cs1", name: "0000", doi: 0.5 }));
});

test("the walk goes from region to region, and stops at both ends", () => {
  assert.equal(walk.step(-1), null);
  assert.deepEqual([1, 1, 1, 1].map((by) => walk.step(by)?.region), [10, 11, 20, 30]);
  assert.equal(walk.step(1), null);
  assert.equal(walk.step(-1)?.region, 20);
});

test("the walk says how far it is, and why a region comes here", () => {
  assert.equal(walk.progress, "");
  const said = walk.stops.map(() => { walk.step(1); return walk.progress; });
  assert.deepEqual(said, ["1 of 4, flipping gains 5 px", "2 of 4, opposed", "3 of 4", "4 of 4"]);
});

test("a region that the walk has is found again, and the walk goes on from there", () => {
  walk.step(1);
  assert.equal(walk.find(20)?.pair, 2);
  assert.equal(walk.find(99), null);
  assert.equal(walk.step(1)?.region, 30);
});

test("leaving a pair leaves out its regions, and the next one comes next", () => {
  walk.step(1);
  walk.leave(1);
  assert.deepEqual(walk.stops.map(({ region }) => region), [20, 30]);
  assert.equal(walk.step(1)?.region, 20);
  walk.leave(3);
  assert.equal(walk.progress, "1 of 1");
});
