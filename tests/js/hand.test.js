import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { PairDocument } from "../../static/js/document.js";
import { encode } from "../../static/js/rle.js";
import { State } from "../../static/js/state.js";
import { Hand } from "../../static/js/tools/hand.js";
import { Pointing } from "../../static/js/tools/pointing.js";
import { toolbox } from "../../static/js/tools/toolbox.js";
import { drawn, rows } from "./masks.js";

const SIZE = { width: 8, height: 6 };
const EMPTY = Array(6).fill("........");
const FOUND = ["........", "..##....", "..##....", "........", "........", "........"];
const FULL = EMPTY.map((row) => row.replaceAll(".", "#"));
const plain = { shift: false, alt: false, right: false };

/** A hand over an empty mask, a server that finds FOUND, and what it saved and told. */
function deskOf() {
  const state = new State();
  const saved = [];
  const notices = [];
  const asked = [];
  const document = new PairDocument(state, { save: (change) => saved.push(change), journal: null }, (text) => notices.push(text));
  const reply = { candidates: [{ counts: encode(drawn(...FOUND)), score: 0.9 }, { counts: encode(drawn(...EMPTY)), score: 0.1 }],
    model: "fake", embed_ms: 0, predict_ms: 0 };
  const desk = { state, document, saved, notices, asked, may: true, located: [] };
  const changed = () => desk.hand.show();
  const pointing = new Pointing({
    ask: (body) => { asked.push(body); return Promise.resolve(reply); },
    locate: (at) => new Promise((there) => desk.located.push(() => there({ x: at.x + 1, y: at.y }))),
    mask: () => document.mask, changed, notice: (text) => notices.push(text), waiting: () => {},
  });
  const tools = toolbox(pointing, { pixels: () => new Uint8ClampedArray(4 * 48), tolerance: () => 0,
    path: async (from, to) => [from, to], changed });
  desk.hand = new Hand(state, document, tools, () => desk.may);
  state.open({ id: 1, run: null, state: "todo", regions: [], ...SIZE }, 1);
  document.load(SIZE, encode(drawn(...EMPTY)), "", undefined);
  state.change({ radius: 0.5 });
  state.look({ scale: 10, x: 0, y: 0 }, false);
  return desk;
}

let desk;
beforeEach(() => { desk = deskOf(); });
const mask = () => rows(desk.document.masks.mask);
const logs = () => desk.saved.map(({ log }) => log[0]);

function drag(...points) {
  desk.hand.begin(points[0], plain, "live");
  for (const point of points.slice(1)) desk.hand.move(point);
  return desk.hand.release();
}

async function click(x, y, keys = plain) {
  desk.hand.begin({ x, y }, keys, "live");
  await desk.hand.release();
}

test("a stroke is one entry of the history and one save", () => {
  desk.hand.take("brush");
  drag({ x: 1.5, y: 1.5 }, { x: 3.5, y: 1.5 }, { x: 5.5, y: 1.5 });
  assert.equal(mask()[1], ".#####..");
  assert.deepEqual(logs(), [{ tool: "brush", radius: 0.5, samples: 3 }]);
  assert.equal(desk.document.history.done.length, 1);
  assert.equal(desk.state.drawing, false);
});

for (const tool of ["brush", "eraser", "polygon", "lasso", "box", "fill", "magnetic", "click"]) {
  test(`${tool}: what was begun and is given up leaves the mask as it was, and saves nothing`, () => {
    desk.document.load(SIZE, encode(drawn(...FOUND)), "", undefined);
    desk.hand.take(tool);
    desk.hand.begin({ x: 2.5, y: 1.5 }, plain, "live");
    desk.hand.move({ x: 6.5, y: 4.5 });
    desk.hand.cancel();
    assert.deepEqual(mask(), FOUND);
    assert.deepEqual([desk.hand.active, desk.hand.busy, desk.state.drawing, desk.state.sketch], [null, false, false, []]);
    assert.deepEqual([desk.saved, desk.document.history.done], [[], []]);
  });

  test(`${tool}: nothing is begun on a mask that must not be changed`, async () => {
    desk.may = false;
    desk.hand.take(tool);
    await drag({ x: 1, y: 1 }, { x: 4, y: 4 });
    assert.deepEqual([desk.hand.active, mask(), desk.saved, desk.asked], [null, EMPTY, [], []]);
  });

  test(`${tool}: completing what was not begun does nothing`, () => {
    desk.hand.take(tool);
    desk.hand.complete();
    assert.deepEqual([mask(), desk.saved], [EMPTY, []]);
  });
}

