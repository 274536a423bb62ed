import assert from "node:assert/strict";
import { test } from "node:test";

import { levelAt, Pictures } from "../../static/js/layers.js";

const LARGE = { width: 4000, height: 3000 };

test("a large picture comes in the smallest size that fills its place", () => {
  assert.equal(levelAt(LARGE, 0.2), 2);
  assert.equal(levelAt(LARGE, 0.25), 2);
  assert.equal(levelAt(LARGE, 0.26), 1);
  assert.equal(levelAt(LARGE, 0.001), 5);
  assert.equal(levelAt(LARGE, 1), 0);
  assert.equal(levelAt(LARGE, 8), 0);
});

test("a picture of the usual size comes as it is", () => {
  assert.equal(levelAt({ width: 640, height: 480 }, 0.1), 0);
});

test("until a finer size is there, the one that is there is shown", () => {
  const pictures = new Pictures(() => {});
  const coarse = { bitmap: { width: 1000 }, error: "", failed: 0 };
  pictures.load = () => Promise.resolve();
  pictures.pictures.set("live/2", coarse);
  const url = (level) => `live/${level}`;
  assert.equal(pictures.best(url, 0), coarse);
  const fine = { bitmap: { width: 4000 }, error: "", failed: 0 };
  pictures.pictures.set("live/0", fine);
  assert.equal(pictures.best(url, 0), fine);
  assert.equal(pictures.best(url, 2), coarse);
});
