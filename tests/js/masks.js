/** Masks for tests: drawn as rows of text, or made up by fast-check. */
import fc from "fast-check";

/** "#" is set. @param {string[]} rows */
export function drawn(...rows) {
  const data = Uint8Array.from(rows.join(""), (sign) => (sign === "#" ? 1 : 0));
  return { width: rows[0].length, height: rows.length, data };
}

/** @param {{width: number, data: Uint8Array}} mask @returns {string[]} rows, as `drawn` takes them */
export function rows({ width, data }) {
  const text = Array.from(data, (value) => (value ? "#" : ".")).join("");
  return Array.from({ length: data.length / width }, (_, y) => text.slice(y * width, (y + 1) * width));
}

export const sizes = fc.record({ width: fc.integer({ min: 1, max: 12 }), height: fc.integer({ min: 1, max: 12 }) });

/** Pixels of one size. @param {{width: number, height: number}} size */
export const masksOf = ({ width, height }) => fc
  .array(fc.constantFrom(0, 1), { minLength: width * height, maxLength: width * height })
  .map((values) => ({ width, height, data: Uint8Array.from(values) }));

export const masks = sizes.chain(masksOf);

/** A box inside. @param {{width: number, height: number}} size */
export const boxesIn = ({ width, height }) => fc
  .tuple(fc.integer({ min: 0, max: width - 1 }), fc.integer({ min: 0, max: height - 1 }),
    fc.integer({ min: 1, max: width }), fc.integer({ min: 1, max: height }))
  .map(([x0, y0, w, h]) => ({ x0, y0, x1: Math.min(width, x0 + w), y1: Math.min(height, y0 + h) }));
