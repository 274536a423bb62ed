import assert from "node:assert/strict";
import { test } from "node:test";

import { lastPlace, remember, rememberPlace, rememberRevealed, restore } from "../../static/js/memory.js";
import { State } from "../../static/js/state.js";

/** Keeps texts as a browser's storage does. */
class Shelf {
  constructor() {
    this.texts = new Map();
  }

  getItem(name) {
    return this.texts.get(name) ?? null;
  }

  setItem(name, text) {
    this.texts.set(name, text);
  }
}

const signedIn = (annotator) => {
  const state = new State();
  state.signIn(annotator, "store");
  return state;
};

test("settings and revealed pairs come back to the person whose they are, and to nobody else", () => {
  const shelf = new Shelf();
  const ann = signedIn("ann");
  ann.change({ radius: 11, mode: "blind", layers: ["live"] });
  ann.open({ id: 5, run: null, state: "todo" }, 1);
  ann.reveal();
  remember(ann, shelf);
  rememberRevealed(ann, shelf);
  const again = signedIn("ann");
  restore(again, shelf);
  assert.deepEqual([again.radius, again.mode, again.layers, again.revealed], [11, "blind", ["live"], [5]]);
  const ben = signedIn("ben");
  restore(ben, shelf);
  assert.deepEqual([ben.radius, ben.mode, ben.revealed], [new State().radius, "correct", []]);
});

test("nothing is kept before it is known who is signed in", () => {
  const shelf = new Shelf();
  remember(new State(), shelf);
  assert.equal(shelf.texts.size, 0);
});

test("the place is that of the open pair, and there is none before one is open", () => {
  const shelf = new Shelf();
  const state = signedIn("ann");
  rememberPlace(state, shelf);
  assert.equal(lastPlace(shelf), null);
  state.open({ id: 5, run: "doi", state: "todo" }, 1);
  state.look({ scale: 3, x: 1, y: 2 }, false);
  rememberPlace(state, shelf);
  assert.deepEqual(lastPlace(shelf), { pair: 5, run: "doi", view: { scale: 3, x: 1, y: 2 }, selected: null, fitted: false });
});
