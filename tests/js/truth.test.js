import assert from "node:assert/strict";
import { test } from "node:test";

import { truthLine } from "../../static/js/truth.js";

/** @param {Partial<import("../../static/js/wire.js").TruthInfo>} own */
const truth = (own) => ({ revision: 3, standing: "approved", said_by: ["Ada", "Bo"], changed_by: [], ...own });

for (const [told, given, newest, line] of [
  ["no mask at all", null, 0, ""],
  ["a mask that nobody has submitted", null, 4, "unfinished: counts once it is submitted"],
  ["an approval", truth({}), 3, "approved r3 by Ada, Bo"],
  ["an import", truth({ standing: "imported", said_by: [] }), 3, "imported r3"],
  ["an empty pair", truth({ standing: "confirmed_empty", said_by: ["Ada"] }), 3, "confirmed empty r3 by Ada"],
  ["somebody's change since", truth({ said_by: [], changed_by: ["Cy"] }), 5, "approved r3; changed since by Cy"],
  ["a change of mine that the server does not tell yet", truth({ said_by: [] }), 4, "approved r3; changed since by Me"],
]) {
  test(`the line about the ground truth tells ${told}`, () => assert.equal(truthLine(given, newest, "Me"), line));
}
