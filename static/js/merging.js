/**
 * Compare two versions of a layer, and merge them part by part. A part is an 8-connected piece of
 * where they differ, and one side's version of it holds. Pure functions; the panel asks the person.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./history.js").Layer} Layer
 * @typedef {{layer: Layer, area: number, box: number[], mine: boolean}} Part
 * @typedef {{layer: Layer, mine: Mask, theirs: Mask, labels: Int32Array, parts: Part[]}} Compared
 *   part k has label k + 1
 */
import { label } from "./cleanup.js";

/** Split where two versions differ into parts. What only they have changed since the version that
 * both began from is theirs at first, all else is mine.
 * @param {Layer} layer @param {Mask} mine @param {Mask} theirs
 * @param {Mask | null} base null for none: then all is mine @returns {Compared} */
export function compare(layer, mine, theirs, base) {
  const differ = { ...mine, data: mine.data.map((value, i) => value ^ theirs.data[i]) };
  const { labels, areas } = label(differ, 1, 8);
  const parts = areas.slice(1).map((area) => ({ layer, area, box: [mine.width, mine.height, 0, 0], mine: !base }));
  for (let i = 0; i < labels.length; i++) {
    if (!labels[i]) continue;
    const part = parts[labels[i] - 1];
    const { box } = part;
    const x = i % mine.width;
    const y = (i - x) / mine.width;
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x + 1);
    box[3] = Math.max(box[3], y + 1);
    if (base && mine.data[i] !== base.data[i]) part.mine = true;
  }
  return { layer, mine, theirs, labels, parts };
}

/** Return the layer as the parts say. @param {Compared} compared @returns {Mask} */
export function merge({ mine, theirs, labels, parts }) {
  const data = mine.data.map((value, i) => (labels[i] && !parts[labels[i] - 1].mine ? theirs.data[i] : value));
  return { ...mine, data };
}

/** Return the part at a pixel, null where both versions agree.
 * @param {Compared} compared @param {number} i @returns {Part | null} */
export function partAt({ labels, parts }, i) {
  return labels[i] ? parts[labels[i] - 1] : null;
}
