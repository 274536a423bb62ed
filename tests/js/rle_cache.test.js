import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { copyBox, pasteBox } from "../../static/js/raster.js";
import { encode } from "../../static/js/rle.js";
import { RleCache } from "../../static/js/rle_cache.js";
import { boxesIn, drawn, masks, masksOf, sizes } from "./masks.js";

test("a cache that saw nothing encodes as without one", () => {
  fc.assert(fc.property(masks, (mask) => {
    assert.equal(new RleCache().encode(mask), encode(mask));
  }));
});

test("after every stroke the run-lengths are those of the whole mask", () => {
  const strokes = (size) => fc.array(fc.tuple(masksOf(size), boxesIn(size)), { maxLength: 8 });
  fc.assert(fc.property(sizes.chain((size) => fc.tuple(masksOf(size), strokes(size))), ([mask, changes]) => {
    const cache = new RleCache();
    cache.encode(mask);
    for (const [other, box] of changes) {
      pasteBox(mask, box, copyBox(other, box));
      cache.touch(mask, box);
      assert.equal(cache.encode(mask), encode(mask));
    }
  }));
});

test("other pixels in the mask's place are read anew, box or no box", () => {
  const cache = new RleCache();
  cache.encode(drawn("##..", "##.."));
  const other = drawn("...#", "#..#");
  cache.touch(other, { x0: 3, x1: 4 });
  assert.equal(cache.encode(other), encode(other));
});

test("only the columns of a stroke are read again", () => {
  const mask = drawn("....", "....", "....");
  const cache = new RleCache();
  cache.encode(mask);
  const columns = [...cache.columns];
  mask.data[5] = 1;
  cache.touch(mask, { x0: 1, x1: 2 });
  assert.deepEqual(columns.map((column, x) => column === cache.columns[x]), [true, false, true, true]);
});
