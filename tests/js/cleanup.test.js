import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { componentAt, dropSpecks, fillHoles, grow, keepComponent, label, shrink, smooth } from "../../static/js/cleanup.js";
import { drawn, masks, rows } from "./masks.js";

const cleaned = (mask, data) => rows({ ...mask, data });

test("components that meet at a corner are one of 8 neighbours, and two of 4", () => {
  const mask = drawn("#..", ".#.", "..#");
  assert.deepEqual(label(mask, 1, 8).areas.slice(1), [3]);
  assert.deepEqual(label(mask, 1, 4).areas.slice(1), [1, 1, 1]);
});

test("components do not run over the image's edge into the next row", () => {
  assert.deepEqual(label(drawn("..#", "#.."), 1, 8).areas.slice(1), [1, 1]);
});

test("what is enclosed is filled, and what has a way out is not", () => {
  const mask = drawn("####.", "#..#.", "#.##.", "##...");
  assert.deepEqual(cleaned(mask, fillHoles(mask)), ["####.", "####.", "####.", "##..."]);
  const open = drawn("###", "#.#", "#.#");
  assert.deepEqual(cleaned(open, fillHoles(open)), rows(open));
});

test("a hole whose only way out is a corner is enclosed", () => {
  const mask = drawn(".#..", "#.#.", ".#..");
  assert.deepEqual(cleaned(mask, fillHoles(mask)), [".#..", "###.", ".#.."]);
});

test("specks go, components of the least size stay", () => {
  const mask = drawn("##..#", "....#", "#...#");
  assert.deepEqual(cleaned(mask, dropSpecks(mask, 2)), ["##..#", "....#", "....#"]);
  assert.deepEqual(cleaned(mask, dropSpecks(mask, 3)), ["....#", "....#", "....#"]);
});

test("the component under a point is kept alone, and beside one nothing changes", () => {
  const mask = drawn("#..#", "#..#", "...#");
  assert.deepEqual(cleaned(mask, keepComponent(mask, { x: 0.9, y: 1.2 })), ["#...", "#...", "...."]);
  assert.deepEqual(cleaned(mask, keepComponent(mask, { x: 1.5, y: 1.5 })), rows(mask));
  assert.equal(componentAt(mask, { x: 1.5, y: 1.5 }), null);
});

test("the component under a point is the one that numbering all of them finds", () => {
  fc.assert(fc.property(masks, fc.nat(), (mask, seed) => {
    const start = seed % mask.data.length;
    const at = { x: start % mask.width, y: Math.floor(start / mask.width) };
    const { labels } = label(mask, 1, 8);
    const wanted = mask.data[start] ? Uint8Array.from(labels, (each) => (each === labels[start] ? 1 : 0)) : null;
    assert.deepEqual(componentAt(mask, at), wanted);
  }));
});

test("growing and shrinking go by one pixel in eight directions, and the border holds", () => {
  const mask = drawn(".....", "..#..", ".....", ".....");
  assert.deepEqual(cleaned(mask, grow(mask)), [".###.", ".###.", ".###.", "....."]);
  const touching = drawn("###.", "###.", "....");
  assert.deepEqual(cleaned(touching, shrink(touching)), ["##..", "....", "...."]);
});

test("shrinking the mask is growing what it leaves out", () => {
  fc.assert(fc.property(masks, (mask) => {
    const inverse = { ...mask, data: mask.data.map((value) => 1 - value) };
    assert.deepEqual(shrink(mask), grow(inverse).map((value) => 1 - value));
    assert.ok(grow(mask).every((value, i) => value >= mask.data[i]));
    assert.ok(shrink(mask).every((value, i) => value <= mask.data[i]));
  }));
});

test("smoothing takes the tip of a spike away, and fills holes and notches", () => {
  const mask = drawn(".....", "..#..", "..#..", "#####", "##.##", "#####");
  assert.deepEqual(cleaned(mask, smooth(mask)), [".....", ".....", ".###.", "#####", "#####", "#####"]);
});
