import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import fc from "fast-check";

import { decode, encode, write } from "../../static/js/rle.js";
import { masks, sizes } from "./masks.js";

// tests/test_masks.py reads the same ones.
const VECTORS = JSON.parse(readFileSync(new URL("../static/rle_vectors.json", import.meta.url), "utf8"));

for (const { name, rows, counts } of VECTORS) {
  test(`run-lengths are those of Python: ${name}`, () => {
    const mask = { width: rows[0].length, height: rows.length, data: Uint8Array.from(rows.flat()) };
    assert.equal(encode(mask), counts);
    assert.deepEqual(decode(counts, mask.width, mask.height), mask);
  });
}

test("a mask comes back from its run-lengths", () => {
  fc.assert(fc.property(masks, (mask) => {
    assert.deepEqual(decode(encode(mask), mask.width, mask.height), mask);
  }));
});

test("run-lengths of another image are refused", () => {
  fc.assert(fc.property(masks, sizes, (mask, size) => {
    fc.pre(size.width * size.height !== mask.width * mask.height);
    assert.throws(() => decode(encode(mask), size.width, size.height), /run-lengths do not (fit|cover) the image/);
  }));
});

test("damaged run-lengths are refused", () => {
  for (const counts of ["~", "S", " 1", "0é"]) {
    assert.throws(() => decode(counts, 5, 7), /run-lengths are damaged/);
  }
  assert.throws(() => decode("", 5, 7), /do not cover/);
  // They add up, but one of them goes backwards.
  assert.throws(() => decode(write([-1, 36]), 5, 7), /do not fit/);
});

test("any text is a mask of that size, or refused", () => {
  fc.assert(fc.property(fc.string({ unit: fc.constantFrom(..."0123456789:;<=>?@ABCRSTUabclmno") }), sizes, (text, { width, height }) => {
    try {
      assert.equal(decode(text, width, height).data.length, width * height);
    } catch (error) {
      assert.match(error.message, /^run-lengths /);
    }
  }));
});
