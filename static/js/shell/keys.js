/**
 * One key map for the whole page: what is pressed beside the workbench does there what it does in
 * it, and Viser, which turns tabs, folds panels and flies the camera with the same keys, does not get
 * it. Fields that are typed into keep their keys; keys that the workbench has no use for stay Viser's,
 * and so do all while another tab hides the workbench, but for Escape, which brings it back.
 */

const TYPED_INTO = 'textarea, select, [contenteditable=""], [contenteditable="true"],'
  + ' input:not([type="range"], [type="checkbox"], [type="radio"], [type="button"])';
/** After a click its page may still turn a tab. */
const TURNED_MS = 100;
/** What opens over the page has the keys for itself. */
const OVER = '[role="dialog"], [role="listbox"]';

/** @param {Element | null} element */
const isTypedInto = (element) => Boolean(element?.matches(TYPED_INTO) || element?.closest(OVER));

/** @param {import("./frame.js").WorkbenchFrame} workbench @param {() => void} back to the workbench */
export function shareKeys(workbench, back) {
  const frame = workbench.element;
  /** @param {KeyboardEvent} event */
  const pass = (event) => {
    const target = event.target instanceof Element ? event.target : null;
    // Escape ends a drag in Viser's page.
    if (isTypedInto(target) || workbench.pressed || !frame.contentWindow || !frame.contentDocument) return;
    if (!workbench.shown) {
      if (event.type === "keydown" && event.key === "Escape") back();
      return;
    }
    // The frame answers a key that it takes by preventing what else it would do.
    if (frame.contentDocument.documentElement.dispatchEvent(copyOf(event, frame.contentWindow))) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    frame.contentWindow.focus();
  };
  window.addEventListener("keydown", pass, true);
  window.addEventListener("keyup", pass, true);

  window.addEventListener("pointerup", ({ target }) => {
    const chosen = target instanceof Element && target.closest('[role="option"]');
    setTimeout(() => {
      const wanted = !chosen && isTypedInto(document.activeElement);
      // Text that is selected is about to be copied.
      const selected = !window.getSelection()?.isCollapsed;
      if (workbench.shown && !wanted && !selected) frame.contentWindow?.focus();
    }, TURNED_MS);
  }, true);
}

/** @param {KeyboardEvent} event @param {any} page the frame's window */
function copyOf(event, page) {
  const { key, code, ctrlKey, shiftKey, altKey, metaKey, repeat } = event;
  return new page.KeyboardEvent(event.type,
    { key, code, ctrlKey, shiftKey, altKey, metaKey, repeat, bubbles: true, cancelable: true });
}
