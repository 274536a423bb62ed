import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { fillPolygon, floodFill } from "../../static/js/fill.js";
import { area, emptyMask } from "../../static/js/raster.js";
import { drawn, masks, rows } from "./masks.js";

const corners = (...places) => places.map(([x, y]) => ({ x, y }));

/** Grey RGBA pixels, of a digit a pixel. */
const grey = (...lines) => Uint8ClampedArray.from([...lines.join("")].flatMap((digit) => [...Array(3).fill(10 * Number(digit)), 255]));

test("a polygon fills the pixels whose centres lie inside", () => {
  const mask = emptyMask(5, 4);
  const box = fillPolygon(mask, corners([1, 1], [4, 1], [4, 3], [1, 3]), 1);
  assert.deepEqual(rows(mask), [".....", ".###.", ".###.", "....."]);
  assert.deepEqual(box, { x0: 1, y0: 1, x1: 5, y1: 4 });
});

test("what a polygon winds around twice is left out", () => {
  const mask = emptyMask(6, 1);
  fillPolygon(mask, corners([0, 0], [6, 0], [6, 1], [4, 1], [4, 0], [2, 0], [2, 1], [0, 1]), 1);
  assert.deepEqual(rows(mask), ["##..##"]);
});

test("a polygon takes away, too, and past the image it fills what is inside it", () => {
  const mask = drawn("####", "####");
  fillPolygon(mask, corners([-9, -9], [2, -9], [2, 9], [-9, 9]), 0);
  assert.deepEqual(rows(mask), ["..##", "..##"]);
  assert.equal(fillPolygon(mask, corners([9, 9], [12, 9], [12, 12]), 1), null);
  assert.equal(fillPolygon(mask, corners([0, 0], [2, 2]), 1), null);
});

test("two polygons that share an edge leave no gap between them and fill no pixel twice", () => {
  // A pointer tells its place by fractions of a pixel that a float holds exactly.
  const places = fc.integer({ min: 0, max: 12 * 64 }).map((part) => part / 64);
  fc.assert(fc.property(places, places, (top, bottom) => {
    const [from, to] = [{ x: top, y: 0 }, { x: bottom, y: 12 }];
    const [left, right] = [emptyMask(12, 12), emptyMask(12, 12)];
    fillPolygon(left, [{ x: 0, y: 0 }, from, to, { x: 0, y: 12 }], 1);
    fillPolygon(right, [from, { x: 12, y: 0 }, { x: 12, y: 12 }, to], 1);
    assert.ok(left.data.every((value, i) => value + right.data[i] === 1));
  }));
});

test("a flood stops where the colour is another one than at the click", () => {
  const mask = emptyMask(4, 3);
  const box = floodFill(mask, grey("1129", "1329", "9999"), { x: 0.5, y: 0.5 }, 10, 1);
  assert.deepEqual(rows(mask), ["###.", "#.#.", "...."]);
  assert.deepEqual(box, { x0: 0, y0: 0, x1: 3, y1: 2 });
});

test("a flood does not pass corners, or the image's edge into the next row", () => {
  for (const [at, filled] of [[{ x: 2.5, y: 0.5 }, ["..#", "..."]], [{ x: 0.5, y: 1.5 }, ["...", "#.."]]]) {
    const mask = emptyMask(3, 2);
    floodFill(mask, grey("991", "199"), at, 5, 1);
    assert.deepEqual(rows(mask), filled);
  }
});

test("a flood beside the image does nothing, and one without limits fills all", () => {
  fc.assert(fc.property(masks, (mask) => {
    const pixels = new Uint8ClampedArray(4 * mask.data.length).map((_, i) => (i * 37) % 256);
    const before = rows(mask);
    assert.equal(floodFill(mask, pixels, { x: mask.width, y: 0 }, 255, 1), null);
    assert.deepEqual(rows(mask), before);
    floodFill(mask, pixels, { x: 0, y: 0 }, 255, 1);
    assert.equal(area(mask), mask.data.length);
  }));
});
