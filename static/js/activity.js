/** Seconds of real work: time between actions counts, up to a pause of five seconds. */

const LONGEST_PAUSE = 5;

export class Activity {
  /** @param {() => number} now seconds */
  constructor(now) {
    this.now = now;
    this.last = now();
    this.seconds = 0;
  }

  /** Something was done. */
  note() {
    const now = this.now();
    this.seconds += Math.min(now - this.last, LONGEST_PAUSE);
    this.last = now;
  }

  /** Return the seconds since the last time, and start again. */
  take() {
    this.note();
    const { seconds } = this;
    this.seconds = 0;
    return seconds;
  }
}
