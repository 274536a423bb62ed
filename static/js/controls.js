/**
 * Buttons and keys of the page -> actions, and the sheet that lists the keys and changes them.
 * @typedef {(action: string, down: boolean) => void} Act
 * @typedef {import("./keys.js").Keymap} Keymap
 */
import { findKeys, KEYS, keyName } from "./keys.js";

const MODIFIERS = ["Shift", "Control", "Alt", "Meta", "AltGraph", "CapsLock"];

/** Make every button with `data-action` do it; one with `data-held` only while it is down.
 * @param {Act} act */
export function wireButtons(act) {
  for (const element of document.querySelectorAll("button[data-action]")) {
    const control = /** @type {HTMLButtonElement} */ (element);
    const action = /** @type {string} */ (control.dataset.action);
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

/** Write what each control does and its key where the pointer rests on it. @param {Keymap} keymap */
export function titleButtons(keymap) {
  for (const element of document.querySelectorAll("button[data-action], [data-keys]")) {
    const control = /** @type {HTMLElement} */ (element);
    const names = (control.dataset.action ?? control.dataset.keys ?? "").split(" ");
    const entries = KEYS.filter(({ action }) => names.includes(action));
    control.title = entries.map(({ action, title }) => `${title} (${keymap.shown(action)})`).join(" · ");
  }
}

/** Make keys do what the table says. @param {Keymap} keymap @param {Act} act
 * @param {() => HTMLDialogElement | null} openDialog */
export function wireKeys(keymap, act, openDialog) {
  window.addEventListener("keyup", (event) => {
    // Whatever has the focus by now, and whatever else is pressed: a released key is released.
    for (const { held, action } of KEYS) {
      if (held && keymap.key(action) === event.key.toLowerCase()) act(action, false);
    }
  });
  window.addEventListener("keydown", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const key = keyName(event);
    // A dialog that has just been closed keeps the focus for a moment.
    const typing = !target.closest?.("dialog:not([open])");
    const inControl = typing && target.matches?.("button, input, select, textarea, [tabindex]");
    if (inControl && key === "Escape" && !openDialog()) return target.blur();
    const entry = keymap.entry(key);
    if (!entry || event.defaultPrevented) return;
    if (typing && target.matches?.("input:not([type=range]), textarea, select")) return;
    const dialog = openDialog();
    if (dialog && dialog.id !== entry.action) return;
    // A person who walks the controls by keyboard needs these for them.
    if (inControl && ["Tab", "Shift+Tab", "Enter", " ", "ArrowUp", "ArrowDown"].includes(key)) return;
    if (target.matches?.("input") && key.startsWith("Arrow")) return;
    event.preventDefault();
    if (event.repeat && !entry.repeats) return;
    act(entry.action, true);
  });
}

/** List the keys that are searched for, by group; a click on a key waits for another one. @param {HTMLElement} root
 * @param {Keymap} keymap @param {() => void} changed */
export function fillHelp(root, keymap, changed) {
  const search = /** @type {HTMLInputElement} */ (document.getElementById("help-search")).value;
  const found = findKeys(search);
  const groups = [...new Set(found.map((entry) => entry.group))];
  root.replaceChildren(...groups.flatMap((group) => {
    const title = document.createElement("h3");
    title.textContent = group;
    return [title, ...found.filter((entry) => entry.group === group).map((entry) => keyRow(entry, keymap, changed))];
  }));
}

/** @param {import("./keys.js").Key} entry @param {Keymap} keymap @param {() => void} changed */
function keyRow(entry, keymap, changed) {
  const row = document.createElement("div");
  const key = document.createElement("button");
  key.className = "key";
  key.dataset.key = entry.action;
  key.textContent = keymap.shown(entry.action);
  key.title = "Click, then press the new key";
  key.setAttribute("aria-label", `${entry.title}: ${key.textContent}. Change the key`);
  key.onclick = () => {
    key.textContent = "press a key";
    key.dataset.waiting = "yes";
  };
  key.onblur = () => {
    delete key.dataset.waiting;
    key.textContent = keymap.shown(entry.action);
  };
  key.onkeydown = (event) => {
    if (!key.dataset.waiting || MODIFIERS.includes(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    const name = keyName(event);
    const holder = event.key === "Escape" ? null : keymap.change(entry.action, name);
    if (holder) {
      key.textContent = "taken";
      key.title = `${name} already does: ${holder.title}. Give that another key first.`;
      row.dataset.taken = holder.title;
      return;
    }
    delete row.dataset.taken;
    key.blur();
    changed();
  };
  row.append(entry.title, key);
  return row;
}
