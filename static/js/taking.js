/**
 * Put the run's prediction in place of the mask. That replaces whatever was there, imported truth
 * too, so it says so and offers the way back.
 */
import { notice } from "./chrome.js";
import { addressOf } from "./layers.js";
import { area } from "./raster.js";

/** @param {import("./pair_session.js").PairSession} session */
export async function takePrediction(session) {
  const { document, hand, state } = session;
  const { pair } = state;
  if (!pair || !session.editable) return;
  if (state.blind) return notice("The prediction is hidden until you have submitted.");
  if (!pair.layers.includes("prediction")) return notice("This run has no prediction for the pair yet.", true);
  const reply = await fetch(addressOf(state, "prediction"), { credentials: "same-origin" });
  if (!reply.ok) throw new Error((await reply.json()).detail);
  const bitmap = await createImageBitmap(await reply.blob(), { premultiplyAlpha: "none" });
  const context = new OffscreenCanvas(pair.width, pair.height).getContext("2d");
  context?.drawImage(bitmap, 0, 0);
  const pixels = context?.getImageData(0, 0, pair.width, pair.height).data ?? [];
  if (state.pair?.id !== pair.id || state.locked || hand.busy) return;
  const taken = Uint8Array.from({ length: pair.width * pair.height }, (_, i) => (pixels[4 * i + 3] ? 1 : 0));
  const before = area(document.masks.mask);
  if (!document.replace("mask", taken, { tool: "take prediction" })) return notice("The mask is the prediction already.");
  const entry = document.history.next("undo");
  notice(`The prediction stands in place of the mask, which had ${before} px.`, false, { title: "Undo", act: () => {
    if (document.history.next("undo") === entry) return session.step("undo");
    notice("More was drawn since: undo that first, step by step.");
  } });
}
