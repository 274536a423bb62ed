/**
 * The jump field: goes to a pair by "split/number" or by words, those of objects' labels too. A dialog
 * of its own over the page; it lists what fits while one types.
 * @typedef {import("../wire.js").PairSummary} Found
 */

const MOST = 8;
const REST_MS = 80;

export class Jump {
  /** @param {{find: (words: string, most: number) => Promise<Found[]>, open: (id: number) => unknown,
   *   states: Record<string, string>, wrong: (error: unknown) => void}} on */
  constructor(on) {
    this.on = on;
    this.dialog = document.createElement("dialog");
    this.dialog.id = "jump";
    this.dialog.setAttribute("aria-label", "Go to a pair");
    this.field = document.createElement("input");
    this.field.maxLength = 80;
    this.field.spellcheck = false;
    this.field.placeholder = "split/number, or words";
    this.field.setAttribute("aria-label", "Go to a pair: split/number, or words");
    this.field.setAttribute("aria-controls", "jump-list");
    this.list = document.createElement("ol");
    this.list.id = "jump-list";
    this.note = document.createElement("p");
    this.note.className = "soft";
    this.note.setAttribute("role", "status");
    this.dialog.append(this.field, this.list, this.note);
    document.body.append(this.dialog);
    /** @type {Found[]} */
    this.found = [];
    this.place = 0;
    this.asked = 0;
    this.timer = 0;
    /** @type {Promise<void>} what is being looked up */
    this.looking = Promise.resolve();
    this.field.oninput = () => {
      clearTimeout(this.timer);
      this.timer = window.setTimeout(() => this.look(), REST_MS);
    };
    this.field.onkeydown = (event) => this.key(event);
    this.dialog.onclick = (event) => { if (event.target === this.dialog) this.dialog.close(); };
  }

  /** Ask where to go. */
  open() {
    this.field.value = "";
    this.dialog.showModal();
    this.look();
  }

  look() {
    clearTimeout(this.timer);
    this.timer = 0;
    const asked = ++this.asked;
    this.looking = this.on.find(this.field.value.trim(), MOST).then((found) => {
      if (asked !== this.asked) return;
      this.found = found;
      this.place = 0;
      this.draw();
    }, this.on.wrong);
  }

  /** @param {KeyboardEvent} event */
  async key(event) {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key] ?? 0;
    if (!by && event.key !== "Enter") return;
    event.preventDefault();
    // Who types fast means what is typed, not what was found before.
    if (this.timer) this.look();
    await this.looking;
    const count = this.found.length;
    if (!by) return this.go(this.found[this.place]);
    this.place = count && (this.place + by + count) % count;
    this.draw();
  }

  /** @param {Found | undefined} pair */
  go(pair) {
    if (!pair) return;
    this.dialog.close();
    this.on.open(pair.id);
  }

  draw() {
    this.list.replaceChildren(...this.found.map((pair, place) => {
      const item = document.createElement("li");
      const button = document.createElement("button");
      button.append(`${pair.split}/${pair.name}`);
      const stand = document.createElement("span");
      stand.className = "soft";
      stand.textContent = this.on.states[pair.state] ?? pair.state;
      button.append(stand);
      button.setAttribute("aria-current", String(place === this.place));
      button.onclick = () => this.go(pair);
      item.append(button);
      return item;
    }));
    this.note.textContent = this.found.length ? "" : "No pair has that in its name or among its objects.";
  }
}
