/**
 * Put a proposal's pixels into a layer: add them, take them away, or let them stand in place of
 * every component that they touch; "ill-posed" adds them to the layer that is not scored. Pure
 * functions on masks of one size; each returns new pixels.
 * @typedef {import("./raster.js").Mask} Mask
 */
import { label } from "./cleanup.js";

/** @param {Mask} mask @param {Uint8Array} proposal */
const add = (mask, proposal) => mask.data.map((value, i) => value | proposal[i]);

/** @type {Record<string, (mask: Mask, proposal: Uint8Array) => Uint8Array>} */
export const APPLY = {
  add,
  "ill-posed": add,
  subtract: (mask, proposal) => mask.data.map((value, i) => (proposal[i] ? 0 : value)),
  replace: (mask, proposal) => {
    const { labels, areas } = label(mask, 1, 8);
    const touched = new Uint8Array(areas.length);
    for (let i = 0; i < labels.length; i++) if (proposal[i]) touched[labels[i]] = 1;
    touched[0] = 0;
    return mask.data.map((value, i) => (proposal[i] || (value && !touched[labels[i]]) ? 1 : 0));
  },
};

const OTHER_RUN = "run:";

/** The name by which the list offers the prediction of another run. @param {string} run */
export const predictionOf = (run) => OTHER_RUN + run;

/** What the server is asked for a choice of the list: sources, and of which other run if any.
 * @param {string} choice @returns {{sources: string[], run: string | null}} */
export function askedFor(choice) {
  if (choice.startsWith(OTHER_RUN)) return { sources: ["prediction"], run: choice.slice(OTHER_RUN.length) };
  return { sources: (SOURCES[choice] ?? SOURCES.region).sources, run: null };
}

/** Sources of proposals, as the list offers them: title, and the server's names.
 * @type {Record<string, {title: string, sources: string[]}>} */
export const SOURCES = {
  region: { title: "DoI regions", sources: ["region"] },
  detector: { title: "Detector", sources: ["detector"] },
  object_live: { title: "Objects, live", sources: ["object_live"] },
  object_reference: { title: "Objects, reference", sources: ["object_reference"] },
  candidate: { title: "Candidates nobody proposed", sources: ["candidate"] },
  disagreement: { title: "Disagreements", sources: ["missed", "extra"] },
  all: { title: "All of this run", sources: ["region", "detector", "object_live", "object_reference", "candidate"] },
};
