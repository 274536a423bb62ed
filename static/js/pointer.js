/**
 * Pointer events on the panes -> brush strokes, panning, zooming, the linked cursor.
 * Uses coalesced events, so a fast stroke has all its samples. Ignores the palm while a pen is down.
 */
import { pan, toImage, zoomAt } from "./geometry.js";

/**
 * @param {HTMLElement} root the panes' element
 * @param {import("./state.js").State} state
 * @param {{size: () => {width: number, height: number}, begin: (at: {x: number, y: number}, keys: {shift: boolean, alt: boolean}) => void,
 *   move: (at: {x: number, y: number}) => void, hover: (at: {x: number, y: number}) => void,
 *   end: () => void, cancel: () => void,
 *   resize: (factor: number) => void, changed: () => void, zoomed: () => void}} on
 */
export function listen(root, state, on) {
  /** @type {{id: number, kind: "draw" | "pan", type: string, x: number, y: number} | null} */
  let drag = null;

  /** @param {PointerEvent | WheelEvent} event */
  const place = (event) => {
    const canvas = /** @type {HTMLElement} */ (event.target).closest("canvas") ?? dragged;
    const box = /** @type {HTMLElement} */ (canvas).getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  /** @type {HTMLElement | null} */
  let dragged = null;

  // Keys belong to the workbench while the pointer is over it; a prevented click would not focus it.
  root.addEventListener("pointerenter", () => window.focus());
  root.addEventListener("pointerdown", (event) => {
    window.focus();
    const canvas = /** @type {HTMLElement} */ (event.target).closest("canvas");
    if (!canvas) return;
    if (drag) {
      // A pen takes over from the palm that came first.
      if (!(event.pointerType === "pen" && drag.type === "touch")) return;
      on.cancel();
    }
    dragged = canvas;
    canvas.setPointerCapture(event.pointerId);
    const panning = event.button === 1 || event.button === 2;
    drag = { id: event.pointerId, kind: panning ? "pan" : "draw", type: event.pointerType,
      x: event.clientX, y: event.clientY };
    const keys = { shift: event.shiftKey, alt: event.altKey };
    if (!panning) on.begin(toImage(state.view, on.size(), place(event)), keys);
    event.preventDefault();
  });

  root.addEventListener("pointermove", (event) => {
    if (drag && drag.id !== event.pointerId) return;
    const canvas = /** @type {HTMLElement} */ (event.target).closest("canvas");
    if (!canvas && !drag) return;
    if (drag?.kind === "pan") {
      on.zoomed();
      state.view = pan(state.view, event.clientX - drag.x, event.clientY - drag.y);
      drag.x = event.clientX;
      drag.y = event.clientY;
    } else if (drag) {
      const samples = event.getCoalescedEvents?.() ?? [];
      for (const sample of samples.length ? samples : [event]) {
        const box = /** @type {HTMLElement} */ (dragged).getBoundingClientRect();
        const at = { x: sample.clientX - box.left, y: sample.clientY - box.top };
        on.move(toImage(state.view, on.size(), at));
      }
    }
    state.cursor = toImage(state.view, on.size(), place(event));
    if (!drag) on.hover(state.cursor);
    on.changed();
  });

  const stop = (/** @type {PointerEvent} */ event) => {
    if (!drag || drag.id !== event.pointerId) return;
    const { kind } = drag;
    drag = null;
    if (kind === "draw") event.type === "pointercancel" ? on.cancel() : on.end();
    on.changed();
  };
  root.addEventListener("pointerup", stop);
  root.addEventListener("pointercancel", stop);
  root.addEventListener("lostpointercapture", stop);
  root.addEventListener("pointerleave", () => {
    state.cursor = null;
    on.changed();
  });
  root.addEventListener("wheel", (event) => {
    const canvas = /** @type {HTMLElement} */ (event.target).closest("canvas");
    if (!canvas) return;
    event.preventDefault();
    if (event.ctrlKey) {
      on.resize(event.deltaY < 0 ? 1.15 : 1 / 1.15);
    } else {
      const factor = Math.exp(-event.deltaY * 0.0015);
      on.zoomed();
      state.view = zoomAt(state.view, on.size(), place(event), factor);
    }
    on.changed();
  }, { passive: false });
  root.addEventListener("auxclick", (event) => event.preventDefault());
  root.addEventListener("contextmenu", (event) => event.preventDefault());
}
