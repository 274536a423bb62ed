/**
 * A conflict: somebody else saved the pair meanwhile. Show both masks, let the person choose.
 * Whatever is chosen, both versions are in the pair's history or become part of it.
 */
import { api } from "./api.js";
import { MaskView } from "./maskview.js";
import { decode } from "./rle.js";

/** @param {number} id @param {import("./saver.js").Saver} saver @param {(id: number) => void} reopen */
export async function showConflict(id, saver, reopen) {
  const mine = saver.unsent(id);
  const theirs = await api.mask(id);
  if (!mine) return;
  const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("conflict"));
  paint("conflict-mine", mine.counts, mine.width, mine.height);
  paint("conflict-theirs", theirs.mask.counts, mine.width, mine.height);
  const who = theirs.annotator ?? "an import";
  text("conflict-who", `Revision ${theirs.revision} by ${who}`);
  text("conflict-text", `You began from revision ${mine.revision}; ${who} has saved revision ${theirs.revision} since.`);
  const choose = (/** @type {number | null} */ revision) => {
    dialog.close();
    saver.resolve(id, revision);
    if (revision === null) reopen(id);
  };
  /** @type {any} */ (document.getElementById("keep-mine")).onclick = () => choose(theirs.revision);
  /** @type {any} */ (document.getElementById("take-theirs")).onclick = () => choose(null);
  dialog.oncancel = (event) => event.preventDefault();
  if (!dialog.open) dialog.showModal();
}

/** @param {string} id @param {string} counts @param {number} width @param {number} height */
function paint(id, counts, width, height) {
  const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById(id));
  canvas.width = width;
  canvas.height = height;
  const view = new MaskView();
  view.paint(decode(counts, width, height));
  canvas.getContext("2d")?.drawImage(view.alone, 0, 0);
}

/** @param {string} id @param {string} content */
function text(id, content) {
  const element = document.getElementById(id);
  if (element) element.textContent = content;
}
