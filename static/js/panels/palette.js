/**
 * Everything that can be done, in one list to search: the key table, without knowing a key.
 */
import { $ } from "../chrome.js";
import { findKeys } from "../keys.js";

export class Palette {
  /** @param {import("../keys.js").Keymap} keymap @param {(action: string) => void} act */
  constructor(keymap, act) {
    this.keymap = keymap;
    this.act = act;
    /** @type {import("../keys.js").Key[]} */
    this.found = [];
    this.place = 0;
    $("palette-search").oninput = () => this.search();
    $("palette-search").onkeydown = (event) => {
      const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (by) this.move(by);
      else if (event.key === "Enter") this.run(this.place);
      else return;
      event.preventDefault();
    };
  }

  open() {
    if ($("palette").open) return $("palette").close();
    $("palette-search").value = "";
    $("palette").showModal();
    this.search();
  }

  search() {
    // What is held down cannot be chosen.
    this.found = findKeys($("palette-search").value).filter(({ held, action }) => !held && action !== "palette");
    this.place = 0;
    this.draw();
  }

  /** @param {number} by */
  move(by) {
    this.place = Math.min(Math.max(this.place + by, 0), this.found.length - 1);
    this.draw();
  }

  /** @param {number} place */
  run(place) {
    const entry = this.found[place];
    if (!entry) return;
    $("palette").close();
    this.act(entry.action);
  }

  draw() {
    $("palette-list").replaceChildren(...this.found.map(({ action, group, title }, place) => {
      const item = document.createElement("li");
      item.setAttribute("role", "option");
      item.setAttribute("aria-selected", String(place === this.place));
      const name = document.createElement("span");
      name.textContent = `${group}: ${title}`;
      const key = document.createElement("kbd");
      key.textContent = this.keymap.shown(action);
      item.append(name, key);
      item.onclick = () => this.run(place);
      return item;
    }));
    $("palette-list").querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  }
}
