/**
 * The page around the panes: what its fields, chips and lines say. Draws from the state, decides
 * nothing.
 * @typedef {import("./state.js").State} State
 * @typedef {import("./page.js").PageTags} Tags
 */
import { keepsRadius } from "./tools/brush.js";
import { presetOf } from "./presets.js";
import { truthLine } from "./truth.js";

/** @type {Record<string, string>} */
export const STATES = {
  todo: "to do",
  in_progress: "in progress",
  submitted: "submitted",
  approved: "approved",
  confirmed_empty: "confirmed empty",
  skipped: "skipped",
};
/** The element of the page with an id. @template {keyof Tags} Id @param {Id} id
 * @returns {HTMLElementTagNameMap[Tags[Id]]} */
export const $ = (id) => /** @type {any} */ (document.getElementById(id));

/** @param {State} state */
export function showSettings(state) {
  document.documentElement.dataset.theme = state.dark ? "dark" : "light";
  for (const name of /** @type {const} */ (["radius", "tolerance", "opacity", "brightness", "contrast", "blinkMs", "mode", "source"])) {
    $(name).value = String(state[name]);
  }
  for (const name of /** @type {const} */ (["walkOrder", "walkOpinion"])) $(name).value = state[name];
  for (const name of /** @type {const} */ (["advance", "tabOn", "openAtProposal"])) $(name).checked = state[name];
  $("blinkMs-value").textContent = `${state.blinkMs} ms`;
  $("preset").value = presetOf(state);
  $("pane-count").value = String(state.layers.length);
  $("drawer").setAttribute("aria-expanded", String(state.drawer));
  $("walking").hidden = state.mode !== "audit";
  $("radius-value").textContent = String(state.radius);
  $("tolerance-value").textContent = String(state.tolerance);
  // They share a place that stays, so that nothing jumps when the tool changes.
  $("tolerance-field").classList.toggle("off", state.tool !== "fill");
  $("radius-field").classList.toggle("off", !keepsRadius(state.tool));
  press("button[data-tool]", (element) => element.dataset.tool === state.tool);
  press("#target", () => state.target === "ignore");
  press('[data-action="outline"]', () => state.outline);
  press('[data-action="unseen"]', () => state.veiled);
  for (const tab of document.querySelectorAll("[data-side]")) {
    const { side } = /** @type {HTMLElement} */ (tab).dataset;
    tab.setAttribute("aria-selected", String(side === state.side));
    $(/** @type {"proposals" | "history"} */ (side)).hidden = side !== state.side;
  }
}

/** @param {string} selector @param {(element: HTMLElement) => boolean} pressed */
function press(selector, pressed) {
  for (const element of document.querySelectorAll(selector)) {
    element.setAttribute("aria-pressed", String(pressed(/** @type {HTMLElement} */ (element))));
  }
}

/** @param {State} state */
export function showHeader(state) {
  const { pair } = state;
  if (!pair) return;
  $("title").textContent = `${pair.split}/${pair.name}`;
  $("state").textContent = STATES[pair.state];
  $("state").dataset.state = pair.state;
  $("standing").textContent = truthLine(pair.truth, state.revision, state.annotator);
  $("standing").title = $("standing").textContent;
  $("run").value = state.run ?? "";
  $("skip").hidden = !pair.doubt;
  for (const [action, off] of Object.entries({ submit: state.locked && !state.reviewing, empty: state.locked,
    approve: ["approved", "skipped"].includes(pair.state), skip: state.locked, reopen: !state.locked, take: state.locked || state.blind })) {
    for (const button of document.querySelectorAll(`button[data-action="${action}"]`)) {
      /** @type {HTMLButtonElement} */ (button).disabled = off;
    }
  }
}

/** @param {State} state */
export function showFacts(state) {
  const { pair, area } = state;
  if (!pair) return;
  const facts = [`${pair.width}×${pair.height}`, `mask ${area.mask} px`, `revision ${state.revision}`];
  if (area.ignore) facts.splice(2, 0, `ill-posed ${area.ignore} px`);
  if (pair.doubt) facts.push(`⚠ in doubt: ${pair.doubt}`);
  else if (pair.alignment) facts.push(alignmentFact(pair.alignment));
  const { candidate } = state;
  if (candidate?.count) facts.unshift(`candidate ${candidate.index + 1} of ${candidate.count}, score ${candidate.score.toFixed(2)}`);
  write("facts", facts.join("   ·   "));
  const at = state.cursor;
  const where = at ? `x ${Math.floor(at.x)}  y ${Math.floor(at.y)}  ` : "";
  write("where", `${where}${Math.round(state.view.scale * 100)} %`);
}

/** @param {"facts" | "where"} id @param {string} text */
function write(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text;
}

/** @param {NonNullable<import("./state.js").Pair["alignment"]>} found */
function alignmentFact(found) {
  const parts = [`unseen ${Math.round((1 - found.valid_fraction) * 100)} %`,
    `difference ${found.residual_before.toFixed(1)} → ${found.residual_after.toFixed(1)}`];
  if (found.backward_px !== null) parts.push(`there and back ${found.backward_px.toFixed(1)} px`);
  return parts.join(", ");
}

/** Say that something takes its time; "" when it is done. @param {string} text */
export function waiting(text) {
  $("waiting").textContent = text;
  $("waiting").hidden = !text;
}

let noticeTimer = 0;
/** @param {string} text @param {boolean} [bad]
 * @param {{title: string, act: () => unknown}} [offer] what a button beside the text does */
export function notice(text, bad = false, offer) {
  const hide = () => { $("notice").hidden = true; };
  $("notice").replaceChildren(text);
  if (offer) {
    const button = document.createElement("button");
    button.textContent = offer.title;
    button.onclick = () => { hide(); offer.act(); };
    $("notice").append(button);
  }
  $("notice").dataset.kind = bad ? "bad" : "";
  $("notice").hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = window.setTimeout(hide, bad || offer ? 8000 : 3500);
}

/** Do an action; what goes wrong is told. @param {unknown} work */
export async function attempt(work) {
  try {
    await work;
  } catch (error) {
    notice(error instanceof Error ? error.message : String(error), true);
  }
}
