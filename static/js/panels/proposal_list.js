/**
 * The list of proposals as cards: the place on both images, what is said of it in a plain sentence,
 * the equation folded; and the scores. What can be done with the selected one stands in `decide.js`.
 * Draws from the state; what is clicked goes to the callbacks.
 * @typedef {import("../state.js").Region} Region
 * @typedef {import("../state.js").Proposal} Proposal
 * @typedef {import("../wire.js").ScoreInfo} Score
 */
import { explained } from "./symbols.js";

/** @type {Record<Region["reason"], string>} */
const REASONS = {
  between_thresholds: "The object fits better than the detector",
  seen_in_reference: "The object was there before",
  agrees: "Detector and object agree",
  too_ill_posed: "Too ill-posed to follow the object",
  no_detection: "The detector saw nothing here",
  no_object: "No object was found here",
  outside_warp: "Unseen: nothing of it can be compared",
  better_object: "Another object fits better",
};
const DASH = "–";
const METHODS = { base: "without DoI", doi: "with DoI", audited: "after audit" };

/** @type {Record<string, string>} */
const OUTCOMES = { add: "added", subtract: "taken out", replace: "replaced", reject: "rejected", "ill-posed": "ill-posed" };
/** @type {Partial<Record<Proposal["source"], string>>} */
const NAMES = { detector: "detector", object_live: "object", object_reference: "object before", candidate: "candidate",
  prediction: "prediction", missed: "only predicted", extra: "only drawn" };

/** @param {HTMLElement} root @param {Proposal[]} proposals @param {Region[]} regions
 * @param {string | null} selected its key @param {import("./crops.js").Crops} crops
 * @param {(key: string) => void} select */
export function drawProposals(root, proposals, regions, selected, crops, select) {
  crops.clear();
  root.replaceChildren(...proposals.map((proposal) => {
    const region = regions.find((each) => each.id === proposal.region_id);
    const item = document.createElement("li");
    item.className = "region";
    item.tabIndex = 0;
    item.dataset.proposal = proposal.key;
    if (region) item.dataset.region = String(region.id);
    item.setAttribute("aria-selected", String(proposal.key === selected));
    item.append(crops.make(proposal.box_xyxy), ...(region ? regionLines(region) : plainLines(proposal)));
    if (proposal.outcome) {
      item.dataset.outcome = proposal.outcome;
      item.querySelector(".top")?.append(element("span", "outcome", OUTCOMES[proposal.outcome] ?? proposal.outcome));
    }
    item.onclick = () => select(proposal.key);
    item.onkeydown = (event) => { if (event.key === "Enter" && event.target === item) select(proposal.key); };
    return item;
  }));
  root.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
}

/** @param {Proposal} proposal */
function plainLines(proposal) {
  const top = element("div", "top");
  const name = NAMES[proposal.source] ?? proposal.source;
  top.append(element("span", "doi", `${name} ${proposal.number + 1}`), element("span", "soft", proposal.label));
  const score = proposal.score === null ? "" : `   score ${proposal.score.toFixed(2)}`;
  return [top, element("div", "terms", `${proposal.area} px${score}`)];
}

/** @param {Region} region */
function regionLines(region) {
  const outcome = region.verdict && region.verdict !== "agree" ? region.verdict : region.choice;
  const top = element("div", "top");
  const swatch = element("span", "swatch");
  swatch.style.background = doiColour(region.doi);
  const choice = element("span", "choice", region.verdict ? `${outcome} ✓` : outcome);
  choice.dataset.choice = outcome;
  const doi = element("span", "doi");
  doi.append(...explained(`DoI ${region.doi.toFixed(2)}`));
  top.append(swatch, doi, element("span", "soft", `#${region.number} ${region.label}`));
  top.append(choice);
  const sentence = element("div", "terms sentence", `${REASONS[region.reason]}. `);
  if (region.inspect) sentence.append(element("span", "inspect", "look again"));
  const said = [region.verdict_reason, region.comment].filter(Boolean).join(": ");
  const words = said ? [element("div", "terms", `“${said}” ${region.audited_by ?? ""}`)] : [];
  return [top, sentence, ...whyLines(region, outcome), ...words];
}

/** The equation with this region's numbers, folded, and what each outcome would make of the pair's F.
 * @param {Region} region @param {string} outcome */
function whyLines(region, outcome) {
  const { f_b, iou, doi, overlap_px: shared, reason } = region;
  const lines = [];
  if (reason !== "outside_warp") {
    const why = element("details", "why");
    const body = element("div", "");
    body.append(...explained(`DoI = f_b × (1 − IoU) = ${f_b} × (1 − ${iou.toFixed(3)}) = ${doi.toFixed(3)}; IoU is with M_o; ${shared} px shared with the reference's objects`));
    const title = element("summary", "", "Why: ");
    title.append(...explained(`f_b ${f_b}, IoU ${iou.toFixed(2)}`));
    why.append(title, body);
    why.onclick = (event) => event.stopPropagation();
    lines.push(why);
  }
  const scores = Object.entries(region.f_if);
  if (scores.length) {
    const line = element("div", "why");
    line.append(...explained("this pair's F: "));
    for (const [k, [name, score]] of scores.entries()) {
      if (k) line.append(" · ");
      line.append(element(name === outcome ? "b" : "span", "", `${name} ${score?.toFixed(3) ?? DASH}`));
    }
    lines.push(line);
  }
  return lines;
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
