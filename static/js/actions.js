/**
 * What keys and buttons do: one function for each action of the key table.
 * @typedef {{state: import("./state.js").State, desk: import("./desk.js").PairDesk,
 *   side: import("./side.js").Side, modes: import("./modes.js").Modes, pressAt: (right: boolean) => void,
 *   settings: () => void, redraw: () => void, fitAll: () => void, fitProposal: () => void,
 *   takePrediction: () => Promise<unknown>, theme: () => void, help: () => void,
 *   notice: (text: string, bad?: boolean) => void}} Parts
 */
import { dropSpecks, fillHoles, grow, keepComponent, shrink, smooth } from "./cleanup.js";
import { $ } from "./chrome.js";
import { MODES } from "./modes.js";

const LEAST_SPECK_PX = 20;

/** @type {Record<string, (mask: import("./raster.js").Mask, at: {x: number, y: number}) => Uint8Array>} */
export const CLEANUPS = {
  "fill-holes": fillHoles,
  "drop-specks": (mask) => dropSpecks(mask, LEAST_SPECK_PX),
  "keep-component": keepComponent,
  grow,
  shrink,
  smooth,
};

/** @param {Parts} parts @returns {Record<string, (down: boolean) => unknown>} */
export function actionsOf(parts) {
  const { state, desk, side, modes } = parts;

  /** @param {"radius" | "opacity" | "brightness" | "contrast"} name @param {number} value
   * @param {number} least @param {number} most */
  const set = (name, value, least, most) => {
    state[name] = Math.round(Math.min(most, Math.max(least, value)) * 100) / 100;
    parts.settings();
  };
  const setRadius = (/** @type {number} */ radius) => set("radius", Math.round(radius * 2) / 2, 1, 60);
  const setLight = (/** @type {"brightness" | "contrast"} */ name, /** @type {number} */ by) =>
    set(name, state[name] + by, 0.4, 2.5);

  /** @param {string} name */
  const chooseTool = (name) => {
    // A candidate that is shown counts as wanted; an outline that is not closed does not.
    if (desk.pointing.chosen) desk.finish();
    desk.cancel();
    state.tool = name;
    parts.settings();
  };

  /** @param {string} name */
  const cleanUp = (name) => {
    if (!desk.editable || desk.active) return;
    if (name === "keep-component" && !state.cursor) return parts.notice("Point at the part to keep.");
    const inside = state.cursor && state.pair && state.cursor.x >= 0 && state.cursor.y >= 0
      && state.cursor.x < state.pair.width && state.cursor.y < state.pair.height;
    if (name === "keep-component" && !inside) return parts.notice("Point at the part to keep.");
    desk.replace(state.target, CLEANUPS[name](desk.mask, state.cursor ?? { x: 0, y: 0 }), { tool: name });
  };

  /** @param {number} dx @param {number} dy screen steps */
  const moveCursor = (dx, dy) => {
    const { pair } = state;
    if (!pair) return;
    const step = Math.max(1, 8 / state.view.scale);
    const at = state.cursor ?? { x: state.view.x, y: state.view.y };
    const inside = (/** @type {number} */ v, /** @type {number} */ n) => Math.min(Math.max(v, 0.5), n - 0.5);
    state.cursor = { x: inside(at.x + dx * step, pair.width), y: inside(at.y + dy * step, pair.height) };
    if (desk.active) desk.move(state.cursor);
    parts.redraw();
  };

  const walk = (/** @type {number} */ by) => {
    if (desk.pointing.found.length) return desk.pointing.cycle(by);
    return side.walk(by);
  };

  return {
    ...Object.fromEntries([...Object.keys(desk.tools), "click"].map((tool) => [tool, () => chooseTool(tool)])),
    ...Object.fromEntries(Object.keys(CLEANUPS).map((name) => [name, () => cleanUp(name)])),
    ...Object.fromEntries(["add", "subtract", "replace", "ill-posed"].map((way) => [way, () => desk.apply(way)])),
    "reject-proposal": () => desk.apply("reject"),
    target: () => {
      desk.finish();
      state.target = state.target === "mask" ? "ignore" : "mask";
      parts.settings();
    },
    smaller: () => setRadius(state.radius / 1.2 - 0.25),
    larger: () => setRadius(state.radius * 1.2 + 0.25),
    undo: () => modes.takeBack(),
    redo: () => desk.step("redo"),
    cancel: () => desk.cancel(),
    take: () => parts.takePrediction(),
    "cursor-left": () => moveCursor(-1, 0),
    "cursor-right": () => moveCursor(1, 0),
    "cursor-up": () => moveCursor(0, -1),
    "cursor-down": () => moveCursor(0, 1),
    press: () => parts.pressAt(false),
    "press-other": () => parts.pressAt(true),
    hide: (down) => { state.hidden = down; parts.redraw(); },
    blink: (down) => { state.blinking = down; parts.redraw(); },
    swipe: (down) => { state.swiping = down; parts.redraw(); },
    outline: () => { state.outline = !state.outline; parts.settings(); },
    fit: () => { parts.fitAll(); parts.redraw(); },
    goto: () => parts.fitProposal(),
    fainter: () => set("opacity", state.opacity - 0.1, 0, 1),
    stronger: () => set("opacity", state.opacity + 0.1, 0, 1),
    darker: () => setLight("brightness", -0.1),
    brighter: () => setLight("brightness", 0.1),
    flatter: () => setLight("contrast", -0.1),
    crisper: () => setLight("contrast", 0.1),
    plain: () => { state.brightness = state.contrast = 1; parts.settings(); },
    "next-proposal": () => walk(1),
    "previous-proposal": () => walk(-1),
    source: () => { side.nextSource(); parts.settings(); return side.load(); },
    ...Object.fromEntries(["agree", "adopt", "keep", "reject"].map((verdict) => [verdict, () => modes.judge(verdict)])),
    ...Object.fromEntries([1, 2, 3, 4, 5].map((n) => [`reason-${n}`, () => side.reasons.pick(n - 1)])),
    submit: () => modes.submit(),
    approve: () => modes.approve(),
    empty: () => modes.confirmEmpty(),
    skip: () => modes.skip(),
    reopen: () => state.pair?.state === "skipped" ? modes.takeUp(state.pair.id) : desk.setState("in_progress"),
    next: () => modes.step(1),
    previous: () => modes.step(-1),
    side: () => {
      state.side = state.side === "history" ? "proposals" : "history";
      parts.settings();
      return side.load().then(() => {
        if (state.side === "history") $("history-list").querySelector("li")?.focus();
      });
    },
    mode: () => modes.change(MODES[(MODES.indexOf(state.mode) + 1) % MODES.length]),
    controls: () => /** @type {HTMLElement} */ (document.querySelector(".bar button")).focus(),
    theme: () => parts.theme(),
    help: () => parts.help(),
  };
}
