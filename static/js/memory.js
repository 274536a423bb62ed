/**
 * What of the state outlives a reload of the page, after which everything a person set must come
 * back: settings and whose blind phase is over in localStorage, place and zoom in sessionStorage.
 * @typedef {import("./state.js").State} State
 * @typedef {{pair: number, run: string | null, view: import("./geometry.js").View,
 *   selected: string | null, fitted: boolean}} Place
 */
import { SETTINGS } from "./state.js";

/** @param {State} state @param {Storage} storage */
export function restore(state, storage) {
  state.recall(JSON.parse(storage.getItem(`reviewer.revealed.${state.owner}`) ?? "[]"));
  state.change(JSON.parse(storage.getItem(`reviewer.settings.${state.owner}`) ?? "{}"));
}

/** Keep the settings of the person, once it is known who that is.
 * @param {State} state @param {Storage} storage */
export function remember(state, storage) {
  if (!state.owner) return;
  const kept = Object.fromEntries(SETTINGS.map((key) => [key, state[key]]));
  storage.setItem(`reviewer.settings.${state.owner}`, JSON.stringify(kept));
}

/** Keep whose blind phase is over. @param {State} state @param {Storage} storage */
export function rememberRevealed(state, storage) {
  storage.setItem(`reviewer.revealed.${state.owner}`, JSON.stringify(state.revealed));
}

/** Keep where the person is looking. @param {State} state @param {Storage} session */
export function rememberPlace(state, session) {
  if (!state.pair) return;
  const { owner, run, view, selected, fitted } = state;
  session.setItem("reviewer.owner", owner);
  session.setItem("reviewer.place", JSON.stringify({ pair: state.pair.id, run, view, selected, fitted }));
}

/** Return where the person was looking last, null for nowhere.
 * @param {Storage} session @returns {Place | null} */
export function lastPlace(session) {
  return JSON.parse(session.getItem("reviewer.place") ?? "null");
}
