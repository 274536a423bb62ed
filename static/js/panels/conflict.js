/**
 * A conflict: somebody else saved the pair meanwhile. Show where the two masks differ, and let the
 * person choose part by part. Both versions become part of the pair's history, and the merged one
 * comes after them.
 * @typedef {import("../raster.js").Mask} Mask
 * @typedef {{index: number, area: number, box: number[], mine: boolean}} Part
 */
import { api } from "../api.js";
import { label } from "../cleanup.js";
import { decode, encode } from "../rle.js";

const MINE = [86, 180, 233];
const THEIRS = [230, 159, 0];
const BOTH = [150, 158, 168];

/** @param {number} id @param {string} name of the pair @param {import("../saver.js").Saver} saver
 * @param {ImageBitmap | null} picture of the live image @param {(id: number) => void} reopen */
export async function showConflict(id, name, saver, picture, reopen) {
  const mine = saver.unsent(id);
  if (!mine) return;
  const began = saver.base(id);
  const [theirs, base] = await Promise.all([api.mask(id), began ? api.revision(id, began) : null]);
  const ours = decode(mine.counts, mine.width, mine.height);
  const other = decode(theirs.mask.counts, mine.width, mine.height);
  const { labels, parts } = differences(ours, other);
  if (base) leaveTheirs(parts, labels, ours, decode(base.mask.counts, mine.width, mine.height));
  const who = theirs.annotator ?? "an import";
  const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("conflict-picture"));
  const list = /** @type {HTMLElement} */ (document.getElementById("conflict-parts"));
  text("conflict-text", `${name}: you began from revision ${began}; ${who} has saved revision `
    + `${theirs.revision} since. Choose part by part whose version holds.`);
  text("conflict-who", who);
  const draw = () => {
    paint(canvas, picture, ours, other, labels, parts);
    list.replaceChildren(...parts.map((part) => partRow(part, who, draw)));
  };
  canvas.onclick = (event) => {
    const box = canvas.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * ours.width);
    const y = Math.floor(((event.clientY - box.top) / box.height) * ours.height);
    const part = parts[labels[y * ours.width + x] - 1];
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
  await decided();
  // Mine goes on top of theirs, and the merged mask on top of both.
  const ignore = saver.unsentIgnore(id);
  const { width, height, counts, log, seconds } = mine;
  const kept = await api.putMask(id, theirs.revision, { mask: { width, height, counts }, ignore,
    active_seconds: Math.round(seconds * 10) / 10, tool_log: log });
  if (!parts.every((part) => part.mine)) {
    const merged = merge(ours, other, labels, parts);
    await api.putMask(id, kept.revision, { mask: { width, height, counts: encode(merged) },
      tool_log: [{ tool: "merge", with: theirs.revision, mine: parts.filter((p) => p.mine).length, parts: parts.length }] });
  }
  saver.resolve(id, null);
  reopen(id);
}

/** Split where two masks differ into 8-connected parts, largest first. @param {Mask} mine
 * @param {Mask} theirs @returns {{labels: Int32Array, parts: Part[]}} part k has label k + 1 */
export function differences(mine, theirs) {
  const differ = { ...mine, data: mine.data.map((value, i) => value ^ theirs.data[i]) };
  const { labels, areas } = label(differ, 1, 8);
  const parts = areas.slice(1).map((area, index) => ({ index, area, box: [mine.width, mine.height, 0, 0], mine: true }));
  for (let i = 0; i < labels.length; i++) {
    if (!labels[i]) continue;
    const { box } = parts[labels[i] - 1];
    const x = i % mine.width;
    const y = (i - x) / mine.width;
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x + 1);
    box[3] = Math.max(box[3], y + 1);
  }
  return { labels, parts };
}

/** What only they have changed since the common revision is theirs, unless the person says otherwise.
 * @param {Part[]} parts @param {Int32Array} labels @param {Mask} mine @param {Mask} base */
export function leaveTheirs(parts, labels, mine, base) {
  for (const part of parts) part.mine = false;
  for (let i = 0; i < labels.length; i++) {
    if (labels[i] && mine.data[i] !== base.data[i]) parts[labels[i] - 1].mine = true;
  }
}

/** @param {Mask} mine @param {Mask} theirs @param {Int32Array} labels @param {Part[]} parts */
export function merge(mine, theirs, labels, parts) {
  const data = mine.data.map((value, i) => (labels[i] && !parts[labels[i] - 1].mine ? theirs.data[i] : value));
  return { ...mine, data };
}

/** Wait for "save"; Escape must not leave the question unanswered. @returns {Promise<void>} */
function decided() {
  const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("conflict"));
  return new Promise((done) => {
    let saved = false;
    on("conflict-save", () => {
      saved = true;
      dialog.close();
      done();
    });
    dialog.onclose = () => { if (!saved) dialog.showModal(); };
    if (!dialog.open) dialog.showModal();
  });
}

/** @param {Part} part @param {string} who @param {() => void} changed */
function partRow(part, who, changed) {
  const row = document.createElement("li");
  const button = document.createElement("button");
  button.setAttribute("aria-pressed", String(part.mine));
  button.dataset.part = String(part.index);
  const [x0, y0, x1, y1] = part.box;
  button.textContent = `${part.area} px at ${Math.round((x0 + x1) / 2)}, ${Math.round((y0 + y1) / 2)}: ${part.mine ? "yours" : who}`;
  button.onclick = () => {
    part.mine = !part.mine;
    changed();
    /** @type {HTMLElement | null} */ (document.querySelector(`[data-part="${part.index}"]`))?.focus();
  };
  row.append(button);
  return row;
}

/** What both have is grey; a part is in the colour of whose version holds, pale where that has nothing.
 * @param {HTMLCanvasElement} canvas @param {ImageBitmap | null} picture @param {Mask} mine
 * @param {Mask} theirs @param {Int32Array} labels @param {Part[]} parts */
function paint(canvas, picture, mine, theirs, labels, parts) {
  canvas.width = mine.width;
  canvas.height = mine.height;
  const context = canvas.getContext("2d");
  if (!context) return;
  if (picture) context.drawImage(picture, 0, 0, mine.width, mine.height);
  const pixels = context.getImageData(0, 0, mine.width, mine.height);
  for (let i = 0; i < labels.length; i++) {
    const part = labels[i] ? parts[labels[i] - 1] : null;
    if (!part && !mine.data[i]) continue;
    const colour = part ? (part.mine ? MINE : THEIRS) : BOTH;
    const holds = part?.mine ?? true ? mine.data[i] : theirs.data[i];
    const weight = holds ? 0.75 : 0.3;
    for (let c = 0; c < 3; c++) {
      pixels.data[4 * i + c] = weight * colour[c] + (1 - weight) * pixels.data[4 * i + c];
    }
    pixels.data[4 * i + 3] = 255;
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
