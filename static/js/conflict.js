/**
 * A conflict: somebody else saved the pair meanwhile. Show both masks, let the person choose. Both
 * versions become part of the pair's history, whichever is on top.
 */
import { api } from "./api.js";
import { MaskView } from "./maskview.js";
import { decode } from "./rle.js";

/** @param {number} id @param {string} name of the pair @param {import("./saver.js").Saver} saver
 * @param {(id: number) => void} reopen */
export async function showConflict(id, name, saver, reopen) {
  const mine = saver.unsent(id);
  if (!mine) return;
  const theirs = await api.mask(id);
  const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("conflict"));
  paint("conflict-mine", mine.counts, mine.width, mine.height);
  paint("conflict-theirs", theirs.mask.counts, mine.width, mine.height);
  const who = theirs.annotator ?? "an import";
  text("conflict-who", `Revision ${theirs.revision} by ${who}`);
  text("conflict-text", `${name}: you began from revision ${mine.revision}; ${who} has saved revision ${theirs.revision} since.`);
  let decided = false;
  on("keep-mine", () => {
    decided = true;
    dialog.close();
    saver.resolve(id, theirs.revision);
  });
  on("take-theirs", async () => {
    decided = true;
    dialog.close();
    const { width, height, counts, log, seconds } = mine;
    const kept = await api.putMask(id, theirs.revision, {
      mask: { width, height, counts }, active_seconds: Math.round(seconds * 10) / 10, tool_log: log,
    });
    await api.putMask(id, kept.revision, { mask: theirs.mask, tool_log: [{ tool: "take theirs" }] });
    saver.resolve(id, null);
    reopen(id);
  });
  // Escape must not leave the question unanswered.
  dialog.onclose = () => { if (!decided) dialog.showModal(); };
  if (!dialog.open) dialog.showModal();
}

/** @param {string} id @param {() => void} click */
function on(id, click) {
  /** @type {HTMLButtonElement} */ (document.getElementById(id)).onclick = click;
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
