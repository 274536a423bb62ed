/**
 * The outline of a mask: lines between its pixels and the others, so that a line drawn there, however
 * close one looks, covers no pixel. Pure.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 */

/** Return the lines [x0, y0, x1, y1] around the set pixels of a box, as long as they go straight.
 * @param {Mask} mask @param {Box} box holds every set pixel @returns {number[][]} */
export function outlineOf(mask, box) {
  const { width, height, data } = mask;
  const at = (/** @type {number} */ x, /** @type {number} */ y) =>
    x >= 0 && y >= 0 && x < width && y < height && data[y * width + x] === 1;
  /** @type {number[][]} */
  const lines = [];
  for (let y = box.y0; y <= box.y1; y++) {
    walk(box.x0, box.x1, (x) => at(x, y - 1) !== at(x, y), (from, to) => lines.push([from, y, to, y]));
  }
  for (let x = box.x0; x <= box.x1; x++) {
    walk(box.y0, box.y1, (y) => at(x - 1, y) !== at(x, y), (from, to) => lines.push([x, from, x, to]));
  }
  return lines;
}

/** @param {number} start @param {number} end @param {(k: number) => boolean} parted
 * @param {(from: number, to: number) => void} line */
function walk(start, end, parted, line) {
  let from = -1;
  for (let k = start; k <= end; k++) {
    const is = k < end && parted(k);
    if (is && from < 0) from = k;
    if (!is && from >= 0) {
      line(from, k);
      from = -1;
    }
  }
}
