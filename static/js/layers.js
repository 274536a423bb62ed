/**
 * The layers a pane can show, and their pictures: fetched once, kept decoded, loaded ahead.
 * A layer is a picture, or an overlay on one; `machine` ones tell what machines found, and stay
 * hidden while a person looks for changes unprompted.
 * @typedef {import("./wire.js").PairDetail["layers"][number]} Served a picture of the server's
 * @typedef {{title: string, base: Served | "", overlay?: Served, dim?: boolean, machine?: boolean,
 *   mask: "fill" | "rim" | "alone" | "ignore"}} Layer
 */

import { api } from "./api.js";

/** @type {Record<string, Layer>} */
export const LAYERS = {
  reference: { title: "Reference", base: "reference", mask: "rim" },
  warped: { title: "Reference → live", base: "warped", mask: "rim" },
  live: { title: "Live + mask", base: "live", mask: "fill" },
  difference: { title: "Difference", base: "difference", mask: "rim" },
  unseen: { title: "Unseen", base: "live", overlay: "unseen", mask: "rim" },
  detector: { title: "Detector", base: "live", overlay: "detector", dim: true, machine: true, mask: "rim" },
  objects_live: { title: "Objects, live", base: "live", overlay: "objects_live", dim: true, machine: true, mask: "rim" },
  objects_reference: { title: "Objects, reference", base: "warped", overlay: "objects_reference", dim: true, machine: true, mask: "rim" },
  doi: { title: "DoI", base: "live", overlay: "doi", dim: true, machine: true, mask: "rim" },
  prediction: { title: "Prediction", base: "live", overlay: "prediction", dim: true, machine: true, mask: "rim" },
  ground_truth: { title: "Mask alone", base: "", mask: "alone" },
  ignore: { title: "Ill-posed alone", base: "", mask: "ignore" },
};

/** What a pane says of a pair in doubt: where the warp, or what followed from it, is shown.
 * @param {string} wanted the layer that the pane is set to @param {string} shown
 * @param {string} doubt @returns {string} "" for nothing */
export function doubtOf(wanted, shown, doubt) {
  if (!doubt) return "";
  const [first, ...more] = doubt.split("; ");
  const reasons = first + (more.length ? `, and ${more.length} more reason${more.length > 1 ? "s" : ""}` : "");
  if (wanted !== shown) return `Reference as taken: the warp is in doubt (${reasons})`;
  const { base, overlay, machine } = LAYERS[shown];
  return machine || base === "warped" || base === "difference" || overlay === "unseen" ? `In doubt: ${reasons}` : "";
}

/** Which picture a click in a pane of this layer means. @param {Layer} layer */
export function pictureOf(layer) {
  if (layer.base === "reference") return "raw reference";
  return layer.base === "warped" ? "reference" : "live";
}

const LARGEST_BYTES = 400e6;
const AGAIN_MS = 5000;

export class Pictures {
  /** @param {() => void} arrived called when a picture is there */
  constructor(arrived) {
    this.arrived = arrived;
    /** @type {Map<string, {bitmap: ImageBitmap | null, error: string, failed: number}>} */
    this.pictures = new Map();
    this.bytes = 0;
    /** @type {{url: string, data: Uint8ClampedArray | null}} the pixels read last */
    this.read = { url: "", data: null };
  }

  /** Return a picture when it is decoded; else start loading it. @param {string} url */
  get(url) {
    const found = this.pictures.get(url);
    if (found && !(found.failed && Date.now() - found.failed > AGAIN_MS)) {
      this.pictures.delete(url);
      this.pictures.set(url, found);
      return found;
    }
    const entry = { bitmap: null, error: "", failed: 0 };
    this.pictures.set(url, entry);
    this.load(url, entry);
    return entry;
  }

  /** Return a picture, or meanwhile the best that is there of the same in other sizes, finer ones
   * first: what is on the screen stays there until it can be replaced.
   * @param {(level: number) => string} url @param {number} level */
  best(url, level) {
    const wanted = this.get(url(level));
    if (wanted.bitmap || wanted.error) return wanted;
    for (let k = 0; k <= MOST_LEVELS; k++) {
      const other = this.pictures.get(url(k));
      if (other?.bitmap) return other;
    }
    return wanted;
  }

  /** Return the RGBA pixels of a picture that is decoded, null before. @param {string} url */
  pixels(url) {
    const { bitmap } = this.get(url);
    if (!bitmap) return null;
    if (this.read.url !== url) {
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
      context?.drawImage(bitmap, 0, 0);
      this.read = { url, data: context?.getImageData(0, 0, bitmap.width, bitmap.height).data ?? null };
    }
    return this.read.data;
  }

  /** Drop the pictures unused for longest, so that the rest fits into memory. */
  trim() {
    for (const [url, { bitmap }] of this.pictures) {
      if (this.bytes <= LARGEST_BYTES) break;
      if (!bitmap) continue;
      this.bytes -= 4 * bitmap.width * bitmap.height;
      bitmap.close();
      this.pictures.delete(url);
    }
  }

  /** @param {string} url @param {{bitmap: ImageBitmap | null, error: string, failed: number}} entry */
  async load(url, entry) {
    try {
      const reply = await fetch(url, { credentials: "same-origin" });
      if (!reply.ok) throw new Error((await reply.json()).detail);
      entry.bitmap = await createImageBitmap(await reply.blob());
      this.bytes += 4 * entry.bitmap.width * entry.bitmap.height;
      this.trim();
    } catch (error) {
      entry.error = String(error instanceof Error ? error.message : error);
      entry.failed = Date.now();
    }
    this.arrived();
  }
}

/** Pictures with longer sides come in smaller sizes first. */
const LARGEST_WHOLE_PX = 1600;
const MOST_LEVELS = 5;

/** How often the pictures of a pair may be halved and still fill the screen, 0 for small ones.
 * @param {{width: number, height: number}} pair @param {number} scale device pixels a pixel */
export function levelAt({ width, height }, scale) {
  if (Math.max(width, height) <= LARGEST_WHOLE_PX) return 0;
  return Math.min(MOST_LEVELS, Math.max(0, Math.floor(Math.log2(1 / scale))));
}

/** Return the address of a layer of the open pair. @param {import("./state.js").State} state
 * @param {string} layer @param {number} [level] */
export const addressOf = (state, layer, level = 0) =>
  (state.pair ? api.layerUrl(state.pair, layer, !state.second, level) : "");
