/**
 * How the person's work stands: the line that says whether it is saved, and the banner over the panes
 * while the server is away. Nothing is called saved then.
 */
import { $ } from "./chrome.js";

const AWAY = "The server is away; your work is kept here and is sent when it is back.";

/** What waits for the person, with or without the server. */
const DECISIONS = ["conflict", "locked", "refused"];

export class Standing {
  constructor() {
    this.status = "opening";
    this.detail = "";
    this.away = false;
  }

  /** @param {string} status of the saver @param {string} detail */
  saving(status, detail) {
    Object.assign(this, { status, detail });
    this.draw();
  }

  /** @param {boolean} away whether the desk's socket is closed */
  server(away) {
    this.away = away;
    this.draw();
  }

  draw() {
    const status = this.away && !DECISIONS.includes(this.status) ? "offline" : this.status;
    $("save").dataset.status = status;
    $("save").textContent = this.detail && status !== "conflict" ? `${status}: ${this.detail}` : status;
    $("away").textContent = status === "offline" && this.detail ? `Your work is kept here. You are ${this.detail}.` : AWAY;
    $("away").hidden = status !== "offline";
  }
}
