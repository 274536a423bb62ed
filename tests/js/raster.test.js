import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { area, boxOf, clip, copyBox, emptyMask, join, paintSegment, pasteBox } from "../../static/js/raster.js";
import { boxesIn, drawn, masks, masksOf, rows, sizes } from "./masks.js";

const places = fc.record({ x: fc.double({ min: -4, max: 16, noNaN: true }), y: fc.double({ min: -4, max: 16, noNaN: true }) });

/** Distance of a pixel's centre from a segment, by another way than the code's. */
function distance(x, y, a, b) {
  const nearest = Array.from({ length: 2001 }, (_, k) => k / 2000)
    .map((t) => Math.hypot(x + 0.5 - a.x - t * (b.x - a.x), y + 0.5 - a.y - t * (b.y - a.y)));
  return Math.min(...nearest);
}

test("a dot covers the pixels whose centres it covers", () => {
  const mask = emptyMask(5, 5);
  const box = paintSegment(mask, { x: 2.5, y: 2.5 }, { x: 2.5, y: 2.5 }, 1, 1);
  assert.deepEqual(rows(mask), [".....", "..#..", ".###.", "..#..", "....."]);
  assert.deepEqual(box, { x0: 1, y0: 1, x1: 5, y1: 5 });
});

test("a very small brush paints the pixel under it, and the eraser takes it away", () => {
  const mask = emptyMask(3, 1);
  paintSegment(mask, { x: 1.05, y: 0.05 }, { x: 1.05, y: 0.05 }, 0.1, 1);
  assert.deepEqual(rows(mask), [".#."]);
  paintSegment(mask, { x: 1.9, y: 0.9 }, { x: 1.9, y: 0.9 }, 0.1, 0);
  assert.deepEqual(rows(mask), ["..."]);
});

test("a stroke beside the image touches nothing", () => {
  const mask = emptyMask(4, 4);
  assert.equal(paintSegment(mask, { x: -9, y: 2 }, { x: -5, y: 2 }, 2, 1), null);
  assert.equal(area(mask), 0);
});

test("a stroke fills what lies within its radius, and nothing outside its box", () => {
  fc.assert(fc.property(sizes, places, places, fc.double({ min: 0.5, max: 4, noNaN: true }), (size, a, b, radius) => {
    const mask = emptyMask(size.width, size.height);
    const box = paintSegment(mask, a, b, radius, 1);
    for (let y = 0; y < size.height; y++) {
      for (let x = 0; x < size.width; x++) {
        const set = mask.data[y * size.width + x] === 1;
        const ends = [a, b].some((p) => Math.floor(p.x) === x && Math.floor(p.y) === y);
        const from = distance(x, y, a, b);
        if (Math.abs(from - radius) > 0.02) assert.equal(set, ends || from < radius, `pixel ${x}, ${y}`);
        if (set) assert.ok(box && x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1);
      }
    }
  }), { numRuns: 60 });
});

test("the box of a mask is the smallest one that holds all of it", () => {
  assert.deepEqual(boxOf(drawn("......", "..#...", "....#.")), { x0: 2, y0: 1, x1: 5, y1: 3 });
  assert.equal(boxOf(drawn("...", "...")), null);
  fc.assert(fc.property(masks, (mask) => {
    const set = [...mask.data.keys()].filter((i) => mask.data[i]);
    const [xs, ys] = [set.map((i) => i % mask.width), set.map((i) => Math.floor(i / mask.width))];
    assert.deepEqual(boxOf(mask), set.length ? { x0: Math.min(...xs), y0: Math.min(...ys), x1: Math.max(...xs) + 1, y1: Math.max(...ys) + 1 } : null);
    assert.equal(area(mask), set.length);
  }));
});

test("boxes are joined and clipped, and nothing stays nothing", () => {
  const [a, b] = [{ x0: 0, y0: 4, x1: 2, y1: 5 }, { x0: 1, y0: 1, x1: 6, y1: 2 }];
  for (const both of [join(a, b), join(b, a)]) assert.deepEqual(both, { x0: 0, y0: 1, x1: 6, y1: 5 });
  assert.deepEqual([join(null, b), join(a, null), join(null, null)], [b, a, null]);
  assert.deepEqual(clip(emptyMask(3, 3), { x0: -2, y0: 1, x1: 9, y1: 9 }), { x0: 0, y0: 1, x1: 3, y1: 3 });
  assert.equal(clip(emptyMask(3, 3), { x0: 3, y0: 0, x1: 5, y1: 2 }), null);
});

test("pixels that are copied and put back are as they were", () => {
  fc.assert(fc.property(sizes.chain((size) => fc.tuple(masksOf(size), masksOf(size), boxesIn(size))), ([mask, other, box]) => {
    const pasted = { ...other, data: other.data.slice() };
    pasteBox(pasted, box, copyBox(mask, box));
    for (const i of mask.data.keys()) {
      const [x, y] = [i % mask.width, Math.floor(i / mask.width)];
      const inside = x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1;
      assert.equal(pasted.data[i], (inside ? mask : other).data[i]);
    }
  }));
});
