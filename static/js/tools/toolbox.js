/**
 * All tools, by the names that state, keys and buttons give them.
 * @typedef {import("./hand.js").Tool} Tool
 */
import { Area } from "./area.js";
import { Brush } from "./brush.js";
import { Bucket } from "./bucket.js";
import { Magnetic } from "./magnetic.js";

/** @param {import("./pointing.js").Pointing} pointing
 * @param {{pixels: () => Uint8ClampedArray | null, tolerance: () => number,
 *   path: (from: import("./hand.js").Point, to: import("./hand.js").Point) => Promise<import("./hand.js").Point[]>,
 *   changed: () => void}} on pixels: RGBA of the live picture; path: along an edge; changed: what is
 *   drawn has changed without the pointer
 * @returns {Record<string, Tool>} */
export function toolbox(pointing, on) {
  return {
    brush: new Brush(1),
    eraser: new Brush(0),
    polygon: new Area("polygon"),
    lasso: new Area("lasso"),
    magnetic: new Magnetic(on.path, on.changed),
    box: new Area("box"),
    fill: new Bucket(on.pixels, on.tolerance),
    click: pointing,
  };
}
