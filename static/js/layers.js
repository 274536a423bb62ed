/**
 * The layers a pane can show, and their pictures: fetched once, kept decoded, loaded ahead.
 * A layer is a picture, or an overlay on one.
 * @typedef {{title: string, base: string, overlay?: string, dim?: boolean, mask: "fill" | "rim" | "alone"}} Layer
 */

/** @type {Record<string, Layer>} */
export const LAYERS = {
  reference: { title: "Reference", base: "reference", mask: "rim" },
  warped: { title: "Reference → live", base: "warped", mask: "rim" },
  live: { title: "Live + mask", base: "live", mask: "fill" },
  difference: { title: "Difference", base: "difference", mask: "rim" },
  detector: { title: "Detector", base: "live", overlay: "detector", dim: true, mask: "rim" },
  objects_live: { title: "Objects, live", base: "live", overlay: "objects_live", dim: true, mask: "rim" },
  objects_reference: { title: "Objects, reference", base: "warped", overlay: "objects_reference", dim: true, mask: "rim" },
  doi: { title: "DoI", base: "live", overlay: "doi", dim: true, mask: "rim" },
  prediction: { title: "Prediction", base: "live", overlay: "prediction", dim: true, mask: "rim" },
  ground_truth: { title: "Mask alone", base: "", mask: "alone" },
};

const KEPT = 90;

export class Pictures {
  /** @param {() => void} arrived called when a picture is there */
  constructor(arrived) {
    this.arrived = arrived;
    /** @type {Map<string, {bitmap: ImageBitmap | null, error: string}>} */
    this.pictures = new Map();
  }

  /** Return a picture when it is decoded; else start loading it. @param {string} url */
  get(url) {
    const found = this.pictures.get(url);
    if (found) {
      this.pictures.delete(url);
      this.pictures.set(url, found);
      return found;
    }
    const entry = { bitmap: null, error: "" };
    this.pictures.set(url, entry);
    this.load(url, entry);
    for (const old of this.pictures.keys()) {
      if (this.pictures.size <= KEPT) break;
      this.pictures.get(old)?.bitmap?.close();
      this.pictures.delete(old);
    }
    return entry;
  }

  /** @param {string} url @param {{bitmap: ImageBitmap | null, error: string}} entry */
  async load(url, entry) {
    try {
      const reply = await fetch(url, { credentials: "same-origin" });
      if (!reply.ok) throw new Error((await reply.json()).detail);
      entry.bitmap = await createImageBitmap(await reply.blob());
    } catch (error) {
      entry.error = String(error instanceof Error ? error.message : error);
      this.pictures.delete(url);
    }
    this.arrived();
  }
}
