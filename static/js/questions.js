/**
 * What tools ask the server about the open pair while a person uses them: what a click means, how
 * an edge runs, and where a point of the reference lies in the live image.
 * @typedef {import("./state.js").State} State
 */
import { api } from "./api.js";

/** @param {State} state @param {string} client names the window that asks
 * @param {object} body @param {AbortSignal} signal */
export function askClick({ pair }, client, body, signal) {
  if (!pair) return Promise.reject(new Error("no pair is open"));
  return api.click(pair.id, { client, run: pair.run, ...body }, signal);
}

/** @param {State} state @param {{x: number, y: number}} from @param {{x: number, y: number}} to */
export async function edgePath({ pair }, from, to) {
  if (!pair) return [to];
  const { points } = await api.edgePath(pair, from, to);
  return points.map((/** @type {number[]} */ [x, y]) => ({ x: x + 0.5, y: y + 0.5 }));
}

/** @param {State} state @param {{x: number, y: number}} at in the reference as it was taken */
export function livePoint({ pair }, at) {
  if (!pair) return Promise.reject(new Error("no pair is open"));
  return api.livePoint(pair.id, pair.run, at);
}
