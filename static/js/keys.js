/**
 * The key table: one place that says which key does what. `?` shows it.
 * A key is written as KeyboardEvent.key, with "Ctrl+" and "Shift+" before it where needed;
 * "Ctrl" also stands for Command.
 */

/** `held` acts while the key is down, `repeats` acts again while it stays down.
 * @type {{key: string, action: string, title: string, group: string, held?: boolean, repeats?: boolean}[]} */
export const KEYS = [
  { key: "b", action: "brush", title: "Brush", group: "Draw" },
  { key: "e", action: "eraser", title: "Eraser", group: "Draw" },
  { key: "q", action: "polygon", title: "Polygon", group: "Draw" },
  { key: "l", action: "lasso", title: "Lasso", group: "Draw" },
  { key: "x", action: "box", title: "Box", group: "Draw" },
  { key: "k", action: "fill", title: "Flood fill", group: "Draw" },
  { key: "[", action: "smaller", title: "Smaller brush", group: "Draw", repeats: true },
  { key: "]", action: "larger", title: "Larger brush", group: "Draw", repeats: true },
  { key: "Ctrl+z", action: "undo", title: "Undo", group: "Draw", repeats: true },
  { key: "Ctrl+Shift+z", action: "redo", title: "Redo", group: "Draw", repeats: true },
  { key: "Escape", action: "cancel", title: "Take back the stroke in the air", group: "Draw" },
  { key: "Shift+h", action: "fill-holes", title: "Fill holes", group: "Clean up" },
  { key: "Shift+d", action: "drop-specks", title: "Drop specks under 20 px", group: "Clean up" },
  { key: "Shift+k", action: "keep-component", title: "Keep only the part under the cursor", group: "Clean up" },
  { key: "Shift+g", action: "grow", title: "Grow by 1 px", group: "Clean up" },
  { key: "Shift+s", action: "shrink", title: "Shrink by 1 px", group: "Clean up" },
  { key: "Shift+m", action: "smooth", title: "Smooth the border", group: "Clean up" },
  { key: "p", action: "take", title: "Replace the mask with the prediction", group: "Draw" },
  { key: "h", action: "hide", title: "Hide overlays (hold)", group: "Look", held: true },
  { key: " ", action: "blink", title: "Blink live and reference (hold)", group: "Look", held: true },
  { key: "s", action: "swipe", title: "Swipe: reference left of the cursor (hold)", group: "Look", held: true },
  { key: "n", action: "outline", title: "Outline only", group: "Look" },
  { key: "f", action: "fit", title: "Fit the whole image", group: "Look" },
  { key: "g", action: "goto", title: "Fit the selected region", group: "Look" },
  { key: "-", action: "fainter", title: "Fainter overlays", group: "Look", repeats: true },
  { key: "=", action: "stronger", title: "Stronger overlays", group: "Look", repeats: true },
  { key: "Tab", action: "next-region", title: "Next region", group: "Audit", repeats: true },
  { key: "Shift+Tab", action: "previous-region", title: "Previous region", group: "Audit", repeats: true },
  { key: "1", action: "agree", title: "Agree with the decision", group: "Audit" },
  { key: "2", action: "adopt", title: "Adopt the object", group: "Audit" },
  { key: "3", action: "keep", title: "Keep the detector's mask", group: "Audit" },
  { key: "4", action: "reject", title: "Reject: nothing changed here", group: "Audit" },
  { key: "Shift+a", action: "add-region", title: "Add the region to the mask", group: "Audit" },
  { key: "Shift+x", action: "subtract-region", title: "Take the region out of the mask", group: "Audit" },
  { key: "Shift+r", action: "replace-region", title: "Replace what the region touches", group: "Audit" },
  { key: "Enter", action: "submit", title: "Submit, and open the next pair", group: "Pair" },
  { key: "a", action: "approve", title: "Approve", group: "Pair" },
  { key: "0", action: "empty", title: "Confirm empty: no change", group: "Pair" },
  { key: "o", action: "reopen", title: "Reopen a finished pair", group: "Pair" },
  { key: "ArrowRight", action: "next", title: "Next pair", group: "Pair" },
  { key: "ArrowLeft", action: "previous", title: "Previous pair", group: "Pair" },
  { key: "?", action: "help", title: "Show or hide this list", group: "Pair" },
];

/** The name of the key of an event, as the table writes it. @param {KeyboardEvent} event */
export function keyName(event) {
  const printable = event.key.length === 1;
  const key = printable ? event.key.toLowerCase() : event.key;
  // AltGr is how many keyboards write brackets, and reports Ctrl and Alt.
  const composed = event.getModifierState("AltGraph");
  const control = (event.ctrlKey || event.metaKey) && !composed;
  const alt = event.altKey && !composed ? "Alt+" : "";
  // A printable key already says by itself whether Shift was down ("?"), but for letters.
  const shift = event.shiftKey && (!printable || key !== key.toUpperCase());
  return alt + (control ? "Ctrl+" : "") + (shift ? "Shift+" : "") + key;
}

/** @param {string} name @returns {string | null} */
export function actionOf(name) {
  const entry = KEYS.find((candidate) => candidate.key === name);
  return entry ? entry.action : null;
}

/** @param {string} action @returns {string} */
export function keyOf(action) {
  const entry = KEYS.find((candidate) => candidate.action === action);
  return entry ? entry.key.replace("ArrowRight", "→").replace("ArrowLeft", "←").replace(/^ $/, "Space") : "";
}
