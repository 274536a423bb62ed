/**
 * Buttons and keys of the page -> actions, and the list of keys. Knows the key table, no state.
 * @typedef {(action: string, down: boolean) => void} Act
 */
import { actionOf, KEYS, keyName, keyOf } from "./keys.js";

/** Make every button with `data-action` do it; one with `data-held` only while it is down.
 * @param {Act} act */
export function wireButtons(act) {
  for (const element of document.querySelectorAll("button[data-action]")) {
    const control = /** @type {HTMLButtonElement} */ (element);
    const action = /** @type {string} */ (control.dataset.action);
    const entry = KEYS.find((candidate) => candidate.action === action);
    if (entry) control.title = `${entry.title} (${keyOf(action)})`;
    if (control.dataset.held) {
      control.onpointerdown = () => act(action, true);
      control.onpointerup = control.onpointerleave = () => act(action, false);
    } else {
      control.onclick = () => {
        act(action, true);
        control.blur();
      };
    }
  }
}

/** Make keys do what the table says. @param {Act} act @param {() => boolean} dialogOpen */
export function wireKeys(act, dialogOpen) {
  for (const type of /** @type {const} */ (["keydown", "keyup"])) {
    window.addEventListener(type, (event) => {
      const target = /** @type {HTMLElement} */ (event.target);
      const action = actionOf(keyName(event));
      if (type === "keyup") {
        // Whatever has the focus by now, and whatever else is pressed: a released key is released.
        for (const entry of KEYS) if (entry.held && entry.key === event.key.toLowerCase()) act(entry.action, false);
        return;
      }
      const entry = KEYS.find((candidate) => candidate.action === action);
      if (!action || !entry || target.matches?.("input:not([type=range]), textarea, select")) return;
      if (dialogOpen() && action !== "help") return;
      // A person who walks the controls by keyboard needs Tab and Enter for them.
      if (target.matches?.("button, input") && ["Tab", "Shift+Tab", "Enter", " "].includes(entry.key)) return;
      event.preventDefault();
      if (event.repeat && !entry.repeats) return;
      act(action, true);
    });
  }
}

/** List the keys, by group. @param {HTMLElement} root */
export function fillHelp(root) {
  const groups = [...new Set(KEYS.map((entry) => entry.group))];
  root.append(...groups.flatMap((group) => {
    const title = document.createElement("h3");
    title.textContent = group;
    return [title, ...KEYS.filter((entry) => entry.group === group).map((entry) => {
      const row = document.createElement("div");
      const key = document.createElement("kbd");
      key.textContent = keyOf(entry.action);
      row.append(entry.title, key);
      return row;
    })];
  }));
}
