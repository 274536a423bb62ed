/**
 * Draw the state on the panes: one requestAnimationFrame loop, which sleeps while nothing changes.
 * Reads the state and writes nothing of it.
 * @typedef {import("./state.js").State} State
 * @typedef {import("./maskview.js").MaskView} MaskView
 * @typedef {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} Context
 */
import { fit, toScreen } from "./geometry.js";
import { doubtOf, LAYERS, levelAt } from "./layers.js";
import { drawMarks, strokeTwice } from "./marks.js";

const CALM_MS = 140;
/** How opaque a suggestion is on a mask alone. */
const SUGGESTED = 0.6;

export class View {
  /** @param {State} state @param {import("./panes.js").Panes} panes
   * @param {Record<"mask" | "ignore" | "candidate" | "proposal", MaskView>} masks what lies over the pictures
   * @param {import("./layers.js").Pictures} pictures
   * @param {(layer: string, level?: number) => string} url address of a layer of the open pair
   * @param {() => void} drawn what is written about the state can be written too */
  constructor(state, panes, masks, pictures, url, drawn) {
    this.state = state;
    this.panes = panes;
    this.masks = masks;
    this.pictures = pictures;
    this.url = url;
    this.drawn = drawn;
    this.asked = false;
    /** The masks as drawn last, and since when they are so. */
    this.versions = "";
    this.changed = 0;
    /** @type {any} draws again, and well, when nothing has changed for a moment */
    this.calm = 0;
  }

  /** Draw soon. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => {
      this.asked = false;
      this.draw(now);
    });
  }

  /** Draw at once: an answer that was waited for need not wait for the next frame too. */
  now() {
    this.draw(performance.now());
  }

  /** @param {number} now */
  draw(now) {
    const { state, panes } = this;
    if (!state.pair) return;
    const reference = state.blinking && Math.floor((now - state.blinkedAt) / state.blinkMs) % 2 === 0;
    const versions = Object.values(this.masks).map((mask) => mask.version).join();
    if (versions !== this.versions) {
      this.versions = versions;
      this.changed = now;
      clearTimeout(this.calm);
      this.calm = setTimeout(() => this.ask(), CALM_MS + 20);
    }
    const rough = state.drawing || now - this.changed < CALM_MS;
    const shown = state.shownLayers;
    const wanted = state.wantedLayers;
    const complete = panes.items.map((item, index) => {
      const doubt = doubtOf(wanted[index], shown[index], state.pair?.doubt ?? "");
      return this.drawPane(item, shown[index], reference, rough, doubt);
    });
    // For scripts that look on: where the view is, and the pair once all of its pictures are drawn.
    const { scale, x, y } = state.view;
    panes.root.dataset.view = `${scale} ${x} ${y}`;
    panes.root.dataset.shown = complete.every(Boolean) ? String(state.pair.id) : "";
    this.drawn();
    if (state.blinking) this.ask();
  }

  /** What lies under the mask is drawn once and kept until something of it changes, and what lies
   * under the cursor too, once the masks are still: a stroke then costs a copy of the pane and the
   * mask, and a moving pointer costs a copy.
   * @param {import("./panes.js").Pane} item @param {string} name @param {boolean} reference
   * @param {boolean} rough something changes just now @param {string} doubt what to say of the pair
   * @returns {boolean} whether all of its pictures were there */
  drawPane(item, name, reference, rough, doubt) {
    const { state, panes } = this;
    const context = item.canvas.getContext("2d", { alpha: false });
    if (!context || !state.pair) return false;
    const layer = LAYERS[name];
    const size = panes.size();
    const ratio = item.canvas.width / size.width;
    const { scale } = state.view;
    const corner = toScreen(state.view, size, { x: 0, y: 0 });
    const place = /** @type {const} */ ([ratio * scale, 0, 0, ratio * scale, ratio * corner.x, ratio * corner.y]);
    const ground = this.ground(item, layer, reference, place);
    const swiping = state.swiping && layer.base === "live";
    context.setTransform(1, 0, 0, 1, 0, 0);
    if (rough || swiping) {
      context.drawImage(ground.canvas, 0, 0);
      context.setTransform(...place);
      context.imageSmoothingEnabled = scale < 2.5;
      if (swiping) this.drawSwipe(context, scale);
      this.drawMasks(context, layer.mask, rough);
    } else {
      context.drawImage(this.still(item, layer, ground.canvas, place), 0, 0);
      context.setTransform(...place);
    }
    drawMarks(context, state, scale);
    if (item.select.value !== name) item.select.value = name;
    const note = ground.note || doubt;
    if (item.note.textContent !== note) item.note.textContent = note;
    item.note.classList.toggle("doubt", !ground.note);
    return ground.complete;
  }

