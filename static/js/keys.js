/**
 * The key table: one place that says which key does what. `?` shows it, and lets people change it.
 * A key is written as KeyboardEvent.key, with "Ctrl+" and "Shift+" before it where needed;
 * "Ctrl" also stands for Command.
 */

/** `held` acts while the key is down, `repeats` acts again while it stays down.
 * @typedef {{key: string, action: string, title: string, group: string, held?: boolean,
 *   repeats?: boolean}} Key */

/** @type {Key[]} */
export const KEYS = [
  { key: "b", action: "brush", title: "Brush", group: "Draw" },
  { key: "e", action: "eraser", title: "Eraser", group: "Draw" },
  { key: "c", action: "click", title: "Click: find the object", group: "Draw" },
  { key: "q", action: "polygon", title: "Polygon", group: "Draw" },
  { key: "l", action: "lasso", title: "Lasso", group: "Draw" },
  { key: "m", action: "magnetic", title: "Magnetic lasso", group: "Draw" },
  { key: "x", action: "box", title: "Box", group: "Draw" },
  { key: "k", action: "fill", title: "Flood fill", group: "Draw" },
  { key: "i", action: "target", title: "Draw ill-posed pixels, or change again", group: "Draw" },
  { key: "[", action: "smaller", title: "Smaller brush", group: "Draw", repeats: true },
  { key: "]", action: "larger", title: "Larger brush", group: "Draw", repeats: true },
  { key: "Ctrl+z", action: "undo", title: "Undo", group: "Draw", repeats: true },
  { key: "Ctrl+Shift+z", action: "redo", title: "Redo", group: "Draw", repeats: true },
  { key: "Escape", action: "cancel", title: "Take back the stroke in the air, or the candidate", group: "Draw" },
  { key: "p", action: "take", title: "Replace the mask with the prediction", group: "Draw" },
  { key: "Shift+ArrowLeft", action: "cursor-left", title: "Cursor left", group: "Cursor", repeats: true },
  { key: "Shift+ArrowRight", action: "cursor-right", title: "Cursor right", group: "Cursor", repeats: true },
  { key: "Shift+ArrowUp", action: "cursor-up", title: "Cursor up", group: "Cursor", repeats: true },
  { key: "Shift+ArrowDown", action: "cursor-down", title: "Cursor down", group: "Cursor", repeats: true },
  { key: "Shift+Enter", action: "press", title: "Use the tool at the cursor", group: "Cursor" },
  { key: "Alt+Enter", action: "press-other", title: "Use it the other way: take away", group: "Cursor" },
  { key: "Shift+h", action: "fill-holes", title: "Fill holes", group: "Clean up" },
  { key: "Shift+d", action: "drop-specks", title: "Drop specks under 20 px", group: "Clean up" },
  { key: "Shift+k", action: "keep-component", title: "Keep only the part under the cursor", group: "Clean up" },
  { key: "Shift+g", action: "grow", title: "Grow by 1 px", group: "Clean up" },
  { key: "Shift+s", action: "shrink", title: "Shrink by 1 px", group: "Clean up" },
  { key: "Shift+m", action: "smooth", title: "Smooth the border", group: "Clean up" },
  { key: "h", action: "hide", title: "Hide overlays (hold)", group: "Look", held: true },
  { key: " ", action: "blink", title: "Blink live and reference (hold)", group: "Look", held: true },
  { key: "s", action: "swipe", title: "Swipe: reference left of the cursor (hold)", group: "Look", held: true },
  { key: "z", action: "loupe", title: "Loupe: the place under the cursor six times as large (hold)", group: "Look", held: true },
  ...[1, 2, 3, 4, 5, 6, 7, 8, 9].map((n) => ({ key: `Alt+${n}`, action: `layer-${n}`,
    title: `Layer ${n} of the strip, in the pane under the cursor`, group: "Look" })),
  { key: "n", action: "outline", title: "Outline only", group: "Look" },
  { key: "Shift+u", action: "unseen", title: "Veil what the run has not seen, on live and reference", group: "Look" },
  { key: "Shift+ ", action: "sweep", title: "Sweep: look at the next tile from close by", group: "Look" },
  { key: "f", action: "fit", title: "Fit the whole image", group: "Look" },
  { key: "g", action: "goto", title: "Fit the selected proposal", group: "Look" },
  { key: "-", action: "fainter", title: "Fainter overlays", group: "Look", repeats: true },
  { key: "=", action: "stronger", title: "Stronger overlays", group: "Look", repeats: true },
  { key: ",", action: "darker", title: "Darker picture", group: "Look", repeats: true },
  { key: ".", action: "brighter", title: "Brighter picture", group: "Look", repeats: true },
  { key: "<", action: "flatter", title: "Less contrast", group: "Look", repeats: true },
  { key: ">", action: "crisper", title: "More contrast", group: "Look", repeats: true },
  { key: "/", action: "plain", title: "Brightness and contrast as taken", group: "Look" },
  { key: "Tab", action: "next-proposal", title: "Next proposal, or candidate of a click", group: "Propose", repeats: true },
  { key: "Shift+Tab", action: "previous-proposal", title: "Previous one", group: "Propose", repeats: true },
  { key: "v", action: "add", title: "Add to the mask", group: "Propose" },
  { key: "d", action: "subtract", title: "Take out of the mask", group: "Propose" },
  { key: "r", action: "replace", title: "Replace what it touches", group: "Propose" },
  { key: "j", action: "reject-proposal", title: "Reject", group: "Propose" },
  { key: "Shift+j", action: "reject-rest", title: "Reject all that is left undecided", group: "Propose" },
  { key: "u", action: "ill-posed", title: "Mark as ill-posed: not scored", group: "Propose" },
  { key: "y", action: "source", title: "Proposals of the next source", group: "Propose" },
  { key: "1", action: "agree", title: "Agree with the decision", group: "Audit" },
  { key: "2", action: "adopt", title: "Adopt the object", group: "Audit" },
  { key: "3", action: "keep", title: "Keep the detector's mask", group: "Audit" },
  { key: "4", action: "reject", title: "Reject: nothing changed here", group: "Audit" },
  ...[1, 2, 3, 4, 5].map((n) => ({ key: String(n + 4), action: `reason-${n}`,
    title: `Reason ${n} of the list, for the next verdict`, group: "Audit" })),
  { key: "Enter", action: "submit", title: "Finish the outline or candidate; else submit, and open the next pair", group: "Pair" },
  { key: "a", action: "approve", title: "Approve, and open the next pair", group: "Pair" },
  { key: "0", action: "empty", title: "Confirm empty: no change; and open the next pair", group: "Pair" },
  { key: "Shift+b", action: "skip", title: "Badly aligned: reject all of its regions, and skip the pair", group: "Pair" },
  { key: "o", action: "reopen", title: "Reopen a finished pair", group: "Pair" },
  { key: "ArrowRight", action: "next", title: "Next pair (audit: next region)", group: "Pair" },
  { key: "ArrowLeft", action: "previous", title: "Previous pair (audit: previous region)", group: "Pair" },
  { key: "Ctrl+g", action: "jump", title: "Go to a pair: split/number, or words", group: "Pair" },
  { key: "t", action: "side", title: "Proposals or history", group: "Pair" },
  { key: "w", action: "mode", title: "Next mode: correct, blind first, audit", group: "Pair" },
  { key: "Shift+l", action: "theme", title: "Dark or light", group: "Look" },
  { key: "\\", action: "drawer", title: "Show or hide the queue", group: "Page" },
  { key: "Alt+m", action: "map", title: "The map, large; Escape comes back", group: "Page" },
  { key: "Alt+w", action: "what-if", title: "What if: other thresholds and rules", group: "Page" },
  { key: "Alt+s", action: "scores", title: "Scores", group: "Page" },
  { key: "Ctrl+k", action: "palette", title: "Search all commands", group: "Page" },
  { key: "Ctrl+F1", action: "tour", title: "Show the tour", group: "Page" },
  { key: "F6", action: "controls", title: "Walk the controls with Tab; Escape leaves them", group: "Page" },
  { key: "?", action: "help", title: "Show or hide this list", group: "Page" },
];

