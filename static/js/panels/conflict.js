/**
 * A conflict: somebody else saved the pair meanwhile. Show where the two versions of the mask and of
 * the ill-posed pixels differ, and let the person choose part by part. Both versions become part of
 * the pair's history, and the merged one comes after them.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {import("../merging.js").Part} Part
 * @typedef {import("../merging.js").Compared} Compared
 * @typedef {{began: number, theirs: import("../wire.js").MaskReply,
 *   unsent: import("../saver.js").Change, ignored: Mask, layers: Compared[], parts: Part[],
 *   kept: number | null}} Versions
 *   began: revision that mine started from; kept: revision that mine has been saved as
 */
import { api, ApiError } from "../api.js";
import { compare, merge, partAt } from "../merging.js";
import { emptyMask } from "../raster.js";
import { decode, encode } from "../rle.js";

const MINE = [86, 180, 233];
const THEIRS = [230, 159, 0];
const BOTH = [150, 158, 168];
const HATCH_PX = 6;

/** @type {Promise<unknown>} the question before */
let asked = Promise.resolve();

/** Ask about a pair, once the questions before are answered.
 * @param {number} id @param {string} name of the pair @param {import("../saver.js").Saver} saver
 * @param {ImageBitmap | null} picture of the live image @param {(id: number) => void} reopen */
export function showConflict(id, name, saver, picture, reopen) {
  const ask = () => settle(id, name, saver, picture, reopen);
  // What goes wrong is told by who asked; the next question comes all the same.
  return (asked = asked.then(ask, ask));
}

/** Ask, and save what was decided; ask again until it is saved.
 * @param {number} id @param {string} name @param {import("../saver.js").Saver} saver
 * @param {ImageBitmap | null} picture @param {(id: number) => void} reopen */
async function settle(id, name, saver, picture, reopen) {
  let versions = await read(id, saver);
  let failure = "";
  try {
    while (versions?.parts.length) {
      show(versions, name, failure, picture);
      await decided();
      try {
        await keep(id, versions);
        saver.resolve(id, null);
        return reopen(id);
      } catch (error) {
        const newer = error instanceof ApiError && error.status === 409;
        failure = newer ? "" : `Not saved: ${/** @type {Error} */ (error).message}. `;
        if (newer) versions = await read(id, saver);
      }
    }
  } finally {
    dismiss();
  }
  if (versions) saver.resolve(id, versions.theirs.revision);
}

/** @param {number} id @param {import("../saver.js").Saver} saver
 * @returns {Promise<Versions | null>} null where nothing is unsent */
async function read(id, saver) {
  const began = saver.base(id);
  const [theirs, base] = await Promise.all([api.mask(id), began ? api.revision(id, began) : null]);
  const unsent = saver.unsent(id);
  if (!unsent) return null;
  const { width, height, counts } = unsent;
  const layer = (/** @type {string | null | undefined} */ text) => text ? decode(text, width, height) : emptyMask(width, height);
  // Who drew no ill-posed pixels left them as they were.
  const ignored = layer(saver.unsentIgnore(id) ?? base?.ignore);
  const layers = [
    compare("mask", layer(counts), layer(theirs.mask.counts), base && layer(base.mask.counts)),
    compare("ignore", ignored, layer(theirs.ignore), base && layer(base.ignore)),
  ];
  const parts = layers.flatMap((compared) => compared.parts);
  return { began, theirs, unsent, ignored, layers, parts, kept: null };
}

/** Fill the dialog. @param {Versions} versions @param {string} name of the pair
 * @param {string} failure of the last save @param {ImageBitmap | null} picture */
function show({ began, theirs, unsent, layers, parts }, name, failure, picture) {
  const who = theirs.annotator ?? "an import";
  const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("conflict-picture"));
  const list = /** @type {HTMLElement} */ (document.getElementById("conflict-parts"));
  text("conflict-text", `${failure}${name}: you began from revision ${began}; ${who} has saved revision `
    + `${theirs.revision} since. Choose part by part whose version holds.`);
  text("conflict-who", who);
  const draw = () => {
    paint(canvas, picture, layers);
    list.replaceChildren(...parts.map((part, place) => partRow(part, place, who, draw)));
  };
  canvas.onclick = (event) => {
    const box = canvas.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * unsent.width);
    const y = Math.floor(((event.clientY - box.top) / box.height) * unsent.height);
    const part = layers.map((compared) => partAt(compared, y * unsent.width + x)).find(Boolean);
    if (part) part.mine = !part.mine;
    draw();
  };
  for (const [button, value] of /** @type {const} */ ([["all-mine", true], ["all-theirs", false]])) {
    on(button, () => {
      for (const part of parts) part.mine = value;
      draw();
    });
  }
  draw();
}

