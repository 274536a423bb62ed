import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { APPLY, SOURCES } from "../../static/js/proposals.js";
import { drawn, masksOf, rows, sizes } from "./masks.js";

const MASK = drawn("##...", "##...", "....#");
const PROPOSAL = drawn(".##..", ".....", ".....");
const applied = (way) => rows({ ...MASK, data: APPLY[way](MASK, PROPOSAL.data) });

test("a proposal is added, to the mask or to the pixels that are not scored", () => {
  assert.deepEqual(applied("add"), ["###..", "##...", "....#"]);
  assert.deepEqual(applied("ill-posed"), applied("add"));
});

test("a proposal is taken out", () => {
  assert.deepEqual(applied("subtract"), ["#....", "##...", "....#"]);
});

test("a proposal stands in place of the components that it touches, and of no other", () => {
  assert.deepEqual(applied("replace"), [".##..", ".....", "....#"]);
});

test("a component that meets the proposal at a corner only is not touched", () => {
  const mask = drawn("#..", "...", "..#");
  const proposal = drawn("...", ".#.", "...");
  assert.deepEqual(rows({ ...mask, data: APPLY.replace(mask, proposal.data) }), ["#..", ".#.", "..#"]);
});

test("no way changes the mask it is given, and all leave zeros and ones", () => {
  const cases = sizes.chain((size) => fc.tuple(masksOf(size), masksOf(size), fc.constantFrom(...Object.keys(APPLY))));
  fc.assert(fc.property(cases, ([mask, proposal, way]) => {
    const before = rows(mask);
    const after = APPLY[way](mask, proposal.data);
    assert.deepEqual(rows(mask), before);
    assert.ok(after.every((value, i) => value === (way === "subtract" ? mask.data[i] & ~proposal.data[i]
      : way === "replace" ? value & (mask.data[i] | proposal.data[i]) : mask.data[i] | proposal.data[i])));
    if (way === "replace") assert.ok(proposal.data.every((value, i) => !value || after[i] === 1));
  }));
});

test("all sources of a run are those that are offered one by one", () => {
  const single = ["region", "detector", "object_live", "object_reference", "candidate"].flatMap((name) => SOURCES[name].sources);
  assert.deepEqual(SOURCES.all.sources, single);
});
