/**
 * Clean-up of a whole mask: each function takes a mask and returns the pixels of a new one. Pure.
 * @typedef {import("./raster.js").Mask} Mask
 */

/** Number the 8-connected components of the pixels that have a value.
 * @param {Mask} mask @param {0 | 1} value @param {4 | 8} neighbours
 * @returns {{labels: Int32Array, areas: number[]}} label 0 = other value; areas[0] is unused */
export function label(mask, value, neighbours) {
  const { width, height, data } = mask;
  const labels = new Int32Array(data.length);
  const areas = [0];
  for (let start = 0; start < data.length; start++) {
    if (data[start] !== value || labels[start]) continue;
    const number = areas.push(0) - 1;
    const stack = [start];
    labels[start] = number;
    while (stack.length) {
      const i = /** @type {number} */ (stack.pop());
      areas[number]++;
      const x = i % width;
      const y = (i - x) / width;
      for (let dy = -1; dy <= 1; dy++) {
        for (let dx = -1; dx <= 1; dx++) {
          if (neighbours === 4 && dx && dy) continue;
          const u = x + dx;
          const v = y + dy;
          const j = v * width + u;
          if (u < 0 || v < 0 || u >= width || v >= height || data[j] !== value || labels[j]) continue;
          labels[j] = number;
          stack.push(j);
        }
      }
    }
  }
  return { labels, areas };
}

/** Fill what is enclosed: unset pixels that have no 4-connected way to the border. @param {Mask} mask */
export function fillHoles(mask) {
  const { width, height } = mask;
  const { labels, areas } = label(mask, 0, 4);
  const open = new Uint8Array(areas.length);
  for (let x = 0; x < width; x++) open[labels[x]] = open[labels[(height - 1) * width + x]] = 1;
  for (let y = 0; y < height; y++) open[labels[y * width]] = open[labels[y * width + width - 1]] = 1;
  return mask.data.map((value, i) => (value || !open[labels[i]] ? 1 : 0));
}

/** Drop components smaller than `least` pixels. @param {Mask} mask @param {number} least */
export function dropSpecks(mask, least) {
  const { labels, areas } = label(mask, 1, 8);
  return mask.data.map((value, i) => (value && areas[labels[i]] >= least ? 1 : 0));
}

/** The 8-connected component under a point, null where there is none.
 * @param {Mask} mask @param {{x: number, y: number}} at @returns {Uint8Array | null} */
export function componentAt({ width, height, data }, at) {
  const start = Math.floor(at.y) * width + Math.floor(at.x);
  if (!data[start]) return null;
  const part = new Uint8Array(data.length);
  // A pixel is pushed once at most.
  const stack = new Int32Array(data.length);
  let depth = 1;
  stack[0] = start;
  part[start] = 1;
  while (depth) {
    const i = stack[--depth];
    const x = i % width;
    const top = i >= width ? -width : 0;
    const bottom = i < width * (height - 1) ? width : 0;
    for (let row = i + top; row <= i + bottom; row += width) {
      for (let j = x > 0 ? row - 1 : row; j <= (x < width - 1 ? row + 1 : row); j++) {
        if (!data[j] || part[j]) continue;
        part[j] = 1;
        stack[depth++] = j;
      }
    }
  }
  return part;
}

/** Keep only the component under a point; nothing changes where there is none.
 * @param {Mask} mask @param {{x: number, y: number}} at */
export function keepComponent(mask, at) {
  return componentAt(mask, at) ?? mask.data.slice();
}

/** Count the set pixels of each 3x3 neighbourhood; outside the image nothing is set.
 * @param {Mask} mask @returns {Uint8Array} */
function neighbourhood({ width, height, data }) {
  const sums = new Uint8Array(data.length);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      let sum = 0;
      for (let v = Math.max(0, y - 1); v <= Math.min(height - 1, y + 1); v++) {
        for (let u = Math.max(0, x - 1); u <= Math.min(width - 1, x + 1); u++) sum += data[v * width + u];
      }
      sums[y * width + x] = sum;
    }
  }
  return sums;
}

/** Grow by one pixel in all eight directions. @param {Mask} mask */
export function grow(mask) {
  return neighbourhood(mask).map((sum) => (sum > 0 ? 1 : 0));
}

/** Shrink by one pixel; the image border does not shrink what touches it. @param {Mask} mask */
export function shrink(mask) {
  const inverse = { ...mask, data: mask.data.map((value) => 1 - value) };
  return grow(inverse).map((value) => 1 - value);
}

/** Smooth the border: a pixel follows the majority of its 3x3 neighbourhood. @param {Mask} mask */
export function smooth(mask) {
  return neighbourhood(mask).map((sum, i) => (sum >= 5 ? 1 : sum <= 3 ? 0 : mask.data[i]));
}