/** Save mine on top of theirs, and the merged layers on top of both; what is saved already is not
 * saved again. @param {number} id @param {Versions} versions */
async function keep(id, versions) {
  const { theirs, unsent, ignored, layers, parts } = versions;
  const { width, height, counts, log, seconds } = unsent;
  const kept = (versions.kept ??= (await api.putMask(id, theirs.revision, { mask: { width, height, counts }, ignore: encode(ignored),
    active_seconds: Math.round(seconds * 10) / 10, tool_log: log })).revision);
  const mine = parts.filter((part) => part.mine).length;
  if (mine === parts.length) return;
  const [mask, ignore] = layers.map((compared) => encode(merge(compared)));
  await api.putMask(id, kept, { mask: { width, height, counts: mask }, ignore,
    tool_log: [{ tool: "merge", with: theirs.revision, mine, parts: parts.length }] });
}

/** Wait for "save". The dialog stays until it is saved: nothing can be drawn meanwhile, and Escape
 * must not leave the question unanswered. @returns {Promise<void>} */
function decided() {
  const element = dialog();
  element.onclose = () => element.showModal();
  if (!element.open) element.showModal();
  return new Promise((done) => on("conflict-save", () => done()));
}

function dismiss() {
  const element = dialog();
  element.onclose = null;
  element.close();
}

function dialog() {
  return /** @type {HTMLDialogElement} */ (document.getElementById("conflict"));
}

/** @param {Part} part @param {number} place in the list @param {string} who @param {() => void} changed */
function partRow(part, place, who, changed) {
  const row = document.createElement("li");
  const button = document.createElement("button");
  button.setAttribute("aria-pressed", String(part.mine));
  button.dataset.part = String(place);
  const [x0, y0, x1, y1] = part.box;
  const layer = part.layer === "ignore" ? "ill-posed, " : "";
  button.textContent = `${layer}${part.area} px at ${Math.round((x0 + x1) / 2)}, ${Math.round((y0 + y1) / 2)}: ${part.mine ? "yours" : who}`;
  button.onclick = () => {
    part.mine = !part.mine;
    changed();
    /** @type {HTMLElement | null} */ (document.querySelector(`[data-part="${place}"]`))?.focus();
  };
  row.append(button);
  return row;
}

/** What both have is grey; a part is in the colour of whose version holds, pale where that has
 * nothing. Ill-posed pixels are hatched.
 * @param {HTMLCanvasElement} canvas @param {ImageBitmap | null} picture @param {Compared[]} layers */
function paint(canvas, picture, layers) {
  const { width, height } = layers[0].mine;
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d");
  if (!context) return;
  if (picture) context.drawImage(picture, 0, 0, width, height);
  const pixels = context.getImageData(0, 0, width, height);
  for (const compared of layers) {
    const { layer, mine, theirs } = compared;
    for (let i = 0; i < mine.data.length; i++) {
      const part = partAt(compared, i);
      if (!part && !mine.data[i]) continue;
      if (layer === "ignore" && ((i % width) + Math.floor(i / width)) % HATCH_PX >= HATCH_PX / 2) continue;
      const colour = part ? (part.mine ? MINE : THEIRS) : BOTH;
      const holds = part?.mine ?? true ? mine.data[i] : theirs.data[i];
      const weight = holds ? 0.75 : 0.3;
      for (let c = 0; c < 3; c++) {
        pixels.data[4 * i + c] = weight * colour[c] + (1 - weight) * pixels.data[4 * i + c];
      }
      pixels.data[4 * i + 3] = 255;
    }
  }
  context.putImageData(pixels, 0, 0);
}

/** @param {string} id @param {() => void} click */
function on(id, click) {
  /** @type {HTMLButtonElement} */ (document.getElementById(id)).onclick = click;
}

/** @param {string} id @param {string} content */
function text(id, content) {
  const element = document.getElementById(id);
  if (element) element.textContent = content;
}
