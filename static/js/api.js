/**
 * Talk to the gateway: JSON over HTTP, and the desk's WebSocket. Knows URLs and errors, no state.
 * @import {ClickChange, ClickReply, Committed, DoubtfulRegionInfo, EdgePath, FromFrame, JudgedPair, LivePoint,
 *   MaskChange, MaskReply, Me, OpenedPair, PairDetail, PairPage, ProposalInfo, Reasons, RevisionInfo, RunInfo, StateChange, SweepInfo,
 *   StateReply, ToFrame, VerdictChange} from "./wire.js"
 */

/** An answer that is not 2xx: `status` and the problem's text. */
export class ApiError extends Error {
  /** @param {number} status @param {string} detail */
  constructor(status, detail) {
    super(detail);
    this.status = status;
  }
}

const PATIENCE_MS = 20_000;

/** @template T what the server answers @param {string} path @param {RequestInit} [options]
 * @returns {Promise<T>} */
async function call(path, options = {}) {
  const signal = AbortSignal.timeout(PATIENCE_MS);
  const reply = await fetch(path, { credentials: "same-origin", signal, ...options }).catch((error) => {
    if (options.signal?.aborted) throw error;
    throw new Error("The server cannot be reached. What you draw is kept, and sent when it is back.");
  });
  const text = await reply.text();
  const body = text && reply.headers.get("content-type")?.includes("json") ? JSON.parse(text) : null;
  if (!reply.ok) throw new ApiError(reply.status, body?.detail ?? `${reply.status} ${path}`);
  return body;
}

/** @param {string} method @param {object} body @param {Record<string, string>} [headers] */
function send(method, body, headers = {}) {
  return {
    method,
    body: JSON.stringify(body),
    headers: { "Content-Type": "application/json", ...headers },
  };
}

