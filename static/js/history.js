/**
 * Undo and redo: two stacks of patches, one entry an action. A patch holds which pixels of its box
 * flipped, a bit each, so taking it back and doing it again are the same work, and unlimited
 * entries are cheap to keep. A verdict and a rejection are entries too: they flip nothing here.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 * @typedef {"mask" | "ignore"} Layer
 * @typedef {Record<Layer, Mask>} Masks
 * @typedef {{layer: Layer, box: Box, flips: Uint8Array, action: {tool: string}}} Patch
 * @typedef {{before: Record<string, string | null>, action: {tool: string}}} Rejection proposals that
 *   were rejected, by key, with what had been made of each before
 * @typedef {Patch | Rejection | import("./verdicts.js").Judged} Entry
 */

export class History {
  /** @param {Entry[]} [done] @param {Entry[]} [undone] */
  constructor(done = [], undone = []) {
    this.done = done;
    this.undone = undone;
  }

  /** Record what an action changed; an action that changed nothing leaves no entry.
   * @param {Layer} layer @param {Mask} before a copy of the layer from before the action
   * @param {Mask} mask the layer now @param {Box | null} box where it may have changed
   * @param {{tool: string}} action @returns {Patch | null} */
  record(layer, before, mask, box, action) {
    const changed = box && tight(before, mask, box);
    if (!changed) return null;
    const patch = { layer, box: changed, flips: difference(before, mask, changed), action };
    this.push(patch);
    return patch;
  }

  /** Note what drew nothing. @param {Entry} entry */
  push(entry) {
    this.done.push(entry);
    this.undone = [];
  }

  /** Return what would be taken back, or done again, next. @param {"undo" | "redo"} way */
  next(way) {
    return (way === "undo" ? this.done : this.undone).at(-1) ?? null;
  }

  /** @param {Masks} masks @returns {Entry | null} the entry that was taken back */
  undo(masks) {
    return move(this.done, this.undone, masks);
  }

  /** @param {Masks} masks @returns {Entry | null} the entry that was done again */
  redo(masks) {
    return move(this.undone, this.done, masks);
  }
}

/** @param {Entry[]} from @param {Entry[]} to @param {Masks} masks */
function move(from, to, masks) {
  const entry = from.pop();
  if (!entry) return null;
  if ("flips" in entry) flip(masks[entry.layer], entry);
  to.push(entry);
  return entry;
}

/** Flip the pixels of a patch. @param {Mask} mask @param {Patch} patch */
function flip(mask, { box, flips }) {
  let bit = 0;
  for (let y = box.y0; y < box.y1; y++) {
    for (let i = y * mask.width + box.x0, end = i + box.x1 - box.x0; i < end; i++, bit++) {
      if (flips[bit >> 3] & (1 << (bit & 7))) mask.data[i] ^= 1;
    }
  }
}

/** @param {Mask} before @param {Mask} after @param {Box} box @returns {Box | null} */
function tight(before, after, box) {
  const found = { x0: box.x1, y0: box.y1, x1: box.x0, y1: box.y0 };
  for (let y = box.y0; y < box.y1; y++) {
    const row = y * before.width;
    for (let x = box.x0; x < box.x1; x++) {
      if (before.data[row + x] === after.data[row + x]) continue;
      if (x < found.x0) found.x0 = x;
      if (x >= found.x1) found.x1 = x + 1;
      if (y < found.y0) found.y0 = y;
      found.y1 = y + 1;
    }
  }
  return found.x0 < found.x1 ? found : null;
}

/** @param {Mask} before @param {Mask} after @param {Box} box */
function difference(before, after, box) {
  const flips = new Uint8Array(Math.ceil(((box.x1 - box.x0) * (box.y1 - box.y0)) / 8));
  let bit = 0;
  for (let y = box.y0; y < box.y1; y++) {
    for (let i = y * before.width + box.x0, end = i + box.x1 - box.x0; i < end; i++, bit++) {
      if (before.data[i] !== after.data[i]) flips[bit >> 3] |= 1 << (bit & 7);
    }
  }
  return flips;
}
