/**
 * Why a verdict is given: reasons from a list that people edit, and a comment. What is picked waits
 * for the verdict, region by region; the verdict takes it along.
 * @typedef {{reason: string, comment: string}} Why
 */
import { api } from "../api.js";
import { $ } from "../chrome.js";

const NOTHING = Object.freeze({ reason: "", comment: "" });

export class Reasons {
  /** @param {import("../state.js").State} state
   * @param {(action: string) => string} shown the key of an action */
  constructor(state, shown) {
    this.state = state;
    this.shown = shown;
    /** @type {string[]} */
    this.reasons = [];
    /** What is picked and written but not given yet. @type {Map<number, Why>} */
    this.drafts = new Map();
    $("comment").oninput = () => this.note({ comment: $("comment").value });
    $("comment").onkeydown = (/** @type {KeyboardEvent} */ event) => {
      if (event.key === "Enter") $("comment").blur();
    };
    $("edit-reasons").onclick = () => this.edit();
    $("close-reasons").onclick = () => $("reasons").close();
    $("save-reasons").onclick = () => this.save();
  }

  async load() {
    this.reasons = (await api.reasons()).reasons;
    this.draw();
  }

  /** What is picked for the selected region. @returns {Why} */
  get draft() {
    return this.of(this.state.region?.id ?? 0);
  }

  /** @param {Partial<Why>} change */
  note(change) {
    const { region } = this.state;
    if (region) this.drafts.set(region.id, { ...this.draft, ...change });
  }

  /** Pick a reason for the next verdict on the selected region; once more drops it.
   * @param {number} place in the list */
  pick(place) {
    const reason = this.reasons[place];
    if (!reason || !this.state.region) return;
    this.note({ reason: this.draft.reason === reason ? "" : reason });
    this.draw();
  }

  /** What was picked for a region. @param {number} region @returns {Why} */
  of(region) {
    return this.drafts.get(region) ?? NOTHING;
  }

  /** The verdict on a region is stored. @param {number} region */
  given(region) {
    this.drafts.delete(region);
  }

  draw() {
    const { region, blind, mode } = this.state;
    $("why").hidden = blind || mode !== "audit";
    $("comment").disabled = $("edit-reasons").disabled = !region;
    if (!region) return $("reason-list").replaceChildren();
    const { reason, comment } = this.draft;
    if (document.activeElement !== $("comment")) $("comment").value = comment;
    $("reason-list").replaceChildren(...this.reasons.map((text, place) => {
      const item = document.createElement("li");
      const button = document.createElement("button");
      const key = this.shown(`reason-${place + 1}`);
      if (key) {
        const shown = document.createElement("kbd");
        shown.textContent = key;
        button.append(shown);
      }
      button.append(text);
      button.setAttribute("aria-pressed", String(text === reason));
      button.onclick = () => this.pick(place);
      item.append(button);
      return item;
    }));
  }

  edit() {
    $("reasons-text").value = this.reasons.join("\n");
    $("reasons-wrong").textContent = "";
    $("reasons").showModal();
  }

  async save() {
    const lines = $("reasons-text").value.split("\n").map((/** @type {string} */ line) => line.trim());
    try {
      this.reasons = (await api.putReasons(lines.filter(Boolean))).reasons;
      $("reasons").close();
      this.draw();
    } catch (error) {
      $("reasons-wrong").textContent = error instanceof Error ? error.message : String(error);
    }
  }
}
