import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { compare, merge, partAt } from "../../static/js/merging.js";
import { drawn, masksOf, rows, sizes } from "./masks.js";

const BASE = drawn("##....", "......", "......");
const MINE = drawn("##..#.", "......", "......");
const THEIRS = drawn("......", "......", "#....#");

test("the versions differ part by part, and a part touches its pixels at corners too", () => {
  const { parts } = compare("mask", drawn("#...", ".#..", "...."), drawn("....", "....", "...#"), null);
  assert.deepEqual(parts.map(({ area, box, layer }) => ({ area, box, layer })), [
    { area: 2, box: [0, 0, 2, 2], layer: "mask" },
    { area: 1, box: [3, 2, 4, 3], layer: "mask" },
  ]);
});

test("what only they have changed is theirs at first, all else is mine", () => {
  const compared = compare("mask", MINE, THEIRS, BASE);
  const told = compared.parts.map(({ box, mine }) => [box.join(), mine]).sort();
  assert.deepEqual(told, [["0,0,2,1", false], ["0,2,1,3", false], ["4,0,5,1", true], ["5,2,6,3", false]]);
  assert.deepEqual(rows(merge(compared)), ["....#.", "......", "#....#"]);
});

test("a part that both have changed is mine at first", () => {
  const { parts } = compare("mask", drawn("##."), drawn("..."), drawn("#.."));
  assert.deepEqual(parts.map(({ mine }) => mine), [true]);
});

test("without the version that both began from, all is mine", () => {
  const compared = compare("ignore", MINE, THEIRS, null);
  assert.ok(compared.parts.length > 0 && compared.parts.every(({ mine }) => mine));
  assert.deepEqual(merge(compared), MINE);
});

test("each part holds as it is chosen, and the rest is what both have", () => {
  const versions = sizes.chain((size) => fc.tuple(masksOf(size), masksOf(size), fc.array(fc.boolean(), { minLength: 80, maxLength: 80 })));
  fc.assert(fc.property(versions, ([mine, theirs, choices]) => {
    const compared = compare("mask", mine, theirs, null);
    compared.parts.forEach((part, k) => { part.mine = choices[k]; });
    const merged = merge(compared);
    for (const i of mine.data.keys()) {
      const part = partAt(compared, i);
      assert.equal(part === null, mine.data[i] === theirs.data[i]);
      assert.equal(merged.data[i], (part && !part.mine ? theirs : mine).data[i]);
    }
    const differing = [...mine.data.keys()].filter((i) => mine.data[i] !== theirs.data[i]).length;
    assert.equal(compared.parts.reduce((sum, { area }) => sum + area, 0), differing);
  }));
});
