/**
 * In words, which revision of a pair counts as ground truth: who approved or submitted it, and who
 * has drawn since. An approval speaks of one revision; what comes after it has not been looked at.
 * @typedef {import("./wire.js").TruthInfo} Truth
 */

/** @type {Record<string, string>} */
const SAID = { approved: "approved", submitted: "submitted", confirmed_empty: "confirmed empty" };

/**
 * @param {Truth | null} truth @param {number} newest the revision on the screen, 0 = none
 * @param {string} me who has drawn what the server does not tell yet
 * @returns {string} "" where there is no mask at all
 */
export function truthLine(truth, newest, me) {
  if (!truth) return newest ? "unfinished: counts once it is submitted" : "";
  const by = truth.said_by.length ? ` by ${truth.said_by.join(", ")}` : "";
  const what = `${SAID[truth.standing] ?? "imported"} r${truth.revision}${by}`;
  if (newest <= truth.revision) return what;
  const changed = truth.changed_by.length ? truth.changed_by : [me];
  return `${what}; changed since by ${changed.join(", ")}`;
}
