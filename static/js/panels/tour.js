/**
 * The first-run tour: five steps over the pair that is open, each beside what it speaks of.
 */
import { $ } from "../chrome.js";

/** @type {{at: string, title: string, text: string}[]} */
const STEPS = [
  { at: "#panes", title: "Two pictures of one place",
    text: "Left is the reference, turned to the live view; right is the live image with the mask that you correct. Hold Space to blink them, hold Z for the loupe, turn the wheel to zoom." },
  { at: "#strip-layers", title: "What the machines found",
    text: "Rest on a small picture to look at that layer, click it to keep it there." },
  { at: "#proposals", title: "Proposals, one after the other",
    text: "Tab walks them. V adds one to the mask, D takes it out, J rejects it; the next one follows by itself." },
  { at: "#toolbox", title: "Draw what is missing",
    text: "B is the brush, E the eraser. C finds the object under a click; Enter takes it. Everything can be undone, and is saved at once." },
  { at: '[data-action="submit"]', title: "Submit, and go on",
    text: "Enter submits the pair and opens the next one. Ctrl + K lists all commands, ? all keys." },
];

export class Tour {
  /** @param {import("../state.js").State} state */
  constructor(state) {
    this.state = state;
    this.step = 0;
    $("tour-next").onclick = () => this.show(this.step + 1);
    $("tour-skip").onclick = () => $("tour").close();
    $("tour").onclose = () => state.change({ toured: true });
  }

  begin() {
    this.show(0);
  }

  /** @param {number} step */
  show(step) {
    if (step >= STEPS.length) return $("tour").close();
    this.step = step;
    const { at, title, text } = STEPS[step];
    $("tour-place").textContent = `${step + 1} of ${STEPS.length}`;
    $("tour-title").textContent = title;
    $("tour-text").textContent = text;
    $("tour-next").textContent = step + 1 < STEPS.length ? "Next" : "Begin";
    if (!$("tour").open) $("tour").showModal();
    const there = /** @type {Element} */ (document.querySelector(at)).getBoundingClientRect();
    const own = $("tour").getBoundingClientRect();
    const within = (/** @type {number} */ wanted, /** @type {number} */ most) => Math.max(12, Math.min(wanted, most - 12));
    const beside = there.left > window.innerWidth / 2 ? there.left - own.width - 12
      : there.width > own.width * 2 ? there.left + 40 : there.right + 12;
    $("tour").style.left = `${within(beside, window.innerWidth - own.width)}px`;
    $("tour").style.top = `${within(there.top < window.innerHeight / 2 ? there.top + 60 : there.top - own.height - 12, window.innerHeight - own.height)}px`;
  }
}
