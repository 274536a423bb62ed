/**
 * What a labeller called the change, as fields that can be written over: what is written is searched
 * for at once, in this pair only.
 * @typedef {import("../wire.js").LabelInfo} Label
 */

/** @param {HTMLElement} root @param {Label[]} labels
 * @param {(number: number, label: string) => void} edit */
export function drawLabels(root, labels, edit) {
  // What a person is writing stays as it is until it is sent.
  const written = /** @type {HTMLInputElement | null} */ (root.querySelector("input:focus"));
  const kept = written && written.value !== written.defaultValue ? { number: written.dataset.number, text: written.value } : null;
  const rows = labels.map((label) => row(label.number, label.label, about(label), edit));
  rows.push(row(labels.length, "", "", edit));
  root.replaceChildren(...rows);
  if (!written) return;
  const field = /** @type {HTMLInputElement | null} */ (root.querySelector(`input[data-number="${written.dataset.number}"]`));
  if (field && kept) field.value = kept.text;
  field?.focus();
}

/** @param {number} number @param {string} label @param {string} said
 * @param {(number: number, label: string) => void} edit */
function row(number, label, said, edit) {
  const item = document.createElement("li");
  const field = document.createElement("input");
  field.value = field.defaultValue = label;
  field.maxLength = 80;
  field.dataset.number = String(number);
  field.placeholder = said ? "no name" : "one more name…";
  field.setAttribute("aria-label", said ? `Name ${number + 1} of what changed` : "One more name of what changed");
  field.spellcheck = false;
  field.onkeydown = (event) => {
    event.stopPropagation();
    if (event.key === "Enter") field.blur();
    if (event.key === "Escape") {
      field.value = label;
      field.blur();
    }
  };
  field.onchange = () => { if (field.value.trim() !== label) edit(number, field.value); };
  item.append(field);
  if (said) {
    const line = document.createElement("div");
    line.className = "soft";
    line.textContent = said;
    item.append(line);
  }
  return item;
}

/** @param {Label} label */
function about({ component, raw, note, edited_by: person }) {
  const said = raw ? `“${raw.length > 120 ? `${raw.slice(0, 120)}…` : raw}”` : "";
  const parts = [component === null ? "" : `component ${component + 1}`, said, note, person ? `edited by ${person}` : ""];
  return parts.filter(Boolean).join(" · ") || "given";
}
