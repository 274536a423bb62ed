import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { PairDocument } from "../../static/js/document.js";
import { encode } from "../../static/js/rle.js";
import { State } from "../../static/js/state.js";
import { drawn } from "./masks.js";

const SIZE = { width: 5, height: 3 };
const proposal = (key, outcome = null, region_id = null) => ({ key, outcome, region_id });

let state, saved, pair;
beforeEach(() => {
  state = new State();
  saved = [];
  pair = new PairDocument(state, { save: ({ log }) => saved.push(...log), journal: null }, assert.fail);
  state.open({ id: 1, run: null, state: "todo", regions: [{ id: 4, verdict: "agree" }, { id: 5, verdict: null }], ...SIZE }, 1);
  pair.load(SIZE, encode(drawn(".....", ".....", ".....")), "", undefined);
});

const outcomes = () => state.proposals.map(({ outcome }) => outcome);

test("what is left undecided is rejected as one action, taken back and done again", () => {
  state.propose([proposal("a", "add"), proposal("b"), proposal("c", null, 4), proposal("d", null, 5)]);
  pair.reject(state.undecided);
  assert.deepEqual(outcomes(), ["add", "reject", null, "reject"]);
  pair.step("undo", pair.history.next("undo"));
  assert.deepEqual(outcomes(), ["add", null, null, null]);
  assert.equal(pair.history.next("undo"), null);
  pair.step("redo", pair.history.next("redo"));
  assert.deepEqual(outcomes(), ["add", "reject", null, "reject"]);
  const proposals = ["b", "d"];
  assert.deepEqual(saved, [{ tool: "reject", proposals }, { tool: "undo", of: "reject", proposals },
    { tool: "redo", of: "reject", proposals }]);
});

test("one rejection is logged under its key, and gives back what was made of the proposal before", () => {
  state.propose([proposal("a", "ill-posed")]);
  pair.reject(state.proposals);
  assert.deepEqual(saved, [{ tool: "reject", proposal: "a" }]);
  pair.step("undo", pair.history.next("undo"));
  assert.deepEqual(outcomes(), ["ill-posed"]);
});
