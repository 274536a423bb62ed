/**
 * How Viser's page is shared out: the drawer on the left, which the workbench may shut; the rest for
 * the workbench; and the map, which Viser draws, over the tab "Map", or small at the drawer's foot.
 * Styles read what is written here (reviewer/app/door/proxy.py). Viser's own places stay as they are.
 */
import { RIGHT } from "./frame.js";
import { isOpen, turnTo } from "./tabs.js";

const LEFT = "[data-dock-region=left]";
const INSET = { width: 200, height: 150, margin: 10 };
/** A drawer narrower than this is folded. */
const NARROW = 120;

export class Arrangement {
  /** @param {HTMLIFrameElement} frame of the workbench, which says what it wants by its data */
  constructor(frame) {
    this.frame = frame;
    /** Whether the tab "Plan" was open, and has turned the page to the map. */
    this.planning = false;
    this.written = "";
    this.grow = document.createElement("button");
    this.grow.className = "map-grow";
    this.grow.hidden = true;
    this.grow.title = "Show the map large";
    this.grow.setAttribute("aria-label", "Show the map large");
    const sign = document.createElement("span");
    sign.textContent = "⤢";
    this.grow.append(sign);
    this.grow.onclick = () => turnTo("Map");
  }

  /** Share the page out from now on. */
  start() {
    document.body.append(this.grow);
    // The workbench's menu opens the other tabs.
    window.addEventListener("turn", (event) => turnTo(/** @type {CustomEvent} */ (event).detail));
    const step = () => {
      this.step();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  step() {
    const { drawer = "open", map = "none" } = this.frame.dataset;
    this.followPlan();
    const left = drawer === "open" ? document.querySelector(LEFT)?.getBoundingClientRect() : undefined;
    const width = left?.width ?? 0;
    const place = document.querySelector(`${RIGHT} .map-place`)?.getBoundingClientRect();
    const large = map !== "none" && place && place.width > 0;
    const inset = map !== "none" && !large && width > NARROW;
    const box = large ? place
      : { x: (width - INSET.width) / 2, y: window.innerHeight - INSET.height - INSET.margin, ...INSET };
    const written = [drawer, width, large, inset, box.x, box.y, box.width, box.height].join();
    if (written === this.written) return;
    this.written = written;
    const { dataset, style } = document.body;
    dataset.drawer = drawer;
    dataset.map = large ? "large" : inset ? "inset" : "none";
    this.grow.hidden = !inset;
    style.setProperty("--drawer", `${width}px`);
    for (const [name, value] of Object.entries({ x: box.x, y: box.y, width: box.width, height: box.height })) {
      style.setProperty(`--map-${name}`, `${Math.round(value)}px`);
    }
  }

  /** A plan is drawn on the map: it is large while "Plan" is open. */
  followPlan() {
    const planning = isOpen("Plan");
    if (planning === this.planning) return;
    this.planning = planning;
    if (planning) turnTo("Map");
    else if (isOpen("Map")) turnTo("Workbench");
  }
}
