/**
 * Put the run's prediction in place of the mask. That replaces whatever was there, imported truth
 * too, so it says so and offers the way back.
 */
import { notice } from "./chrome.js";
import { area } from "./raster.js";

/** @param {import("./desk.js").PairDesk} desk @param {string} url of the prediction's layer */
export async function takePrediction(desk, url) {
  const { state } = desk;
  const { pair } = state;
  if (!pair || !desk.editable) return;
  if (state.blind) return notice("The prediction is hidden until you have submitted.");
  if (!pair.layers.includes("prediction")) return notice("This run has no prediction for the pair yet.", true);
  const reply = await fetch(url, { credentials: "same-origin" });
  if (!reply.ok) throw new Error((await reply.json()).detail);
  const bitmap = await createImageBitmap(await reply.blob(), { premultiplyAlpha: "none" });
  const context = new OffscreenCanvas(pair.width, pair.height).getContext("2d");
  context?.drawImage(bitmap, 0, 0);
  const pixels = context?.getImageData(0, 0, pair.width, pair.height).data ?? [];
  if (state.pair?.id !== pair.id || state.locked || desk.active) return;
  const taken = Uint8Array.from({ length: pair.width * pair.height }, (_, i) => (pixels[4 * i + 3] ? 1 : 0));
  const before = area(desk.masks.mask);
  if (!desk.replace("mask", taken, { tool: "take prediction" })) return notice("The mask is the prediction already.");
  const entry = desk.history.next("undo");
  notice(`The prediction stands in place of the mask, which had ${before} px.`, false, { title: "Undo", act: () => {
    if (desk.history.next("undo") === entry) return desk.step("undo");
    notice("More was drawn since: undo that first, step by step.");
  } });
}
