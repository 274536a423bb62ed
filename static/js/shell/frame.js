/**
 * The workbench's frame in Viser's page. Viser draws only a place for it, and the frame lies over
 * that place, docked over the whole panel, its tabs too: what they show is in the workbench's menu.
 * It is not loaded again, dimmed or frozen when Viser builds its panels anew, because the connection
 * broke, the server was started again, or a panel was docked elsewhere.
 */

const STILL_MS = 300;
const PATIENCE_MS = 3000;
/** Where the panel of the workbench is docked. */
export const RIGHT = "[data-dock-region=right]";
/** Panels that are folded have no contents, and so no place. */
export const FOLDED = "[data-dock-collapsed], [data-dock-rail-root]";

export class WorkbenchFrame {
  constructor() {
    this.element = document.createElement("iframe");
    this.element.className = "workbench-frame";
    this.element.title = "Workbench";
    this.element.style.visibility = "hidden";
    /** @type {HTMLElement | null} */
    this.place = null;
    /** Whether the frame follows its place; a new place is moved about until its panel has its width. */
    this.follows = false;
    /** When the place came or went, and when it moved last. */
    this.since = 0;
    this.moved = 0;
    this.outline = "";
    /** Whether something is pressed in Viser's page. */
    this.pressed = false;
  }

  get shown() {
    return this.element.style.visibility !== "hidden";
  }

  /** Stay over the place from now on. */
  start() {
    // What is dragged in Viser's page goes on over the frame.
    window.addEventListener("pointerdown", () => this.letThrough(true), true);
    for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, () => this.letThrough(false), true);
    // A context menu swallows the end of the press that opened it.
    window.addEventListener("pointermove", ({ buttons }) => { if (!buttons) this.letThrough(false); }, true);
    const step = (/** @type {number} */ now) => {
      this.step(now);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  /** @param {number} now */
  step(now) {
    if (!this.place?.isConnected) this.look(now);
    if (!this.place) {
      if (document.querySelector(FOLDED) || now - this.since > PATIENCE_MS) this.hide();
      return;
    }
    const own = this.place.getBoundingClientRect();
    const region = this.place.closest(RIGHT);
    const alone = region?.querySelectorAll("[data-dock-group]").length === 1;
    // Another tab of the panel leaves the place without a size.
    const box = region && alone && own.width ? region.getBoundingClientRect() : own;
    const layer = layerOf(this.place);
    const outline = [box.x, box.y, box.width, box.height, layer].join();
    if (outline !== this.outline) this.moved = now;
    else if (this.follows) return;
    this.outline = outline;
    this.follows ||= !this.shown || now - this.since > PATIENCE_MS
      || (this.joined && now - this.moved > STILL_MS);
    if (!box.width || !box.height) return this.hide();
    if (this.follows) this.lay(box, layer);
  }

  /** Look for a place where there is none any more. @param {number} now */
  look(now) {
    const found = /** @type {HTMLElement | null} */ (document.querySelector(".workbench-place"));
    if (found === this.place) return;
    this.place = found;
    this.since = now;
    this.outline = "";
    this.follows = false;
    const client = found?.dataset.client;
    if (!client || client === this.element.dataset.client) return;
    this.element.dataset.client = client;
    if (this.element.isConnected) this.element.contentWindow?.dispatchEvent(new Event("client"));
    else this.load();
  }

  /** Whether the workbench has joined the desk of the Viser client that is around it now. */
  get joined() {
    return this.element.dataset.joined === this.element.dataset.client;
  }

  load() {
    this.element.src = "/workbench";
    document.body.append(this.element);
  }

  /** @param {boolean} pressed something is pressed in Viser's page */
  letThrough(pressed) {
    this.pressed = pressed;
    this.element.style.pointerEvents = pressed ? "none" : "";
  }

  hide() {
    if (!this.shown) return;
    this.element.style.visibility = "hidden";
    // Nobody means a workbench that is not seen.
    this.element.blur();
  }

  /** @param {DOMRect} box @param {string} layer */
  lay(box, layer) {
    const { style } = this.element;
    style.left = `${box.x}px`;
    style.top = `${box.y}px`;
    style.width = `${box.width}px`;
    style.height = `${box.height}px`;
    style.zIndex = layer;
    style.visibility = "visible";
  }
}

/** How far in front the panel of a place is. @param {HTMLElement} place */
function layerOf(place) {
  const root = place.closest("[data-dock-root]");
  /** @type {HTMLElement | null} */
  let panel = place;
  while (panel && panel.parentElement !== root) panel = panel.parentElement;
  return panel ? getComputedStyle(panel).zIndex : "auto";
}
