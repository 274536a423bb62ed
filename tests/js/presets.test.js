import assert from "node:assert/strict";
import { test } from "node:test";

import { STRIP } from "../../static/js/strip.js";
import { LAYERS } from "../../static/js/layers.js";
import { PRESETS, presetOf } from "../../static/js/presets.js";

test("a preset is told by its mode and its panes in their order", () => {
  for (const [name, { layers, mode }] of Object.entries(PRESETS)) assert.equal(presetOf({ mode, layers: [...layers] }), name);
  assert.equal(presetOf({ mode: "correct", layers: ["live", "warped"] }), "");
  assert.equal(presetOf({ mode: "blind", layers: ["warped"] }), "");
});

test("presets and the strip show layers that there are, and the strip shows each once", () => {
  for (const { layers } of Object.values(PRESETS)) for (const layer of layers) assert.ok(layer in LAYERS);
  assert.deepEqual([...STRIP].sort(), Object.keys(LAYERS).sort());
});