export const api = {
  /** @returns {Promise<RunInfo[]>} */
  runs: () => call("/api/runs"),
  /** @param {number} id @param {string | null} run @returns {Promise<PairDetail>} */
  pair: (id, run) => call(`/api/pairs/${id}${run ? `?run=${encodeURIComponent(run)}` : ""}`),
  /** @param {number} id @returns {Promise<MaskReply>} */
  mask: (id) => call(`/api/pairs/${id}/mask`, { headers: { Accept: "application/json" } }),
  /** A pair with its mask and proposals; the browser keeps it, and asks whether it still holds.
   * @param {number} id @param {string | null} run
   * @param {{sources: string[], run: string | null}} proposed and of which other run
   * @returns {Promise<OpenedPair>} */
  open: (id, run, proposed) => {
    const query = new URLSearchParams(proposed.sources.map((source) => ["source", source]));
    if (run) query.set("run", run);
    if (proposed.run) query.set("proposals_of", proposed.run);
    return call(`/api/pairs/${id}/open?${query}`);
  },
  /** @param {string} search words @param {string | null} run @param {number} limit
   * @returns {Promise<PairPage>} */
  findPairs: (search, run, limit) => call(`/api/pairs?${new URLSearchParams({ search, limit: String(limit), ...(run ? { run } : {}) })}`),
  /** @param {number} id @param {number} revision @param {MaskChange} change
   * @returns {Promise<Committed>} */
  putMask: (id, revision, change) =>
    call(`/api/pairs/${id}/mask`, send("PUT", change, { "If-Match": `"${revision}"` })),
  /** @param {number} id @param {StateChange["state"]} state @param {number | null} revision that was looked at
   * @param {number} seconds of work since the last save @returns {Promise<StateReply>} */
  putState: (id, state, revision, seconds) =>
    call(`/api/pairs/${id}/state`, send("PUT", { state, active_seconds: Math.round(seconds * 10) / 10 },
      revision === null ? {} : { "If-Match": `"${revision}"` })),
  /** @param {number} id @param {string | null} run whose regions are rejected @param {boolean} skipped
   * @returns {Promise<PairDetail>} */
  skip: (id, run, skipped) => call(`/api/pairs/${id}/skip`, send("PUT", { run, skipped })),
  /** @param {number} id @param {number} tile that was swept @returns {Promise<SweepInfo>} */
  sweep: (id, tile) => call(`/api/pairs/${id}/sweep`, send("PUT", { tile })),
  /** @returns {Promise<Me>} */
  me: () => call("/api/me"),
  /** @param {number} id @returns {Promise<RevisionInfo[]>} */
  revisions: (id) => call(`/api/pairs/${id}/revisions`),
  /** @param {number} id @param {number} number @returns {Promise<MaskReply>} */
  revision: (id, number) => call(`/api/pairs/${id}/revisions/${number}`),
  /** @param {number} id @param {ClickChange} prompt @param {AbortSignal} signal
   * @returns {Promise<ClickReply>} */
  click: (id, prompt, signal) => call(`/api/pairs/${id}/click`, { ...send("POST", prompt), signal }),
  /** @param {number} id @param {string | null} run @param {{x: number, y: number}} at
   * @returns {Promise<LivePoint>} */
  livePoint: (id, run, at) => {
    const query = new URLSearchParams({ x: String(at.x), y: String(at.y), ...(run ? { run } : {}) });
    return call(`/api/pairs/${id}/live-point?${query}`);
  },
  /** @param {{id: number, run: string | null, width: number, height: number}} pair
   * @param {{x: number, y: number}} from @param {{x: number, y: number}} to
   * @returns {Promise<EdgePath>} */
  edgePath: (pair, from, to) => {
    const inside = (/** @type {number} */ v, /** @type {number} */ n) => String(Math.min(Math.max(Math.floor(v), 0), n - 1));
    const query = new URLSearchParams({ x0: inside(from.x, pair.width), y0: inside(from.y, pair.height),
      x1: inside(to.x, pair.width), y1: inside(to.y, pair.height) });
    if (pair.run) query.set("run", pair.run);
    return call(`/api/pairs/${pair.id}/edge-path?${query}`);
  },
  /** @param {string | null} run @param {string} order @param {string} opinion
   * @returns {Promise<DoubtfulRegionInfo[]>} */
  auditQueue: (run, order, opinion) => {
    const query = new URLSearchParams({ limit: "1000", order, opinion, ...(run ? { run } : {}) });
    // The first time, what flipping gains is counted from the masks.
    return call(`/api/audit-queue?${query}`, { signal: AbortSignal.timeout(6 * PATIENCE_MS) });
  },
  /** @returns {Promise<Reasons>} */
  reasons: () => call("/api/reasons"),
  /** @param {string[]} reasons @returns {Promise<Reasons>} */
  putReasons: (reasons) => call("/api/reasons", send("PUT", { reasons })),
  /** @param {number} id @param {string | null} run @param {string[]} sources
   * @returns {Promise<ProposalInfo[]>} */
  proposals: (id, run, sources) => {
    const query = new URLSearchParams(sources.map((source) => ["source", source]));
    if (run) query.set("run", run);
    return call(`/api/pairs/${id}/proposals?${query}`);
  },
  /** @param {number} id @param {string | null} run @param {number} number @param {string} label
   * @returns {Promise<PairDetail>} */
  label: (id, run, number, label) => call(`/api/pairs/${id}/labels/${number}`, send("PUT", { run, label })),
  /** @param {number} region @param {VerdictChange["verdict"]} verdict @param {{reason: string, comment: string}} why
   * @returns {Promise<JudgedPair>} */
  audit: (region, verdict, why) => call(`/api/regions/${region}/audit`, send("POST", { verdict, ...why })),
  /** @param {number} audit @param {boolean} stands false takes the verdict back
   * @returns {Promise<JudgedPair>} */
  standing: (audit, stands) => call(`/api/audits/${audit}`, send("PUT", { stands })),
  /** @param {{id: number, run: string | null, version: string}} pair @param {string} layer
   * @param {boolean} [judged] with people's verdicts @param {number} [level] halves the size, each */
  layerUrl: (pair, layer, judged = true, level = 0) => {
    const query = new URLSearchParams({ v: pair.version });
    if (pair.run) query.set("run", pair.run);
    if (!judged && ["doi", "prediction"].includes(layer)) query.set("judged", "false");
    if (level) query.set("level", String(level));
    return `/api/pairs/${pair.id}/layers/${layer}.png?${query}`;
  },
};

/** The desk's socket: joins again by itself, and says where the desk should go on.
 * @param {() => Record<string, string>} joining what the address says
 * @param {{message: (message: ToFrame) => void, here: () => void, away: () => void}} on */
export function openDesk(joining, on) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  let wait = 500;
  let timer = 0;
  /** @type {WebSocket} */
  let socket;
  const connect = () => {
    socket = new WebSocket(`${scheme}://${location.host}/api/desk?${new URLSearchParams(joining())}`);
    socket.onopen = () => on.here();
    socket.onmessage = (event) => {
      wait = 500;
      on.message(JSON.parse(event.data));
    };
    socket.onclose = () => {
      on.away();
      timer = window.setTimeout(connect, wait);
      wait = Math.min(wait * 2, 8000);
    };
  };
  connect();
  return {
    /** @param {FromFrame} message @returns {boolean} whether it could be sent */
    send(message) {
      const open = socket.readyState === WebSocket.OPEN;
      if (open) socket.send(JSON.stringify(message));
      return open;
    },
    /** Join another desk, now. */
    again() {
      clearTimeout(timer);
      socket.onmessage = socket.onclose = socket.onopen = null;
      socket.close();
      connect();
    },
  };
}
