/**
 * The list of proposals, with what can be done with the selected one (a region under DoI also takes
 * a verdict); and the scores. Draws from the state; what is clicked goes to the callbacks.
 * @typedef {import("../state.js").Region} Region
 * @typedef {import("../state.js").Proposal} Proposal
 * @typedef {import("../wire.js").ScoreInfo} Score
 */

/** @type {Record<Region["reason"], string>} */
const REASONS = {
  between_thresholds: "object fits better",
  seen_in_reference: "object was there before",
  agrees: "detector and object agree",
  too_ill_posed: "too ill-posed",
  no_detection: "nothing detected",
  no_object: "no object found",
  outside_warp: "unseen: nothing of it can be compared",
  better_object: "another object fits better",
};
const VERDICTS = /** @type {const} */ (["agree", "adopt", "keep", "reject"]);
const DASH = "–";
const METHODS = { base: "without DoI", doi: "with DoI", audited: "after audit" };

/** @type {Record<string, string>} */
const OUTCOMES = { add: "added", subtract: "taken out", replace: "replaced", reject: "rejected", "ill-posed": "ill-posed" };
/** @type {Partial<Record<Proposal["source"], string>>} */
const NAMES = { detector: "detector", object_live: "object", object_reference: "object before", candidate: "candidate",
  prediction: "prediction", missed: "only predicted", extra: "only drawn" };

/** @param {HTMLElement} root @param {Proposal[]} proposals @param {Region[]} regions
 * @param {string | null} selected its key
 * @param {{select: (key: string) => void, verdict: (key: string, verdict: import("../wire.js").VerdictChange["verdict"]) => void,
 *   apply: (key: string, way: string) => void, shown: (action: string) => string}} on */
export function drawProposals(root, proposals, regions, selected, on) {
  root.replaceChildren(...proposals.map((proposal) => {
    const region = regions.find((each) => each.id === proposal.region_id);
    const item = document.createElement("li");
    item.className = "region";
    item.dataset.proposal = proposal.key;
    if (region) item.dataset.region = String(region.id);
    item.setAttribute("aria-selected", String(proposal.key === selected));
    const verdict = (/** @type {import("../wire.js").VerdictChange["verdict"]} */ given) => on.verdict(proposal.key, given);
    item.append(...(region ? regionLines(region, verdict, on.shown) : plainLines(proposal)));
    const ways = element("div", "ways");
    ways.append(...WAYS.map(([way, sign, action]) => {
      const button = document.createElement("button");
      button.textContent = sign;
      button.dataset.way = way;
      button.title = `${OUTCOMES[way]} (${on.shown(action)})`;
      button.setAttribute("aria-label", way);
      button.setAttribute("aria-pressed", String(proposal.outcome === way));
      button.onclick = (event) => {
        event.stopPropagation();
        on.apply(proposal.key, way);
      };
      return button;
    }));
    item.append(ways);
    if (proposal.outcome) {
      item.dataset.outcome = proposal.outcome;
      item.querySelector(".top")?.append(element("span", "outcome", OUTCOMES[proposal.outcome] ?? proposal.outcome));
    }
    item.onclick = () => on.select(proposal.key);
    return item;
  }));
  root.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
}

const WAYS = [["add", "+", "add"], ["subtract", "−", "subtract"], ["replace", "⇄", "replace"],
  ["reject", "×", "reject-proposal"], ["ill-posed", "?", "ill-posed"]];

/** @param {Proposal} proposal */
function plainLines(proposal) {
  const top = element("div", "top");
  const name = NAMES[proposal.source] ?? proposal.source;
  top.append(element("span", "doi", `${name} ${proposal.number + 1}`), element("span", "soft", proposal.label));
  const score = proposal.score === null ? "" : `   score ${proposal.score.toFixed(2)}`;
  return [top, element("div", "terms", `${proposal.area} px${score}`)];
}

/** @param {Region} region @param {(verdict: import("../wire.js").VerdictChange["verdict"]) => void} give
 * @param {(action: string) => string} shown */
