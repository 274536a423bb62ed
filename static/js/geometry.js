/**
 * Screen <-> image: one transform (scale, offset) that all panes share. Pure functions.
 * Image pixel (i, j) covers [i, i + 1) x [j, j + 1); lengths on screen are CSS pixels.
 * @typedef {{scale: number, x: number, y: number}} View scale in CSS px a pixel; x, y: the image
 *   point (pixels) in the middle of a pane.
 * @typedef {{width: number, height: number}} Size
 * @typedef {{x: number, y: number}} Point
 */

export const LARGEST_SCALE = 48;

/** Show the whole image. @param {Size} image @param {Size} pane @returns {View} */
export function fit(image, pane) {
  const scale = Math.min(pane.width / image.width, pane.height / image.height);
  return { scale, x: image.width / 2, y: image.height / 2 };
}

/** Keep the image in sight: it covers the middle of the pane, and at least half of its width or height.
 * @param {View} view @param {Size} image @param {Size} pane @returns {View} */
export function clamp(view, image, pane) {
  return {
    scale: clampScale(view.scale, image, pane),
    x: Math.min(Math.max(view.x, 0), image.width),
    y: Math.min(Math.max(view.y, 0), image.height),
  };
}

/** Show a box with a margin. @param {number[]} box x0, y0, x1, y1 @param {Size} pane @returns {View} */
export function fitBox(box, pane) {
  const [x0, y0, x1, y1] = box;
  const width = Math.max(x1 - x0, 24) * 2.2;
  const height = Math.max(y1 - y0, 24) * 2.2;
  const scale = Math.min(pane.width / width, pane.height / height, 12);
  return { scale, x: (x0 + x1) / 2, y: (y0 + y1) / 2 };
}

/** @param {View} view @param {Size} pane @param {Point} at on screen @returns {Point} in the image */
export function toImage(view, pane, at) {
  return {
    x: view.x + (at.x - pane.width / 2) / view.scale,
    y: view.y + (at.y - pane.height / 2) / view.scale,
  };
}

/** @param {View} view @param {Size} pane @param {Point} at in the image @returns {Point} on screen */
export function toScreen(view, pane, at) {
  return {
    x: pane.width / 2 + (at.x - view.x) * view.scale,
    y: pane.height / 2 + (at.y - view.y) * view.scale,
  };
}

/** Zoom by a factor, as far as that goes, and keep the image point under the cursor where it is.
 * @param {View} view @param {Size} image @param {Size} pane @param {Point} at on screen
 * @param {number} factor @returns {View} */
export function zoomAt(view, image, pane, at, factor) {
  const fixed = toImage(view, pane, at);
  const scale = clampScale(view.scale * factor, image, pane);
  return {
    scale,
    x: fixed.x - (at.x - pane.width / 2) / scale,
    y: fixed.y - (at.y - pane.height / 2) / scale,
  };
}

/** @param {View} view @param {number} dx @param {number} dy screen pixels @returns {View} */
export function pan(view, dx, dy) {
  return { scale: view.scale, x: view.x - dx / view.scale, y: view.y - dy / view.scale };
}

/** @param {number} scale @param {Size} image @param {Size} pane */
function clampScale(scale, image, pane) {
  const whole = fit(image, pane).scale;
  return Math.min(Math.max(LARGEST_SCALE, whole), Math.max(whole / 2, scale));
}
