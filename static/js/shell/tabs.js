/**
 * The tabs of Viser's docked panels, found by what is written on them.
 */

/** @param {string} name @returns {HTMLElement | undefined} */
export const tabOf = (name) => /** @type {HTMLElement[]} */ ([...document.querySelectorAll('[role="tab"]')])
  .find((tab) => tab.textContent?.trim() === name);

/** @param {string} name */
export const isOpen = (name) => tabOf(name)?.getAttribute("aria-selected") === "true";

/** Open a tab. Viser's take a press, since they can be dragged. @param {string} name */
export function turnTo(name) {
  const tab = tabOf(name);
  const { x: clientX = 0, y: clientY = 0 } = tab?.getBoundingClientRect() ?? {};
  const press = { bubbles: true, cancelable: true, isPrimary: true, pointerId: 1, clientX, clientY };
  tab?.dispatchEvent(new PointerEvent("pointerdown", { ...press, buttons: 1 }));
  tab?.dispatchEvent(new PointerEvent("pointerup", press));
}
