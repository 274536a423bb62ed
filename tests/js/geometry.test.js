import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";

import { clamp, fit, fitBox, LARGEST_SCALE, pan, toImage, toScreen, zoomAt } from "../../static/js/geometry.js";

const IMAGE = { width: 200, height: 100 };
const PANE = { width: 400, height: 400 };
const number = (min, max) => fc.double({ min, max, noNaN: true });
const points = fc.record({ x: number(-500, 500), y: number(-500, 500) });
const views = fc.record({ scale: number(0.1, 48), x: number(0, 200), y: number(0, 100) });

function near(found, wanted) {
  for (const [name, value] of Object.entries(wanted)) {
    assert.ok(Math.abs(found[name] - value) < 1e-6, `${name} is ${found[name]}, not ${value}`);
  }
}

test("the whole image fits, its middle in the middle of the pane", () => {
  assert.deepEqual(fit(IMAGE, PANE), { scale: 2, x: 100, y: 50 });
  near(toScreen(fit(IMAGE, PANE), PANE, { x: 0, y: 0 }), { x: 0, y: 100 });
});

test("screen and image are each other's way back", () => {
  fc.assert(fc.property(views, points, (view, at) => {
    near(toScreen(view, PANE, toImage(view, PANE, at)), at);
  }));
});

test("zooming keeps the image point under the cursor", () => {
  fc.assert(fc.property(views, points, number(0.1, 10), (view, at, factor) => {
    near(toImage(zoomAt(view, IMAGE, PANE, at, factor), PANE, at), toImage(view, PANE, at));
  }));
});

test("the scale stays between half of the whole image and the largest", () => {
  const view = fit(IMAGE, PANE);
  assert.equal(zoomAt(view, IMAGE, PANE, { x: 0, y: 0 }, 1e6).scale, LARGEST_SCALE);
  assert.equal(zoomAt(view, IMAGE, PANE, { x: 0, y: 0 }, 1e-6).scale, 1);
  // An image of few pixels may fit at more than the largest scale.
  assert.equal(clamp({ scale: 1e6, x: 1, y: 1 }, { width: 2, height: 2 }, PANE).scale, 200);
});

test("a place past the image comes back to its border", () => {
  assert.deepEqual(clamp({ scale: 2, x: -30, y: 170 }, IMAGE, PANE), { scale: 2, x: 0, y: 100 });
});

test("a box is shown in the middle, with a margin, and never too large", () => {
  near(fitBox([100, 20, 200, 40], PANE), { scale: 400 / 220, x: 150, y: 30 });
  assert.equal(fitBox([5, 5, 6, 6], PANE).scale, 400 / (24 * 2.2));
  assert.equal(fitBox([5, 5, 6, 6], { width: 4000, height: 4000 }).scale, 12);
});

test("panning moves the image with the hand", () => {
  assert.deepEqual(pan({ scale: 4, x: 50, y: 50 }, 8, -4), { scale: 4, x: 48, y: 51 });
});
