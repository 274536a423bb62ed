import assert from "node:assert/strict";
import { test } from "node:test";

import { findKeys, Keymap, keyName, KEYS } from "../../static/js/keys.js";

/** An event of the keyboard, as far as the table reads it. */
const pressed = (key, { ctrl = false, meta = false, alt = false, shift = false, altGraph = false } = {}) => ({
  key, ctrlKey: ctrl, metaKey: meta, altKey: alt, shiftKey: shift,
  getModifierState: (name) => name === "AltGraph" && altGraph,
});

for (const [event, name] of [
  [pressed("b"), "b"],
  [pressed("B", { shift: true }), "Shift+b"],
  // Caps Lock writes large letters without Shift.
  [pressed("B"), "b"],
  [pressed("?", { shift: true }), "?"],
  [pressed("z", { ctrl: true }), "Ctrl+z"],
  [pressed("Z", { meta: true, shift: true }), "Ctrl+Shift+z"],
  [pressed("x", { alt: true }), "Alt+x"],
  [pressed("[", { ctrl: true, alt: true, altGraph: true }), "["],
  [pressed("Tab", { shift: true }), "Shift+Tab"],
  [pressed("ArrowLeft", { shift: true }), "Shift+ArrowLeft"],
  [pressed(" "), " "],
]) {
  test(`a key press is written as ${name === " " ? "a space" : name}`, () => assert.equal(keyName(event), name));
}

test("every action and every key stands in the table once", () => {
  assert.equal(new Set(KEYS.map(({ action }) => action)).size, KEYS.length);
  assert.equal(new Set(KEYS.map(({ key }) => key)).size, KEYS.length);
});

test("a person's key takes the place of the usual one", () => {
  const keymap = new Keymap();
  assert.equal(keymap.change("brush", "Alt+b"), null);
  assert.equal(keymap.entry("Alt+b")?.action, "brush");
  assert.equal(keymap.entry("b"), null);
  assert.deepEqual(keymap.changes, { brush: "Alt+b" });
});

test("a key that another action has stays with that one", () => {
  const keymap = new Keymap({ brush: "Alt+b" });
  assert.equal(keymap.change("eraser", "Alt+b")?.action, "brush");
  assert.deepEqual(keymap.changes, { brush: "Alt+b" });
  // The usual key of the brush is free now.
  assert.equal(keymap.change("eraser", "b"), null);
  assert.equal(keymap.entry("b")?.action, "eraser");
});

test("the usual key again is no change to remember, and neither is the key that it has", () => {
  const keymap = new Keymap({ brush: "Alt+b", eraser: "Alt+e" });
  assert.equal(keymap.change("brush", "Alt+b"), null);
  assert.equal(keymap.change("brush", "b"), null);
  assert.deepEqual(keymap.changes, { eraser: "Alt+e" });
});

test("keys are shown as people read them, and an action without one as nothing", () => {
  const keymap = new Keymap();
  const shown = ["cursor-left", "next", "cursor-up", "blink", "undo", "no such action"].map((action) => keymap.shown(action));
  assert.deepEqual(shown, ["Shift+←", "→", "Shift+↑", "Space", "Ctrl+z", ""]);
});

test("a search finds the entries that have all of its words, in any order and case", () => {
  const found = (search) => findKeys(search).map(({ action }) => action);
  assert.deepEqual(found("LARGER brush"), ["larger"]);
  assert.deepEqual(found("clean up specks"), ["drop-specks"]);
  assert.deepEqual(found("no such thing"), []);
  assert.equal(found("  ").length, KEYS.length);
});
