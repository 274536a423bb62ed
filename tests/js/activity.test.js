import assert from "node:assert/strict";
import { test } from "node:test";

import { Activity } from "../../static/js/activity.js";

test("the time between actions counts, up to five seconds a pause", () => {
  let now = 100;
  const activity = new Activity(() => now);
  for (const [pause, total] of [[2, 2], [5, 7], [600, 12], [0.5, 12.5]]) {
    now += pause;
    activity.note();
    assert.equal(activity.seconds, total);
  }
});

test("what is taken is counted once, and the pause before it is part of it", () => {
  let now = 0;
  const activity = new Activity(() => now);
  now = 3;
  assert.equal(activity.take(), 3);
  assert.equal(activity.take(), 0);
  now = 20;
  assert.equal(activity.take(), 5);
});
