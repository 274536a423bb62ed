/**
 * Areas: the inside of a polygon, and the pixels that look like the one clicked. Pure functions.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 * @typedef {{x: number, y: number}} Point
 */
import { clip } from "./raster.js";

/** Set the pixels whose centres lie inside a closed polygon (even-odd rule).
 * @param {Mask} mask @param {Point[]} points @param {0 | 1} value @returns {Box | null} */
export function fillPolygon(mask, points, value) {
  const xs = points.map((p) => p.x);
  const ys = points.map((p) => p.y);
  const box = clip(mask, {
    x0: Math.floor(Math.min(...xs)),
    y0: Math.floor(Math.min(...ys)),
    x1: Math.ceil(Math.max(...xs)) + 1,
    y1: Math.ceil(Math.max(...ys)) + 1,
  });
  if (!box || points.length < 3) return null;
  for (let y = box.y0; y < box.y1; y++) {
    const crossings = [];
    for (let k = 0; k < points.length; k++) {
      const a = points[k];
      const b = points[(k + 1) % points.length];
      const middle = y + 0.5;
      if (a.y <= middle === b.y <= middle) continue;
      crossings.push(a.x + ((middle - a.y) / (b.y - a.y)) * (b.x - a.x));
    }
    crossings.sort((first, second) => first - second);
    for (let k = 0; k + 1 < crossings.length; k += 2) {
      const from = Math.max(box.x0, Math.ceil(crossings[k] - 0.5));
      const to = Math.min(box.x1, Math.ceil(crossings[k + 1] - 0.5));
      if (from < to) mask.data.fill(value, y * mask.width + from, y * mask.width + to);
    }
  }
  return box;
}

/** Set the 4-connected pixels around a point whose colour differs from it by at most `tolerance` in
 * every channel. @param {Mask} mask @param {Uint8ClampedArray} pixels RGBA of the same size
 * @param {Point} at @param {number} tolerance 0..255 @param {0 | 1} value @returns {Box | null} */
export function floodFill(mask, pixels, at, tolerance, value) {
  const { width, height } = mask;
  const start = Math.floor(at.y) * width + Math.floor(at.x);
  if (at.x < 0 || at.y < 0 || at.x >= width || at.y >= height) return null;
  const seed = pixels.slice(4 * start, 4 * start + 3);
  const seen = new Uint8Array(width * height);
  const alike = (/** @type {number} */ i) =>
    Math.abs(pixels[4 * i] - seed[0]) <= tolerance &&
    Math.abs(pixels[4 * i + 1] - seed[1]) <= tolerance &&
    Math.abs(pixels[4 * i + 2] - seed[2]) <= tolerance;
  const box = { x0: width, y0: height, x1: 0, y1: 0 };
  const stack = [start];
  seen[start] = 1;
  while (stack.length) {
    const i = /** @type {number} */ (stack.pop());
    const x = i % width;
    const y = (i - x) / width;
    mask.data[i] = value;
    if (x < box.x0) box.x0 = x;
    if (y < box.y0) box.y0 = y;
    if (x >= box.x1) box.x1 = x + 1;
    if (y >= box.y1) box.y1 = y + 1;
    const around = [x > 0 ? i - 1 : -1, x < width - 1 ? i + 1 : -1, i - width, i + width];
    for (const j of around) {
      if (j < 0 || j >= seen.length || seen[j] || !alike(j)) continue;
      seen[j] = 1;
      stack.push(j);
    }
  }
  return box;
}
