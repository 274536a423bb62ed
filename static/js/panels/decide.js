/**
 * The bar at the side's foot: the verdicts on the selected region, and what can be made of the
 * selected proposal. Always in sight; what cannot be done now is shown so.
 * @typedef {import("../wire.js").VerdictChange["verdict"]} Verdict
 */

const VERDICTS = /** @type {const} */ (["agree", "adopt", "keep", "reject"]);
const WAYS = [["add", "+", "add", "Add to the mask"], ["subtract", "−", "subtract", "Take out of the mask"],
  ["replace", "⇄", "replace", "Replace what it touches"], ["reject", "×", "reject-proposal", "Reject the proposal"],
  ["ill-posed", "?", "ill-posed", "Mark as ill-posed"]];
const TITLES = { agree: "Agree with the decision", adopt: "Adopt the object", keep: "Keep the detector's mask",
  reject: "Reject: nothing changed here" };

/** @param {{verdicts: HTMLElement, ways: HTMLElement}} roots @param {import("../state.js").State} state
 * @param {{verdict: (verdict: Verdict) => void, apply: (way: string) => void, shown: (action: string) => string}} on */
export function drawDecisions(roots, state, on) {
  const { proposal, region } = state;
  roots.verdicts.replaceChildren(...VERDICTS.map((verdict) => {
    const button = buttonOf(verdict, `${TITLES[verdict]} (${on.shown(verdict)})`, () => on.verdict(verdict));
    button.dataset.verdict = verdict;
    button.setAttribute("aria-label", TITLES[verdict]);
    button.disabled = !region || (verdict === "adopt" && !region.has_object);
    button.setAttribute("aria-pressed", String(region?.verdict === verdict));
    return button;
  }));
  roots.ways.replaceChildren(...WAYS.map(([way, sign, action, title]) => {
    const button = buttonOf(sign, `${title} (${on.shown(action)})`, () => on.apply(way));
    button.dataset.way = way;
    button.setAttribute("aria-label", title);
    button.disabled = !proposal;
    button.setAttribute("aria-pressed", String(proposal?.outcome === way));
    return button;
  }));
}

/** @param {string} text @param {string} title @param {() => void} act */
function buttonOf(text, title, act) {
  const button = document.createElement("button");
  button.textContent = text;
  button.title = title;
  button.onclick = act;
  return button;
}
