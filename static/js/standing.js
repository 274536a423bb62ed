/**
 * How the person's work stands: the line that says whether it is saved, and the banner over the panes
 * while the server cannot be asked. Nothing is called saved then.
 */
import { $ } from "./chrome.js";

/** What waits for the person, with or without the server. */
const DECISIONS = ["conflict", "locked", "refused"];
const WHY = {
  away: "The server is away; your work is kept here and is sent when it is back.",
  "signed out": "You are signed out; your work is kept here and is sent when you have signed in again, in another tab.",
};

export class Standing {
  constructor() {
    this.status = "opening";
    this.detail = "";
    this.pair = "";
    /** @type {keyof typeof WHY | null} why the server cannot be asked */
    this.apart = null;
  }

  /** @param {string} status of the saver @param {string} detail @param {string} [pair] that waits for
   * the person */
  saving(status, detail, pair = "") {
    Object.assign(this, { status, detail, pair });
    this.draw();
  }

  /** The desk's socket is open. */
  joined() {
    this.apart = null;
    this.draw();
  }

  /** The desk's socket is closed. @param {Promise<number>} answer status of another request, 0 for none */
  async parted(answer) {
    this.apart ??= "away";
    this.draw();
    const status = await answer;
    // It may be open again by now.
    if (this.apart) this.apart = status === 401 ? "signed out" : "away";
    this.draw();
  }

  draw() {
    const status = this.apart && !DECISIONS.includes(this.status) ? "offline" : this.status;
    $("save").dataset.status = status;
    $("save").title = this.detail;
    const said = this.pair && status === this.status ? `${status}, ${this.pair}` : status;
    $("save").textContent = this.detail && status !== "conflict" ? `${said}: ${this.detail}` : said;
    $("away").textContent = WHY[this.apart ?? (this.detail ? "signed out" : "away")];
    $("away").hidden = !this.apart && status !== "offline";
  }
}
