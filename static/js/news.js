/**
 * Who wants to hear of what: the one way in which a part learns that the state has changed. Listeners
 * hear in the order in which they came, at once; what they draw waits for the next frame.
 * @template {Record<string, unknown[]>} Told what each topic tells
 */
export class News {
  constructor() {
    /** @type {Map<keyof Told, ((...told: any[]) => void)[]>} */
    this.listeners = new Map();
    /** @type {(() => void)[]} */
    this.watchers = [];
  }

  /** Hear of a topic. @template {keyof Told} Topic @param {Topic} topic
   * @param {(...told: Told[Topic]) => void} listener */
  subscribe(topic, listener) {
    this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
  }

  /** Hear that anything has changed, after those who hear what. @param {() => void} watcher */
  watch(watcher) {
    this.watchers.push(watcher);
  }

  /** @template {keyof Told} Topic @param {Topic} topic @param {Told[Topic]} told */
  tell(topic, ...told) {
    for (const listener of this.listeners.get(topic) ?? []) listener(...told);
    for (const watcher of this.watchers) watcher();
  }
}