  /** Draw a layer as a whole, small. @param {import("./panes.js").Small} item @param {string} name
   * @returns {boolean} whether all of its pictures were there */
  drawSmall(item, name) {
    const { pair } = this.state;
    const context = item.canvas.getContext("2d", { alpha: false });
    if (!pair || !context) return false;
    const { width, height } = item.canvas;
    const { scale } = fit(pair, { width, height });
    const place = /** @type {const} */ ([scale, 0, 0, scale, (width - scale * pair.width) / 2, (height - scale * pair.height) / 2]);
    const layer = LAYERS[name];
    const { canvas, complete } = this.ground(item, layer, false, place);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(canvas, 0, 0);
    const alone = layer.mask === "alone" ? this.masks.mask.alone : layer.mask === "ignore" ? this.masks.ignore.alone : null;
    context.setTransform(...place);
    if (alone) context.drawImage(alone, 0, 0);
    return complete;
  }

  /** Return the pane's pictures with the masks on them, well smoothed.
   * @param {import("./panes.js").Pane} item @param {import("./layers.js").Layer} layer
   * @param {OffscreenCanvas} ground
   * @param {readonly [number, number, number, number, number, number]} place */
  still(item, layer, ground, place) {
    const { state } = this;
    const key = [item.ground.key, this.versions, state.outline, state.hidden, layer.mask].join();
    const { canvas } = item.still;
    if (item.still.key === key) return canvas;
    item.still.key = key;
    canvas.width = ground.width;
    canvas.height = ground.height;
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
    context.drawImage(ground, 0, 0);
    context.setTransform(...place);
    context.imageSmoothingEnabled = state.view.scale < 2.5;
    this.drawMasks(context, layer.mask, false);
    return canvas;
  }

  /** Return the pane's pictures, drawn in place. @param {import("./panes.js").Small} item
   * @param {import("./layers.js").Layer} layer @param {boolean} reference
   * @param {readonly [number, number, number, number, number, number]} place
   * @returns {{canvas: OffscreenCanvas, note: string, complete: boolean}} */
  ground(item, layer, reference, place) {
    const { state } = this;
    const { layers, width, height } = /** @type {import("./state.js").Pair} */ (state.pair);
    const available = [layer.base, layer.overlay].every((l) => !l || layers.includes(l));
    const secret = Boolean(layer.machine) && state.blind;
    const swap = reference && layer.base === "live" && layers.includes(state.past);
    const wanted = [swap ? state.past : layer.base, state.hidden || secret ? "" : layer.overlay ?? ""];
    // The reference as it was taken lies in another frame than what is unseen.
    const veiled = state.veiled && !state.hidden && layers.includes("unseen") && ["live", "warped"].includes(wanted[0]);
    wanted.push(veiled && layer.overlay !== "unseen" ? "unseen" : "");
    const level = levelAt({ width, height }, place[0]);
    const [base, overlay, veil] = wanted.map((l) =>
      l && available ? this.pictures.best((k) => this.url(l, k), level) : null);
    const key = [place, item.canvas.width, item.canvas.height, state.opacity, state.brightness, state.contrast,
      state.dark, layer.dim, wanted.map((l) => this.url(l)),
      ...[base, overlay, veil].map((picture) => picture?.bitmap?.width ?? 0)].join();
    const note = secret ? "Hidden until you have submitted"
      : available ? base?.error || overlay?.error || veil?.error || "" : `${layer.title}: not in this run yet`;
    const complete = [base, overlay, veil].every((picture) => !picture || picture.bitmap || picture.error);
    if (item.ground.key === key) return { canvas: item.ground.canvas, note, complete };
    const { canvas } = item.ground;
    canvas.width = item.canvas.width;
    canvas.height = item.canvas.height;
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d"));
    context.fillStyle = state.dark ? "#0c0e11" : "#dfe3e8";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(...place);
    context.imageSmoothingEnabled = state.view.scale < 2.5;
    const plain = state.brightness === 1 && state.contrast === 1;
    context.filter = plain ? "none" : `brightness(${state.brightness}) contrast(${state.contrast})`;
    if (base?.bitmap) context.drawImage(base.bitmap, 0, 0, width, height);
    context.filter = "none";
    if (overlay?.bitmap && layer.dim) {
      context.fillStyle = "rgba(0, 0, 0, 0.35)";
      context.fillRect(0, 0, width, height);
    }
    context.globalAlpha = Math.min(1, 0.35 + state.opacity);
    for (const laid of [veil, overlay]) if (laid?.bitmap) context.drawImage(laid.bitmap, 0, 0, width, height);
    context.globalAlpha = 1;
    item.ground.key = key;
    return { canvas, note, complete };
  }