/** The entries that all words of a search are in. @param {string} search */
export function findKeys(search) {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return KEYS.filter(({ group, title }) => {
    const text = `${group} ${title}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

/** The name of the key of an event, as the table writes it. @param {KeyboardEvent} event */
export function keyName(event) {
  const printable = event.key.length === 1;
  const key = printable ? event.key.toLowerCase() : event.key;
  // AltGr is how many keyboards write brackets, and reports Ctrl and Alt.
  const composed = event.getModifierState("AltGraph");
  const control = (event.ctrlKey || event.metaKey) && !composed;
  const alt = event.altKey && !composed ? "Alt+" : "";
  // A printable key already says by itself whether Shift was down ("?"), but for letters and the space.
  const shift = event.shiftKey && (!printable || key === " " || key !== key.toUpperCase());
  return alt + (control ? "Ctrl+" : "") + (shift ? "Shift+" : "") + key;
}

/** Which key does which action, for one person: the table with that person's changes. */
export class Keymap {
  /** @param {Record<string, string>} changes keys by action */
  constructor(changes = {}) {
    this.changes = changes;
  }

  /** @param {string} action @returns {string} "" for an action without a key */
  key(action) {
    return this.changes[action] ?? KEYS.find((entry) => entry.action === action)?.key ?? "";
  }

  /** @param {string} key @returns {Key | null} */
  entry(key) {
    return KEYS.find((entry) => this.key(entry.action) === key) ?? null;
  }

  /** The key as people read it. @param {string} action */
  shown(action) {
    return this.key(action).replace("Arrow", "").replace("Right", "→").replace("Left", "←")
      .replace("Up", "↑").replace("Down", "↓").replace(/ $/, "Space");
  }

  /** Give an action another key; a key that another action has stays with that one.
   * @param {string} action @param {string} key @returns {Key | null} who has the key already */
  change(action, key) {
    const holder = this.entry(key);
    if (holder && holder.action !== action) return holder;
    const usual = KEYS.find((entry) => entry.action === action)?.key === key;
    const { [action]: _, ...others } = this.changes;
    this.changes = usual ? others : { ...others, [action]: key };
    return null;
  }
}
