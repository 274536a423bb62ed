import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { History } from "../../static/js/history.js";
import { copyBox, pasteBox } from "../../static/js/raster.js";
import { boxesIn, drawn, masksOf, rows, sizes } from "./masks.js";

const ACTION = { tool: "brush" };
const copy = (mask) => ({ ...mask, data: mask.data.slice() });
const pixels = ({ mask, ignore }) => [[...mask.data], [...ignore.data]];

test("an action that changed nothing leaves no entry, and takes no redo away", () => {
  const mask = drawn("#.", "..");
  const history = new History();
  history.record("mask", drawn("..", ".."), mask, { x0: 0, y0: 0, x1: 2, y1: 2 }, ACTION);
  history.undo({ mask, ignore: drawn("..", "..") });
  assert.equal(history.record("mask", copy(mask), mask, { x0: 0, y0: 0, x1: 2, y1: 2 }, ACTION), null);
  assert.equal(history.record("mask", drawn("##", "##"), mask, null, ACTION), null);
  assert.deepEqual([history.done.length, history.undone.length], [0, 1]);
});

test("an entry holds the smallest box of what changed", () => {
  const history = new History();
  const patch = history.record("mask", drawn("....", "....", "...."), drawn("....", ".#..", "..#."),
    { x0: 0, y0: 0, x1: 4, y1: 3 }, ACTION);
  assert.deepEqual(patch?.box, { x0: 1, y0: 1, x1: 3, y1: 3 });
  assert.deepEqual([...patch?.flips ?? []], [0b1001]);
});

test("a verdict has its turn among the strokes, and flips nothing", () => {
  const masks = { mask: drawn("#."), ignore: drawn("..") };
  const history = new History();
  const verdict = { region: 7, audit: 3, action: { tool: "adopt" } };
  history.push(verdict);
  assert.equal(history.next("undo"), verdict);
  assert.equal(history.undo(masks), verdict);
  assert.deepEqual(rows(masks.mask), ["#."]);
  assert.equal(history.next("redo"), verdict);
  assert.equal(history.next("undo"), null);
  assert.equal(history.undo(masks), null);
});

test("undo and redo lead through the very versions that there were", () => {
  const step = (size) => fc.oneof(
    fc.record({ layer: fc.constantFrom("mask", "ignore"), other: masksOf(size), box: boxesIn(size) }),
    fc.constantFrom("undo", "redo"),
  );
  const stories = sizes.chain((size) => fc.tuple(masksOf(size), masksOf(size), fc.array(step(size), { maxLength: 25 })));
  fc.assert(fc.property(stories, ([mask, ignore, steps]) => {
    const masks = { mask, ignore };
    const history = new History();
    const versions = [pixels(masks)];
    let here = 0;
    for (const each of steps) {
      if (typeof each === "string") {
        const moved = history[each](masks);
        const there = here + (each === "undo" ? -1 : 1);
        assert.equal(moved !== null, there in versions);
        if (moved) here = there;
      } else {
        const before = copy(masks[each.layer]);
        pasteBox(masks[each.layer], each.box, copyBox(each.other, each.box));
        if (history.record(each.layer, before, masks[each.layer], each.box, ACTION)) {
          versions.splice(++here, Infinity, pixels(masks));
        }
      }
      assert.deepEqual(pixels(masks), versions[here]);
      assert.deepEqual([history.done.length, history.undone.length], [here, versions.length - 1 - here]);
    }
  }));
});