  /** @param {Context} context @param {string} kind @param {boolean} rough */
  drawMasks(context, kind, rough) {
    const { state, masks } = this;
    const alone = kind === "alone" ? masks.mask.alone : kind === "ignore" ? masks.ignore.alone : null;
    if (alone) context.drawImage(alone, 0, 0);
    if (state.hidden) return;
    if (!alone) {
      if (masks.ignore.filled) this.drawMask(context, masks.ignore, kind === "fill", rough);
      this.drawMask(context, masks.mask, kind === "fill" && !state.outline, rough);
    }
    for (const mask of [masks.proposal, masks.candidate]) if (mask.filled) this.drawSuggested(context, mask, Boolean(alone));
  }

  /** What is suggested hides nothing of a picture: it is outlined there, and filled on masks alone.
   * @param {Context} context @param {MaskView} mask @param {boolean} filled */
  drawSuggested(context, mask, filled) {
    const { box, colour: [red, green, blue], outline } = mask;
    if (!box) return;
    if (filled) {
      context.globalAlpha = SUGGESTED;
      context.drawImage(mask.fill, 0, 0);
      context.globalAlpha = 1;
    }
    strokeTwice(context, this.state.view.scale, { path: outline, colour: `rgb(${red}, ${green}, ${blue})` });
  }

  /** @param {Context} context @param {MaskView} mask @param {boolean} filled @param {boolean} rough */
  drawMask(context, mask, filled, rough) {
    const { state } = this;
    if (!mask.box) return;
    const { x0, y0, x1, y1 } = mask.box;
    const part = /** @type {const} */ ([x0, y0, x1 - x0, y1 - y0, x0, y0, x1 - x0, y1 - y0]);
    context.imageSmoothingQuality = "low";
    if (filled) {
      context.globalAlpha = state.opacity;
      context.drawImage(mask.fill, ...part);
    }
    context.globalAlpha = filled ? 1 : 0.85;
    // A line of one pixel breaks up or fades when it is scaled down: smoothed well and drawn again it
    // stays whole. Too slow while something changes.
    context.imageSmoothingQuality = rough ? "low" : "high";
    const times = rough ? 1 : Math.min(3, Math.ceil(1 / state.view.scale));
    for (let k = 0; k < times; k++) context.drawImage(mask.rim, ...part);
    context.globalAlpha = 1;
  }

  /** The reference left of the cursor, and the line between the two.
   * @param {CanvasRenderingContext2D} context @param {number} scale */
  drawSwipe(context, scale) {
    const { pair, cursor, past } = this.state;
    if (!pair || !cursor || !pair.layers.includes(past)) return;
    const level = levelAt(pair, scale * (window.devicePixelRatio || 1));
    const { bitmap } = this.pictures.best((k) => this.url(past, k), level);
    if (!bitmap) return;
    const x = Math.min(Math.max(cursor.x, 0), pair.width);
    const share = x / pair.width;
    if (x > 0) context.drawImage(bitmap, 0, 0, bitmap.width * share, bitmap.height, 0, 0, x, pair.height);
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x, pair.height);
    strokeTwice(context, scale);
  }
}
