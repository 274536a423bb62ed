import assert from "node:assert/strict";
import { test } from "node:test";

import { nextTile, tileBox } from "../../static/js/sweep.js";

const sweep = (...swept) => ({ columns: 4, rows: 3, swept });

test("the sweep goes on at the next tile that was not swept, and begins again at the end", () => {
  assert.equal(nextTile(sweep(), -1), 0);
  assert.equal(nextTile(sweep(0, 1, 3), 1), 2);
  assert.equal(nextTile(sweep(0, 1, 2, 11), 10), 3);
});

test("when all is swept, the sweep walks all of it once more", () => {
  const all = sweep(...Array(12).keys());
  assert.equal(nextTile(all, -1), 0);
  assert.equal(nextTile(all, 11), 0);
});

test("tiles cover the picture without a gap", () => {
  const image = { width: 640, height: 480 };
  assert.deepEqual(tileBox(sweep(), 0, image), [0, 0, 160, 160]);
  assert.deepEqual(tileBox(sweep(), 11, image), [480, 320, 640, 480]);
});
