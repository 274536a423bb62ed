/**
 * What lies over the pictures: the two layers of the document, what a tool offers, the selected
 * proposal. Painted when the state tells that they have changed.
 */
import { MaskView } from "./maskview.js";
import { area } from "./raster.js";

const COUNT_MS = 60;

/** @param {import("./state.js").State} state @param {import("./document.js").PairDocument} document
 * @param {() => void} now draw at once */
export function overlaysOf(state, document, now) {
  // Colours that colour-blind people can tell apart (after Okabe and Ito).
  const masks = {
    mask: new MaskView([0, 214, 143], { alone: true }),
    ignore: new MaskView([214, 126, 255], { alone: true, hatched: true }),
    candidate: new MaskView([86, 180, 233]),
    proposal: new MaskView([64, 214, 224]),
  };
  let counting = 0;
  /** Count the layers' pixels, once the stroke pauses. */
  const countSoon = () => {
    clearTimeout(counting);
    counting = window.setTimeout(() => {
      if (state.drawing) return countSoon();
      const counted = { mask: area(document.masks.mask), ignore: area(document.masks.ignore) };
      if (!counted.ignore) masks.ignore.clear();
      state.count(counted);
    }, COUNT_MS);
  };
  state.subscribe("mask", (layer, box) => {
    masks[layer].paint(document.masks[layer], box);
    countSoon();
  });
  /** What was asked and offered last. */
  let asked = "";
  let offered = /** @type {import("./raster.js").Mask | null} */ (null);
  state.subscribe("candidate", (shown, asking) => {
    if (shown) masks.candidate.show(shown);
    else if (state.looked === null) masks.candidate.clear();
    // A box that is dragged waits for the next frame; what was waited for does not.
    const asks = `${asking} ${state.candidate?.points.length}`;
    if (shown !== offered || asks !== asked) now();
    asked = asks;
    offered = shown;
  });
  return masks;
}
