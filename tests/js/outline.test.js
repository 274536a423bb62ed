import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { outlineOf } from "../../static/js/outline.js";
import { boxOf } from "../../static/js/raster.js";
import { drawn, masksOf, sizes } from "./masks.js";

test("a thing is outlined along the borders of its pixels, at the picture's border too", () => {
  const mask = drawn("##.", "##.", "...");
  assert.deepEqual(outlineOf(mask, boxOf(mask)), [[0, 0, 2, 0], [0, 2, 2, 2], [0, 0, 0, 2], [2, 0, 2, 2]]);
});

test("the outline of a ring goes round its hole as well", () => {
  const mask = drawn("###", "#.#", "###");
  assert.equal(outlineOf(mask, boxOf(mask)).length, 8);
});

test("a line parts a set pixel from another one on all of its length", () => {
  fc.assert(fc.property(sizes.chain((size) => masksOf(size)), (mask) => {
    const box = boxOf(mask);
    if (!box) return;
    const at = (x, y) => (x >= 0 && y >= 0 && x < mask.width && y < mask.height ? mask.data[y * mask.width + x] : 0);
    let length = 0;
    for (const [x0, y0, x1, y1] of outlineOf(mask, box)) {
      for (let x = x0; x < x1; x++, length++) assert.notEqual(at(x, y0 - 1), at(x, y0));
      for (let y = y0; y < y1; y++, length++) assert.notEqual(at(x0 - 1, y), at(x0, y));
    }
    let borders = 0;
    for (let y = 0; y <= mask.height; y++) {
      for (let x = 0; x <= mask.width; x++) borders += Number(at(x, y - 1) !== at(x, y)) + Number(at(x - 1, y) !== at(x, y));
    }
    assert.equal(length, borders);
  }));
});
