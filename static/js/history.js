/**
 * Undo and redo: two stacks of patches, one entry an action. A patch holds the pixels of its box
 * before and after, so undoing costs the box and not the image.
 * @typedef {import("./raster.js").Mask} Mask
 * @typedef {import("./raster.js").Box} Box
 * @typedef {{tool: string, box: Box, before: Uint8Array, after: Uint8Array}} Patch
 */
import { copyBox, pasteBox } from "./raster.js";

export class History {
  constructor() {
    /** @type {Patch[]} */
    this.done = [];
    /** @type {Patch[]} */
    this.undone = [];
  }

  /** Record what an action changed; an action that changed nothing leaves no entry.
   * @param {string} tool @param {Mask} before a copy of the mask from before the action
   * @param {Mask} mask the mask now @param {Box | null} box @returns {boolean} whether it changed */
  record(tool, before, mask, box) {
    if (!box) return false;
    const patch = { tool, box, before: copyBox(before, box), after: copyBox(mask, box) };
    if (patch.before.every((value, i) => value === patch.after[i])) return false;
    this.done.push(patch);
    this.undone = [];
    return true;
  }

  /** @param {Mask} mask @returns {Patch | null} the patch that was taken back */
  undo(mask) {
    const patch = this.done.pop();
    if (!patch) return null;
    pasteBox(mask, patch.box, patch.before);
    this.undone.push(patch);
    return patch;
  }

  /** @param {Mask} mask @returns {Patch | null} the patch that was done again */
  redo(mask) {
    const patch = this.undone.pop();
    if (!patch) return null;
    pasteBox(mask, patch.box, patch.after);
    this.done.push(patch);
    return patch;
  }
}
