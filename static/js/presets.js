/**
 * Arrangements of the panes for what people come to do. Pure data, and which one is set.
 * @typedef {{title: string, mode: "correct" | "blind" | "audit", layers: string[]}} Preset
 */

/** @type {Record<string, Preset>} */
export const PRESETS = {
  draw: { title: "Draw", mode: "correct", layers: ["warped", "live"] },
  audit: { title: "Audit", mode: "audit", layers: ["warped", "live", "detector", "objects_live"] },
  blind: { title: "Blind", mode: "blind", layers: ["warped", "live"] },
  compare: { title: "Compare runs", mode: "correct", layers: ["live", "prediction"] },
};

/** The preset that mode and panes are those of, "" for an arrangement of the person's own.
 * @param {{mode: string, layers: string[]}} state */
export function presetOf({ mode, layers }) {
  const found = Object.entries(PRESETS).find(([, preset]) => preset.mode === mode && preset.layers.join() === layers.join());
  return found?.[0] ?? "";
}
