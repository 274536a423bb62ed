/**
 * The paper's symbols, each with what it means where the pointer rests on it.
 */

/** @type {Record<string, string>} */
export const SYMBOLS = {
  DoI: "Degree of ill-posedness: how much better an object explains the place than the detector does, 0 to 1",
  f_b: "1 where the object on the live image shares no pixels with an object on the reference, else 0",
  IoU: "Intersection over union: how well the object and the detector's mask agree, 0 to 1",
  M_o: "The detector's change mask",
  F: "F score: the harmonic mean of precision and recall, 0 to 1",
};
const PARTS = /\b(DoI|f_b|IoU|M_o|F)\b/;

/** Write a text, with its symbols explained. @param {string} text @returns {(string | HTMLElement)[]} */
export function explained(text) {
  return text.split(PARTS).map((part) => {
    if (!(part in SYMBOLS)) return part;
    const symbol = document.createElement("abbr");
    symbol.textContent = part;
    symbol.title = SYMBOLS[part];
    return symbol;
  });
}
