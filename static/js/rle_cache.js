/**
 * Run-lengths of a mask that changes a little at a time: keeps where the value changes in each
 * column, so that encoding after a stroke reads the columns of the stroke and not the whole mask.
 * @typedef {import("./raster.js").Mask} Mask
 */
import { write } from "./rle.js";

export class RleCache {
  constructor() {
    /** @type {Uint8Array | null} the pixels the columns are of */
    this.data = null;
    /** @type {Int32Array[]} rows at which a column's value differs from the row above */
    this.columns = [];
  }

  /** Say that a mask changed in a box; null for everywhere.
   * @param {Mask} mask @param {{x0: number, x1: number} | null} box */
  touch(mask, box) {
    const fresh = !box || this.data !== mask.data;
    if (fresh) this.columns = Array(mask.width);
    this.data = mask.data;
    const end = fresh ? mask.width : Math.min(mask.width, box.x1);
    for (let x = fresh ? 0 : Math.max(0, box.x0); x < end; x++) this.columns[x] = changes(mask, x);
  }

  /** @param {Mask} mask @returns {string} COCO run-lengths, as `rle.encode` writes them */
  encode(mask) {
    if (this.data !== mask.data) this.touch(mask, null);
    const runs = [];
    let value = 0;
    let start = 0;
    for (let x = 0; x < mask.width; x++) {
      const base = x * mask.height;
      const first = mask.data[x];
      if (first !== value) {
        runs.push(base - start);
        start = base;
        value = first;
      }
      for (const y of this.columns[x]) {
        runs.push(base + y - start);
        start = base + y;
        value ^= 1;
      }
    }
    runs.push(mask.width * mask.height - start);
    return write(runs);
  }
}

/** @param {Mask} mask @param {number} x @returns {Int32Array} */
function changes({ width, data }, x) {
  const rows = [];
  for (let i = x + width, y = 1; i < data.length; i += width, y++) {
    if (data[i] !== data[i - width]) rows.push(y);
  }
  return Int32Array.from(rows);
}
