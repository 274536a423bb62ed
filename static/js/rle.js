/**
 * COCO compressed run-lengths <-> Uint8 masks: the twin of reviewer/masks.py, with the same vectors
 * in the tests. Runs count down the columns and start with zeros; each number is written in groups
 * of 5 bits, from the third run on as the difference to the one before the last.
 * @typedef {import("./raster.js").Mask} Mask
 */

/** @param {Mask} mask @returns {string} */
export function encode(mask) {
  const runs = [];
  let value = 0;
  let length = 0;
  for (let x = 0; x < mask.width; x++) {
    for (let i = x; i < mask.data.length; i += mask.width) {
      if (mask.data[i] === value) {
        length++;
      } else {
        runs.push(length);
        value = mask.data[i];
        length = 1;
      }
    }
  }
  runs.push(length);
  return write(runs);
}

/** Write run-lengths as text. @param {number[]} runs zeros first @returns {string} */
export function write(runs) {
  let text = "";
  for (let k = 0; k < runs.length; k++) {
    let number = k > 2 ? runs[k] - runs[k - 2] : runs[k];
    for (let more = true; more; ) {
      let code = number & 0x1f;
      number >>= 5;
      more = code & 0x10 ? number !== -1 : number !== 0;
      if (more) code |= 0x20;
      text += String.fromCharCode(code + 48);
    }
  }
  return text;
}

/** @param {string} counts @param {number} width @param {number} height @returns {Mask} */
export function decode(counts, width, height) {
  const data = new Uint8Array(width * height);
  const runs = readRuns(counts);
  let place = 0;
  for (let k = 0; k < runs.length; k++) {
    const end = place + runs[k];
    if (runs[k] < 0 || end > data.length) throw new Error("run-lengths do not fit the image");
    if (k % 2) {
      for (let p = place; p < end; p++) data[(p % height) * width + Math.floor(p / height)] = 1;
    }
    place = end;
  }
  if (place !== data.length) throw new Error("run-lengths do not cover the image");
  return { width, height, data };
}

/** @param {string} counts @returns {number[]} */
function readRuns(counts) {
  const runs = [];
  for (let i = 0; i < counts.length; ) {
    let number = 0;
    let shift = 0;
    for (let more = true; more; shift += 5) {
      const code = counts.charCodeAt(i++) - 48;
      if (!(code >= 0 && code < 64)) throw new Error("run-lengths are damaged");
      number |= (code & 0x1f) << shift;
      more = Boolean(code & 0x20);
      if (!more && code & 0x10) number |= -1 << (shift + 5);
    }
    if (runs.length > 2) number += runs[runs.length - 2];
    runs.push(number);
  }
  return runs;
}
