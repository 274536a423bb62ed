/**
 * Put a proposal's pixels into a mask: add them, take them away, or let them stand in place of every
 * component that they touch. Pure functions on masks of one size; each returns new pixels.
 * @typedef {import("./raster.js").Mask} Mask
 */
import { label } from "./cleanup.js";

/** @type {Record<string, (mask: Mask, proposal: Uint8Array) => Uint8Array>} */
export const APPLY = {
  "add-region": (mask, proposal) => mask.data.map((value, i) => value | proposal[i]),
  "subtract-region": (mask, proposal) => mask.data.map((value, i) => (proposal[i] ? 0 : value)),
  "replace-region": (mask, proposal) => {
    const { labels, areas } = label(mask, 1, 8);
    const touched = new Uint8Array(areas.length);
    for (let i = 0; i < labels.length; i++) if (proposal[i]) touched[labels[i]] = 1;
    touched[0] = 0;
    return mask.data.map((value, i) => (proposal[i] || (value && !touched[labels[i]]) ? 1 : 0));
  },
};
