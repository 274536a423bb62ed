/**
 * The revisions of a pair, newest first: who, when, with which tools; look at one, restore it.
 * @typedef {import("../wire.js").RevisionInfo} Revision
 */

/** @param {HTMLElement} root @param {Revision[]} revisions oldest first @param {number | null} shown
 * @param {{show: (number: number | null) => void, restore: (number: number) => void}} on */
export function drawHistory(root, revisions, shown, on) {
  const rows = revisions.map((revision, k) => {
    const item = document.createElement("li");
    item.className = "revision";
    item.tabIndex = 0;
    item.dataset.revision = String(revision.number);
    item.setAttribute("aria-selected", String(revision.number === shown));
    const change = revision.area - (revisions[k - 1]?.area ?? 0);
    const sign = change > 0 ? "+" : change < 0 ? "−" : "±";
    item.append(
      line("top", [["doi", `r${revision.number}`], ["soft", revision.annotator ?? revision.source],
        ["choice", `${sign}${Math.abs(change)} px`]]),
      line("terms", [["", summary(revision.tools) || revision.source],
        ["when", new Date(revision.created_at).toLocaleString([], { dateStyle: "short", timeStyle: "short" })]]),
    );
    const toggle = () => on.show(revision.number === shown ? null : revision.number);
    item.onclick = toggle;
    item.onkeydown = (event) => {
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault();
        event.stopPropagation();
        toggle();
      }
    };
    if (revision.number === shown && k < revisions.length - 1) {
      const restore = document.createElement("button");
      restore.textContent = `Restore r${revision.number}`;
      restore.title = "Make this the newest revision; nothing of the history is lost";
      restore.onclick = (event) => {
        event.stopPropagation();
        on.restore(revision.number);
      };
      restore.onkeydown = (event) => event.stopPropagation();
      item.append(restore);
    }
    return item;
  });
  const focused = root.contains(document.activeElement) && shown;
  root.replaceChildren(...rows.reverse());
  if (focused) /** @type {HTMLElement | null} */ (root.querySelector(`[data-revision="${shown}"]`))?.focus();
}

/** Name each tool once, with how often it was used. @param {string[]} tools */
function summary(tools) {
  const counts = new Map();
  for (const tool of tools) counts.set(tool, (counts.get(tool) ?? 0) + 1);
  return [...counts].map(([tool, count]) => (count > 1 ? `${tool} ×${count}` : tool)).join(", ");
}

/** @param {string} name @param {string[][]} parts class and text */
function line(name, parts) {
  const made = document.createElement("div");
  made.className = name;
  for (const [kind, text] of parts) {
    const span = document.createElement("span");
    if (kind) span.className = kind;
    span.textContent = text;
    made.append(span);
  }
  return made;
}
