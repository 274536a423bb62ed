/**
 * The list of regions under DoI, with the verdict buttons of the selected one; and the scores.
 * Draws from the state; what is clicked goes to the callbacks.
 * @typedef {import("./state.js").Region} Region
 */
import { keyOf } from "./keys.js";

/** @type {Record<string, string>} */
const REASONS = {
  between_thresholds: "object fits better",
  seen_in_reference: "object was there before",
  agrees: "detector and object agree",
  too_ill_posed: "too ill-posed",
  no_detection: "nothing detected",
  no_object: "no object found",
  outside_warp: "outside the valid warp",
  better_object: "another object fits better",
};
const VERDICTS = ["agree", "adopt", "keep", "reject"];
const METHODS = { base: "without DoI", doi: "with DoI", audited: "after audit" };

/** @param {HTMLElement} root @param {Region[]} regions @param {number} selected
 * @param {{select: (index: number) => void, verdict: (index: number, verdict: string) => void}} on */
export function drawRegions(root, regions, selected, on) {
  root.replaceChildren(...regions.map((region, index) => {
    const item = document.createElement("li");
    item.className = "region";
    item.dataset.region = String(region.id);
    item.setAttribute("aria-selected", String(index === selected));
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
    const terms = `f_b ${region.f_b}   IoU ${region.iou.toFixed(2)}   ${REASONS[region.reason] ?? region.reason}`;
    const verdicts = element("div", "verdicts");
    for (const verdict of VERDICTS) verdicts.append(verdictButton(region, verdict, () => on.verdict(index, verdict)));
    item.append(top, element("div", "terms", terms), verdicts);
    item.onclick = () => on.select(index);
    return item;
  }));
  root.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
}

/** @param {Region} region @param {string} verdict @param {() => void} give */
function verdictButton(region, verdict, give) {
  const button = document.createElement("button");
  button.textContent = verdict;
  button.title = `${verdict} (${keyOf(verdict)})`;
  button.dataset.verdict = verdict;
  button.disabled = verdict === "adopt" && !region.has_object;
  button.setAttribute("aria-pressed", String(region.verdict === verdict));
  button.onclick = (event) => {
    event.stopPropagation();
    give();
  };
  return button;
}

/** @param {HTMLElement} root
 * @param {Record<string, {precision: number, recall: number, f_score: number}>} scores */
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
    const { precision, recall, f_score } = scores[method];
    const row = table.insertRow();
    row.dataset.method = method;
    for (const text of [title, ...[precision, recall, f_score].map((v) => v.toFixed(3))]) {
      row.insertCell().textContent = text;
    }
  }
  root.replaceChildren(table);
}

/** Blue at 0, yellow at 0.5, red at 1: as the server colours the DoI layer. @param {number} doi */
export function doiColour(doi) {
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
