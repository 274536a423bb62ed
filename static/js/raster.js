/**
 * Paint into a Uint8 mask (0 or 1, row-major). Pure: no canvas, no events.
 * Every function returns the dirty box {x0, y0, x1, y1} (ends exclusive), or null when nothing is
 * touched.
 * @typedef {{width: number, height: number, data: Uint8Array}} Mask
 * @typedef {{x0: number, y0: number, x1: number, y1: number}} Box
 */

/** @param {number} width @param {number} height @returns {Mask} */
export function emptyMask(width, height) {
  return { width, height, data: new Uint8Array(width * height) };
}

/**
 * Fill everything within `radius` of the segment a-b: one stroke sample after another leaves no gap,
 * however fast the pointer moved. A pixel belongs when its centre is inside; the pixel under a very
 * small brush always does.
 * @param {Mask} mask @param {{x: number, y: number}} a @param {{x: number, y: number}} b image points
 * @param {number} radius pixels @param {0 | 1} value
 * @returns {Box | null}
 */
export function paintSegment(mask, a, b, radius, value) {
  const box = clip(mask, {
    x0: Math.floor(Math.min(a.x, b.x) - radius),
    y0: Math.floor(Math.min(a.y, b.y) - radius),
    x1: Math.ceil(Math.max(a.x, b.x) + radius) + 1,
    y1: Math.ceil(Math.max(a.y, b.y) + radius) + 1,
  });
  if (!box) return null;
  const dx = b.x - a.x;
  const dy = b.y - a.y;
  const square = dx * dx + dy * dy;
  const reach = radius * radius;
  for (let y = box.y0; y < box.y1; y++) {
    const py = y + 0.5 - a.y;
    const row = y * mask.width;
    for (let x = box.x0; x < box.x1; x++) {
      const px = x + 0.5 - a.x;
      const t = square ? Math.min(1, Math.max(0, (px * dx + py * dy) / square)) : 0;
      const ex = px - t * dx;
      const ey = py - t * dy;
      if (ex * ex + ey * ey <= reach) mask.data[row + x] = value;
    }
  }
  for (const p of [a, b]) {
    const x = Math.floor(p.x);
    const y = Math.floor(p.y);
    if (x >= 0 && y >= 0 && x < mask.width && y < mask.height) mask.data[y * mask.width + x] = value;
  }
  return box;
}

/** @param {Mask} mask @returns {number} pixels set */
export function area(mask) {
  let count = 0;
  for (const value of mask.data) count += value;
  return count;
}

/** Smallest box around both; null stands for "nothing".
 * @param {Box | null} a @param {Box | null} b @returns {Box | null} */
export function join(a, b) {
  if (!a) return b;
  if (!b) return a;
  return {
    x0: Math.min(a.x0, b.x0),
    y0: Math.min(a.y0, b.y0),
    x1: Math.max(a.x1, b.x1),
    y1: Math.max(a.y1, b.y1),
  };
}

/** The smallest box around the set pixels. @param {Mask} mask @returns {Box | null} */
export function boxOf({ width, height, data }) {
  const box = { x0: width, y0: height, x1: 0, y1: 0 };
  for (let y = 0; y < height; y++) {
    const row = data.subarray(y * width, (y + 1) * width);
    const first = row.indexOf(1);
    if (first < 0) continue;
    box.y0 = Math.min(box.y0, y);
    box.y1 = y + 1;
    box.x0 = Math.min(box.x0, first);
    box.x1 = Math.max(box.x1, row.lastIndexOf(1) + 1);
  }
  return box.y1 ? box : null;
}

/** @param {Mask} mask @param {Box} box @returns {Box | null} */
export function clip(mask, box) {
  const clipped = {
    x0: Math.max(0, box.x0),
    y0: Math.max(0, box.y0),
    x1: Math.min(mask.width, box.x1),
    y1: Math.min(mask.height, box.y1),
  };
  return clipped.x0 < clipped.x1 && clipped.y0 < clipped.y1 ? clipped : null;
}

/** Copy the pixels of a box. @param {Mask} mask @param {Box} box @returns {Uint8Array} */
export function copyBox(mask, box) {
  const width = box.x1 - box.x0;
  const pixels = new Uint8Array(width * (box.y1 - box.y0));
  for (let y = box.y0; y < box.y1; y++) {
    const start = y * mask.width + box.x0;
    pixels.set(mask.data.subarray(start, start + width), (y - box.y0) * width);
  }
  return pixels;
}

/** Put pixels back. @param {Mask} mask @param {Box} box @param {Uint8Array} pixels */
export function pasteBox(mask, box, pixels) {
  const width = box.x1 - box.x0;
  for (let y = box.y0; y < box.y1; y++) {
    const start = (y - box.y0) * width;
    mask.data.set(pixels.subarray(start, start + width), y * mask.width + box.x0);
  }
}