function regionLines(region, give, shown) {
  const outcome = region.verdict && region.verdict !== "agree" ? region.verdict : region.choice;
  const top = element("div", "top");
  const swatch = element("span", "swatch");
  swatch.style.background = doiColour(region.doi);
  const choice = element("span", "choice", region.verdict ? `${outcome} ✓` : outcome);
  choice.dataset.choice = outcome;
  top.append(swatch, element("span", "doi", region.doi.toFixed(3)),
    element("span", "soft", `#${region.number} ${region.label}`));
  if (region.inspect) top.append(element("span", "inspect", "look again"));
  top.append(choice);
  const known = region.reason !== "outside_warp";
  const terms = (known ? `f_b ${region.f_b}   IoU ${region.iou.toFixed(2)}   ` : "") + REASONS[region.reason];
  const verdicts = element("div", "verdicts");
  verdicts.append(...VERDICTS.map((verdict) => verdictButton(region, verdict, () => give(verdict), shown)));
  const said = [region.verdict_reason, region.comment].filter(Boolean).join(": ");
  const words = said ? [element("div", "terms", `“${said}” ${region.audited_by ?? ""}`)] : [];
  return [top, element("div", "terms", terms), ...whyLines(region, outcome), ...words, verdicts];
}

/** The equation with this region's numbers, and what each outcome would make of the pair's F.
 * @param {Region} region @param {string} outcome */
function whyLines(region, outcome) {
  const { f_b, iou, doi, overlap_px: shared, reason } = region;
  const equation = `DoI = f_b × (1 − IoU) = ${f_b} × (1 − ${iou.toFixed(3)}) = ${doi.toFixed(3)}`;
  const lines = reason === "outside_warp" ? []
    : [element("div", "why", `${equation}; ${shared} px shared with the reference's objects`)];
  const scores = Object.entries(region.f_if);
  if (scores.length) {
    const line = element("div", "why", "this pair's F: ");
    for (const [k, [name, score]] of scores.entries()) {
      if (k) line.append(" · ");
      line.append(element(name === outcome ? "b" : "span", "", `${name} ${score?.toFixed(3) ?? DASH}`));
    }
    lines.push(line);
  }
  return lines;
}

/** @param {Region} region @param {import("../wire.js").VerdictChange["verdict"]} verdict @param {() => void} give
 * @param {(action: string) => string} shown */
function verdictButton(region, verdict, give, shown) {
  const button = document.createElement("button");
  button.textContent = verdict;
  button.title = `${verdict} (${shown(verdict)})`;
  button.dataset.verdict = verdict;
  button.disabled = verdict === "adopt" && !region.has_object;
  button.setAttribute("aria-pressed", String(region.verdict === verdict));
  button.onclick = (event) => {
    event.stopPropagation();
    give();
  };
  return button;
}

/** @param {HTMLElement} root @param {Record<string, Score>} scores */
export function drawScores(root, scores) {
  const rows = Object.entries(METHODS).filter(([method]) => method in scores);
  if (!rows.length) {
    root.replaceChildren(element("span", "soft", "No scores: no ground truth yet"));
    return;
  }
  const table = document.createElement("table");
  const head = table.insertRow();
  for (const title of ["this pair", "P", "R", "F"]) head.append(element("th", "", title));
  for (const [method, title] of rows) {
    const { tp, fp, fn, precision, recall, f_score } = scores[method];
    // Nothing changed, and nothing was found: that is right, and no score says so.
    const shown = (/** @type {number} */ score) => (tp + fp + fn ? score.toFixed(3) : DASH);
    const row = table.insertRow();
    row.dataset.method = method;
    for (const text of [title, ...[precision, recall, f_score].map(shown)]) {
      row.insertCell().textContent = text;
    }
  }
  // It is the same whatever the mask: what the run has not seen.
  const { unseen, unseen_objects: objects } = scores[rows[0][0]];
  const whole = objects ? `, ${objects} changed object${objects > 1 ? "s" : ""} as a whole` : "";
  root.replaceChildren(table, element("span", "soft", `unseen, not scored: ${(100 * unseen).toFixed(1)} %${whole}`));
}

/** Blue at 0, yellow at 0.5, red at 1: as the server colours the DoI layer. @param {number} doi */
function doiColour(doi) {
  const stops = [[70, 170, 255], [255, 214, 64], [255, 64, 90]];
  const k = doi <= 0.5 ? 0 : 1;
  const t = (doi - k * 0.5) / 0.5;
  const mixed = stops[k].map((low, i) => Math.round(low + t * (stops[k + 1][i] - low)));
  return `rgb(${mixed.join(",")})`;
}

/** @param {string} tag @param {string} name class @param {string} [text] */
function element(tag, name, text = "") {
  const made = document.createElement(tag);
  if (name) made.className = name;
  made.textContent = text;
  return made;
}
