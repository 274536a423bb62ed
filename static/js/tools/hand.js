/**
 * The hand that holds a tool. Every tool follows one protocol: `enter` at a press, `move` with the
 * pointer, `release` when the button is let go, `complete` gives what it made, `cancel` takes it
 * back. The hand tells the state what to show meanwhile and hands what was made to the document, as
 * one action. A new tool is a module, an entry in `toolbox.js`, a key and an icon.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {import("../raster.js").Box} Box
 * @typedef {{x: number, y: number}} Point
 * @typedef {{radius: number, subtract: boolean, line: boolean, right: boolean, scale: number,
 *   picture: string}} Options
 *   scale: screen pixels a pixel; picture: what the pane shows
 * @typedef {{before: Mask, box: Box | null, samples: number}} Stroke drawn into the mask already
 * @typedef {{pixels: Uint8Array, part: Uint8Array | null, story: object}} Made to be put into a
 *   layer; part: what gives way to it; story: for the tool log
 * @typedef {{candidate: import("../state.js").Candidate | null, mask: Mask | null, asking: boolean}} Suggestion
 *   mask: what would be taken; asking: the server is asked
 * @typedef {object} Tool
 * @property {string} name
 * @property {boolean} multi it goes on between presses, and follows the pointer
 * @property {boolean} [floats] the mask does not change before it is complete, and may do so otherwise
 * @property {boolean} done a release completes it
 * @property {Point[]} points its outline so far
 * @property {(mask: Mask, at: Point, options: Options) => Box | null} enter what it touched
 * @property {(mask: Mask, at: Point, options: Options) => Box | null} move what it touched
 * @property {(mask: Mask, at: Point, picture: string) => void} [hover] nothing is pressed or begun
 * @property {() => void} [leave] the pointer has left
 * @property {(mask: Mask) => unknown} [release]
 * @property {boolean} [open] there is something to take or to give up
 * @property {Suggestion} [suggestion]
 * @property {(by: number) => boolean} [cycle] whether there is another thing to offer
 * @property {(mask: Mask, way?: string) => Stroke | Made | null} complete null for nothing
 * @property {(mask: Mask) => Box | null} cancel what it touched
 */

export class Hand {
  /** @param {import("../state.js").State} state @param {import("../document.js").PairDocument} document
   * @param {Record<string, Tool>} tools by name @param {() => boolean} may whether the mask may be changed */
  constructor(state, document, tools, may) {
    this.state = state;
    this.document = document;
    this.tools = tools;
    this.may = may;
    /** @type {Tool | null} */
    this.active = null;
    /** @type {Options} */
    this.options = { radius: 1, subtract: false, line: false, right: false, scale: 1, picture: "live" };
  }

  /** The chosen tool. @returns {Tool} */
  get tool() {
    return this.tools[this.state.tool];
  }

  /** Whether the tool offers something to take or to give up. */
  get offering() {
    return this.active?.open ?? false;
  }

  /** Whether a tool is at work that the mask must wait for. */
  get busy() {
    return this.active !== null && !this.active.floats;
  }

  /** Take another tool. What is offered counts as wanted; an outline that is not closed does not.
   * @param {string} name */
  take(name) {
    if (this.offering) this.complete();
    this.cancel();
    this.state.change({ tool: name });
  }

  /** @param {Point} at in the image of the pane
   * @param {{shift: boolean, alt: boolean, right: boolean}} keys @param {string} picture */
  begin(at, { shift, alt, right }, picture) {
    if (!this.may()) return;
    const { radius, view } = this.state;
    this.options = { radius, subtract: alt, line: shift, right, scale: view.scale, picture };
    this.active = this.tool;
    this.show(this.active.enter(this.document.mask, at, this.options));
    if (this.active.multi && this.active.done) this.complete();
  }

  /** @param {Point} at */
  move(at) {
    if (this.active) this.show(this.active.move(this.document.mask, at, this.options));
  }

  /** The pointer moves with no button down. @param {Point} at @param {string} picture */
  hover(at, picture) {
    if (this.busy) return void (this.active?.multi && this.move(at));
    if (this.state.pair && !this.state.locked) this.tool.hover?.(this.document.mask, at, picture);
  }

  leave() {
    this.tool.leave?.();
  }

  /** The pointer was released; what goes on between presses waits for the next one. */
  release() {
    if (this.active?.done) return this.complete();
    return this.active?.release?.(this.document.mask);
  }

  /** Finish what the tool began: one entry of the history, one save.
   * @param {string} [way] in which it becomes part of the mask */
  complete(way = "add") {
    const { document, state } = this;
    // A tool that nothing was begun with may show what it would do.
    const tool = this.active ?? this.tool;
    this.active = null;
    const made = tool.complete(document.mask, way);
    state.sketchOut([], false);
    if (made && "pixels" in made) {
      const layer = way === "ill-posed" ? "ignore" : way === "add" ? state.target : "mask";
      const action = { tool: tool.name, ...(way === "add" ? {} : { way }), ...made.story };
      document.put(layer, way, made.pixels, action, made.part);
    } else if (made) {
      document.commit(state.target, made.before, made.box,
        { tool: tool.name, radius: state.radius, samples: made.samples });
    }
    this.suggest(tool);
  }

  /** Give up what the tool began. */
  cancel() {
    const tool = this.active ?? this.tool;
    this.active = null;
    this.show(tool.cancel(this.document.mask));
  }

  /** Tell the state what the tool has drawn and offers so far. @param {Box | null} [box] what it
   * touched */
  show(box = null) {
    this.state.sketchOut(this.active?.points ?? [], this.busy);
    if (box) this.state.draw(this.state.target, box);
    this.suggest(this.active ?? this.tool);
  }

  /** @param {Tool} tool */
  suggest({ suggestion }) {
    if (suggestion) this.state.suggest(suggestion);
  }
}