test("a polygon goes on between presses, and is closed at its first corner", () => {
  desk.hand.take("polygon");
  for (const [x, y] of [[1, 1], [5, 1], [5, 4], [1, 4]]) {
    desk.hand.hover({ x, y }, "live");
    drag({ x, y });
    assert.equal(desk.hand.busy, true);
  }
  desk.hand.hover({ x: 1, y: 1 }, "live");
  drag({ x: 1, y: 1 });
  assert.deepEqual(logs().map(({ tool, samples }) => [tool, samples > 3]), [["polygon", true]]);
  assert.equal(mask()[2], ".####...");
});

test("a click offers what was found, and the mask does not change before it is taken", async () => {
  desk.hand.take("click");
  await click(2.5, 1.5);
  assert.deepEqual([desk.hand.offering, desk.hand.busy, mask()], [true, false, EMPTY]);
  assert.deepEqual([desk.state.candidate.count, desk.state.candidate.score], [2, 0.9]);
  desk.hand.complete();
  assert.deepEqual([mask(), desk.state.candidate, desk.hand.offering], [FOUND, null, false]);
  assert.deepEqual([logs()[0].tool, logs()[0].model, logs()[0].clicks], ["click", "fake", [[2.5, 1.5, 1]]]);
});

test("another candidate can be offered, and what the tool offers last is taken", async () => {
  desk.hand.take("click");
  assert.equal(desk.hand.tool.cycle(1), false);
  await click(2.5, 1.5);
  assert.equal(desk.hand.tool.cycle(-1), true);
  assert.equal(desk.state.candidate.index, 1);
  desk.hand.complete();
  assert.deepEqual(mask(), EMPTY);
});

test("a candidate goes where the way says, and is given up when it is rejected", async () => {
  desk.hand.take("click");
  await click(2.5, 1.5);
  desk.hand.complete("ill-posed");
  assert.deepEqual([mask(), rows(desk.document.masks.ignore)], [EMPTY, FOUND]);
  await click(2.5, 1.5);
  desk.hand.complete("reject");
  assert.deepEqual([mask(), desk.saved.length, desk.state.candidate], [EMPTY, 1, null]);
});

test("who takes another tool takes what is offered along, and gives up an outline", async () => {
  desk.hand.take("click");
  await click(2.5, 1.5);
  desk.hand.take("polygon");
  assert.deepEqual(mask(), FOUND);
  for (const [x, y] of [[0, 3], [7, 3], [7, 5], [0, 5]]) drag({ x, y });
  assert.equal(desk.state.sketch.length, 5);
  desk.hand.take("brush");
  assert.deepEqual([mask(), desk.saved.length, desk.state.sketch], [FOUND, 1, []]);
});

test("a part of the mask that a click corrects gives way to what is found", async () => {
  desk.document.load(SIZE, encode(drawn("........", "........", "..##....", "..##....", "........", "........")), "", undefined);
  desk.hand.take("click");
  await click(2.5, 2.5);
  assert.ok(desk.asked[0].previous);
  desk.hand.complete();
  assert.deepEqual(mask(), FOUND);
});

test("a box that is dragged is offered while it is dragged", () => {
  desk.hand.take("click");
  desk.hand.begin({ x: 1, y: 1 }, plain, "live");
  desk.hand.move({ x: 5, y: 4 });
  assert.deepEqual(desk.state.candidate?.box, [1, 1, 5, 4]);
});

test("a click on the reference as it was taken asks at its place in the live image", async () => {
  desk.hand.take("click");
  desk.hand.begin({ x: 1.5, y: 1.5 }, plain, "raw reference");
  await desk.hand.release();
  assert.deepEqual(desk.asked, []);
  desk.located[0]();
  await new Promise((done) => setTimeout(done));
  assert.deepEqual(desk.asked[0].clicks.map(({ x, y }) => [x, y]), [[2.5, 1.5]]);
});

test("what a click on the reference corrects is the mask as it is when its place arrives", async () => {
  desk.hand.take("click");
  desk.hand.begin({ x: 1.5, y: 1.5 }, plain, "raw reference");
  desk.document.load(SIZE, encode(drawn(...FULL)), "", undefined);
  desk.located[0]();
  await new Promise((done) => setTimeout(done));
  assert.equal(desk.asked[0].previous.counts, encode(drawn(...FULL)));
});

test("a place that comes after the click was given up is dropped", async () => {
  desk.hand.take("click");
  desk.hand.begin({ x: 1.5, y: 1.5 }, plain, "raw reference");
  desk.hand.cancel();
  desk.located[0]();
  await new Promise((done) => setTimeout(done));
  assert.deepEqual([desk.asked, desk.hand.offering], [[], false]);
});
