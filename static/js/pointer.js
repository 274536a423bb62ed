/**
 * Pointer events on the panes -> strokes and clicks, panning, zooming, the linked cursor.
 * Uses coalesced events, so a fast stroke has all its samples. Two fingers pan and zoom. Once a pen
 * was seen, fingers draw no more: a palm on the screen leaves no trace.
 * @typedef {{x: number, y: number}} Point
 */
import { pan, toImage, zoomAt } from "./geometry.js";

/**
 * @param {HTMLElement} root the panes' element
 * @param {import("./state.js").State} state
 * @param {{size: () => {width: number, height: number}, pane: (canvas: HTMLElement) => number,
 *   begin: (at: Point, keys: {shift: boolean, alt: boolean, right: boolean}, pane: number) => void,
 *   move: (at: Point) => void, hover: (at: Point, pane: number) => void, leave: () => void,
 *   end: () => void, cancel: () => void,
 *   resize: (factor: number) => void, changed: () => void,
 *   look: (view: import("./geometry.js").View) => void}} on
 */
export function listen(root, state, on) {
  /** @type {{id: number, kind: "draw" | "pan", type: string, x: number, y: number} | null} */
  let drag = null;
  /** @type {HTMLElement | null} the canvas that the drag began on */
  let dragged = null;
  /** @type {Map<number, Point>} fingers, in the page */
  const fingers = new Map();
  let penSeen = false;

  const canvasOf = (/** @type {Event} */ event) =>
    /** @type {HTMLElement | null} */ (/** @type {HTMLElement} */ (event.target).closest("canvas"));
  /** @param {{clientX: number, clientY: number}} event @param {HTMLElement} canvas */
  const place = (event, canvas) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  /** @param {{clientX: number, clientY: number}} event @param {HTMLElement} canvas */
  const inImage = (event, canvas) => toImage(state.view, on.size(), place(event, canvas));

  const zoom = (/** @type {Point} */ at, /** @type {number} */ factor) => {
    if (state.pair) on.look(zoomAt(state.view, state.pair, on.size(), at, factor));
  };

  // Keys belong to the workbench while the pointer is over it; a prevented click would not focus it.
  root.addEventListener("pointerenter", () => window.focus());
  root.addEventListener("pointerdown", (event) => {
    window.focus();
    const canvas = canvasOf(event);
    if (!canvas) return;
    // A prevented press leaves the focus where it was, say in a picker that takes letters for itself.
    if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
    if (event.pointerType === "pen") penSeen = true;
    if (event.pointerType === "touch") fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (fingers.size === 2) {
      if (drag?.kind === "draw") on.cancel();
      drag = null;
      canvas.setPointerCapture(event.pointerId);
      return event.preventDefault();
    }
    if (drag) {
      // A pen takes over from the palm that came first.
      if (!(event.pointerType === "pen" && drag.type === "touch")) return;
      if (drag.kind === "draw") on.cancel();
    }
    dragged = canvas;
    canvas.setPointerCapture(event.pointerId);
    const right = event.button === 2 && state.tool === "click";
    const palm = event.pointerType === "touch" && penSeen;
    const panning = palm || event.button === 1 || (event.button === 2 && !right);
    drag = { id: event.pointerId, kind: panning ? "pan" : "draw", type: event.pointerType,
      x: event.clientX, y: event.clientY };
    const keys = { shift: event.shiftKey, alt: event.altKey, right };
    if (!panning) on.begin(inImage(event, canvas), keys, on.pane(canvas));
    event.preventDefault();
  });

  /** Two fingers moved: what was between them stays between them.
   * @param {PointerEvent} event @param {HTMLElement} canvas */
  const pinch = (event, canvas) => {
    const before = [...fingers.values()];
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const after = [...fingers.values()];
    const spread = ([a, b] = before) => Math.max(8, Math.hypot(a.x - b.x, a.y - b.y));
    const middle = ([a, b] = before) => ({ clientX: (a.x + b.x) / 2, clientY: (a.y + b.y) / 2 });
    const [from, to] = [middle(before), middle(after)];
    on.look(pan(state.view, to.clientX - from.clientX, to.clientY - from.clientY));
    zoom(place(to, canvas), spread(after) / spread(before));
    on.changed();
  };

  root.addEventListener("pointermove", (event) => {
    const canvas = canvasOf(event) ?? dragged;
    if (!canvas) return;
    if (fingers.size === 2) return void (fingers.has(event.pointerId) && pinch(event, canvas));
    if (drag && drag.id !== event.pointerId) return;
    if (drag?.kind === "pan") {
      on.look(pan(state.view, event.clientX - drag.x, event.clientY - drag.y));
      drag.x = event.clientX;
      drag.y = event.clientY;
    } else if (drag) {
      const samples = event.getCoalescedEvents?.() ?? [];
      for (const sample of samples.length ? samples : [event]) {
        on.move(inImage(sample, /** @type {HTMLElement} */ (dragged)));
      }
    }
    const at = inImage(event, drag && dragged ? dragged : canvas);
    state.point(at);
    if (!drag) on.hover(at, on.pane(canvas));
    on.changed();
  });

  const stop = (/** @type {PointerEvent} */ event) => {
    fingers.delete(event.pointerId);
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
    state.point(null);
    on.leave();
    on.changed();
  });
  root.addEventListener("wheel", (event) => {
    const canvas = canvasOf(event);
    if (!canvas) return;
    event.preventDefault();
    if (event.ctrlKey) {
      on.resize(event.deltaY < 0 ? 1.15 : 1 / 1.15);
    } else {
      zoom(place(event, canvas), Math.exp(-event.deltaY * 0.0015));
    }
    on.changed();
  }, { passive: false });
  root.addEventListener("auxclick", (event) => event.preventDefault());
  root.addEventListener("contextmenu", (event) => event.preventDefault());
}
