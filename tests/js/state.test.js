import assert from "node:assert/strict";
import { test } from "node:test";

import { State } from "../../static/js/state.js";

const pairOf = (id, more = {}) => ({ id, run: "doi", state: "todo", doubt: "", regions: [], ...more });
const proposalOf = (key) => ({ key, region_id: null, outcome: null });

/** What the state tells, in order. */
function toldBy(state, ...topics) {
  const told = [];
  for (const topic of topics) state.subscribe(topic, (...what) => told.push([topic, ...what]));
  return told;
}

test("who hears that anything changed comes after those who hear what", () => {
  const state = new State();
  const heard = [];
  state.watch(() => heard.push("anything"));
  state.subscribe("settings", () => heard.push(`radius ${state.radius}`));
  state.change({ radius: 9 });
  assert.deepEqual(heard, ["radius 9", "anything"]);
});

test("who hears of one topic hears of no other", () => {
  const state = new State();
  const told = toldBy(state, "cursor");
  state.hold({ blinking: true });
  assert.deepEqual(told, []);
  state.point({ x: 1, y: 2 });
  assert.deepEqual(told, [["cursor"]]);
});

test("another pair has nothing selected, and the same one keeps what is", () => {
  const state = new State();
  const told = toldBy(state, "pair");
  state.open(pairOf(1), 3);
  state.propose([proposalOf("a"), proposalOf("b")]);
  state.select("b");
  state.lookBack(2);
  state.open(pairOf(1), 4);
  assert.deepEqual([state.selected, state.looked, state.revision], ["b", 2, 4]);
  state.open(pairOf(2), 1);
  assert.deepEqual([state.selected, state.looked, state.proposals], [null, null, []]);
  assert.deepEqual(told, [["pair", true], ["pair", false], ["pair", true]]);
});

test("a selection goes when its proposal is no longer there", () => {
  const state = new State();
  state.propose([proposalOf("a"), proposalOf("b")]);
  state.select("b");
  state.propose([proposalOf("b")]);
  assert.equal(state.selected, "b");
  state.propose([proposalOf("a")]);
  assert.equal(state.selected, null);
});

test("what comes of another pair than the open one is dropped", () => {
  const state = new State();
  state.open(pairOf(1), 1);
  const told = toldBy(state, "pair");
  state.accept(pairOf(2));
  state.stand(2, { state: "approved", truth: null, revision: 1 });
  assert.deepEqual([state.pair.id, state.pair.state, told], [1, "todo", []]);
  state.stand(1, { state: "approved", truth: null, revision: 1 });
  assert.deepEqual([state.pair.state, state.locked, told], ["approved", true, [["pair", false]]]);
});

test("the first stored mask begins a pair, and a later one leaves its state", () => {
  const state = new State();
  state.open(pairOf(1), 0);
  state.store(1);
  assert.deepEqual([state.revision, state.pair.state], [1, "in_progress"]);
  state.stand(1, { state: "submitted", truth: null, revision: 1 });
  state.store(2);
  assert.deepEqual([state.revision, state.pair.state], [2, "submitted"]);
});

test("the blind phase of a pair ends once", () => {
  const state = new State();
  state.change({ mode: "blind" });
  state.open(pairOf(7), 1);
  const told = toldBy(state, "revealed");
  assert.equal(state.blind, true);
  state.reveal();
  state.reveal();
  assert.deepEqual([state.blind, state.reviewing, state.revealed, told], [false, true, [7], [["revealed"]]]);
});

test("a layer that goes into a pane changes places with the one that has it", () => {
  const state = new State();
  state.open(pairOf(1), 0);
  state.change({ layers: ["warped", "live", "doi"] });
  state.swap(0, "doi");
  assert.deepEqual(state.layers, ["doi", "live", "warped"]);
  state.swap(1, "difference");
  assert.deepEqual(state.layers, ["doi", "difference", "warped"]);
});

test("a glance shows a layer for a moment and leaves the panes as they are set", () => {
  const state = new State();
  state.open(pairOf(1), 0);
  const told = toldBy(state, "look", "settings");
  state.glance({ pane: 0, layer: "doi" });
  assert.deepEqual(state.shownLayers, ["doi", "live"]);
  assert.deepEqual(state.layers, ["warped", "live"]);
  state.glance(null);
  assert.deepEqual(state.shownLayers, ["warped", "live"]);
  assert.deepEqual(told, [["look"], ["look"]]);
});

test("blinking begins when its key goes down and not again while it is held", (context) => {
  const state = new State();
  const clock = context.mock.method(performance, "now", () => 500);
  state.hold({ blinking: true });
  clock.mock.mockImplementation(() => 900);
  state.hold({ blinking: true });
  assert.equal(state.blinkedAt, 500);
});
