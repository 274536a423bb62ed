/**
 * What keys and buttons do: one function for each action of the key table.
 * @typedef {{state: import("./state.js").State, session: import("./pair_session.js").PairSession,
 *   side: import("./side.js").Side, modes: import("./modes.js").Modes,
 *   looking: import("./looking.js").Looking, around: import("./surroundings.js").Surroundings,
 *   strip: import("./strip.js").Strip, jump: import("./panels/jump.js").Jump,
 *   sweep: import("./sweep.js").Sweep, palette: () => void, tour: () => void}} Parts
 */
import { dropSpecks, fillHoles, grow, keepComponent, shrink, smooth } from "./cleanup.js";
import { $, attempt, notice } from "./chrome.js";
import { STRIP } from "./strip.js";
import { MODES } from "./modes.js";
import { takePrediction } from "./taking.js";

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
export function actionsOf(
  { state, session, side, modes, looking, around, strip, jump, sweep, palette, tour },
) {
  const { hand } = session;

  /** @param {"radius" | "opacity" | "brightness" | "contrast"} name @param {number} value
   * @param {number} least @param {number} most */
  const set = (name, value, least, most) => {
    state.change({ [name]: Math.round(Math.min(most, Math.max(least, value)) * 100) / 100 });
  };
  const setRadius = (/** @type {number} */ radius) => set("radius", Math.round(radius * 2) / 2, 1, 60);
  const setLight = (/** @type {"brightness" | "contrast"} */ name, /** @type {number} */ by) =>
    set(name, state[name] + by, 0.4, 2.5);

  /** @param {string} name */
  const cleanUp = (name) => {
    if (!session.editable || hand.busy) return;
    if (name === "keep-component" && !state.cursor) return notice("Point at the part to keep.");
    const inside = state.cursor && state.pair && state.cursor.x >= 0 && state.cursor.y >= 0
      && state.cursor.x < state.pair.width && state.cursor.y < state.pair.height;
    if (name === "keep-component" && !inside) return notice("Point at the part to keep.");
    session.document.replace(state.target, CLEANUPS[name](session.document.mask, state.cursor ?? { x: 0, y: 0 }), { tool: name });
  };

  /** @param {number} dx @param {number} dy screen steps */
  const moveCursor = (dx, dy) => {
    const { pair } = state;
    if (!pair) return;
    const step = Math.max(1, 8 / state.view.scale);
    const at = state.cursor ?? { x: state.view.x, y: state.view.y };
    const inside = (/** @type {number} */ v, /** @type {number} */ n) => Math.min(Math.max(v, 0.5), n - 0.5);
    const there = { x: inside(at.x + dx * step, pair.width), y: inside(at.y + dy * step, pair.height) };
    state.point(there);
    if (hand.busy) hand.move(there);
  };

  /** Use the tool where the cursor is, from the keyboard. @param {boolean} other take away */
  const press = (other) => {
    if (!state.cursor) return notice("Move the cursor first: Shift and the arrow keys.");
    hand.begin(state.cursor, { shift: false, alt: other, right: false }, "live");
    attempt(hand.release());
  };

  /** Show another side. */
  const turn = async () => {
    state.change({ side: state.side === "history" ? "proposals" : "history" });
    await side.load();
    if (state.side === "history") $("history-list").querySelector("li")?.focus();
  };

  const walk = async (/** @type {number} */ by) => {
    if (hand.tool.cycle?.(by)) return undefined;
    await side.loading;
    return by > 0 && state.tabOn && side.atEnd ? modes.step(1) : side.walk(by);
  };

  return {
    ...Object.fromEntries(Object.keys(hand.tools).map((tool) => [tool, () => hand.take(tool)])),
    ...Object.fromEntries(Object.keys(CLEANUPS).map((name) => [name, () => cleanUp(name)])),
    ...Object.fromEntries(["add", "subtract", "replace", "ill-posed"].map((way) => [way, () => side.apply(way)])),
    "reject-proposal": () => side.apply("reject"),
    // The key may come before the list does.
    "reject-rest": () => side.loading.then(() => session.rejectRest()),
    target: () => {
      hand.complete();
      state.change({ target: state.target === "mask" ? "ignore" : "mask" });
    },
    smaller: () => setRadius(state.radius / 1.2 - 0.25),
    larger: () => setRadius(state.radius * 1.2 + 0.25),
    undo: () => modes.takeBack(),
    redo: () => session.step("redo"),
    cancel: () => hand.cancel(),
    take: () => takePrediction(session),
    "cursor-left": () => moveCursor(-1, 0),
    "cursor-right": () => moveCursor(1, 0),
    "cursor-up": () => moveCursor(0, -1),
    "cursor-down": () => moveCursor(0, 1),
    press: () => press(false),
    "press-other": () => press(true),
    hide: (down) => state.hold({ hidden: down }),
    blink: (down) => state.hold({ blinking: down }),
    swipe: (down) => state.hold({ swiping: down }),
    loupe: (down) => state.hold({ magnifying: down }),
    ...Object.fromEntries(STRIP.slice(0, 9).map((layer, place) => [`layer-${place + 1}`, () => strip.put(layer)])),
    drawer: () => state.change({ drawer: !state.drawer }),
    map: () => around.turn("Map"),
    "what-if": () => around.turn("What if"),
    scores: () => around.turn("Scores"),
    palette,
    tour,
    outline: () => state.change({ outline: !state.outline }),
    unseen: () => state.change({ veiled: !state.veiled }),
    sweep: () => sweep.next(),
    fit: () => looking.fitAll(),
    goto: () => looking.goToProposal(),
    fainter: () => set("opacity", state.opacity - 0.1, 0, 1),
    stronger: () => set("opacity", state.opacity + 0.1, 0, 1),
    darker: () => setLight("brightness", -0.1),
    brighter: () => setLight("brightness", 0.1),
    flatter: () => setLight("contrast", -0.1),
    crisper: () => setLight("contrast", 0.1),
    plain: () => state.change({ brightness: 1, contrast: 1 }),
    "next-proposal": () => walk(1),
    "previous-proposal": () => walk(-1),
    source: () => side.nextSource(),
    ...Object.fromEntries(/** @type {const} */ (["agree", "adopt", "keep", "reject"]).map((verdict) => [verdict, () => modes.judge(verdict)])),
    ...Object.fromEntries([1, 2, 3, 4, 5].map((n) => [`reason-${n}`, () => side.reasons.pick(n - 1)])),
    submit: () => modes.submit(),
    approve: () => modes.approve(),
    empty: () => modes.confirmEmpty(),
    skip: () => modes.skip(),
    reopen: () => state.pair?.state === "skipped" ? modes.takeUp(state.pair.id) : session.setState("in_progress"),
    next: () => modes.step(1),
    jump: () => jump.open(),
    previous: () => modes.step(-1),
    side: turn,
    mode: () => modes.change(MODES[(MODES.indexOf(state.mode) + 1) % MODES.length]),
    controls: () => /** @type {HTMLElement} */ (document.querySelector(".bar button")).focus(),
    theme: () => state.change({ dark: !state.dark }),
    help: () => ($("help").open ? $("help").close() : $("help").showModal()),
  };
}
