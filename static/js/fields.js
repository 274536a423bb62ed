/**
 * The fields of the page: what a person sets in them becomes state, or an action. What a button does
 * is in `actions.js`.
 */
import { CLEANUPS } from "./actions.js";
import { $, attempt, notice } from "./chrome.js";
import { fillHelp, titleButtons } from "./controls.js";
import { KEYS } from "./keys.js";
import { PRESETS } from "./presets.js";
import { COUNTS, shareOut } from "./panes.js";

/** @param {{state: import("./state.js").State, side: import("./side.js").Side,
 *   modes: import("./modes.js").Modes, keymap: import("./keys.js").Keymap,
 *   panes: import("./panes.js").Panes, looking: import("./looking.js").Looking,
 *   link: import("./desk_link.js").DeskLink, act: (action: string) => void}} parts */
export function wireFields({ state, side, modes, keymap, panes, looking, link, act }) {
  /** The field gives the keys back, and its value is used. @param {"cleanup" | "mode" | "walkOrder" |
   * "walkOpinion" | "source" | "preset" | "run"} id @param {(value: string) => void} use */
  const choose = (id, use) => {
    $(id).onchange = () => {
      const { value } = $(id);
      $(id).blur();
      use(value);
    };
  };
  /** @param {{layers: string[], spare: string[]}} shared */
  const setLayers = (shared) => {
    panes.build(shared.layers);
    state.change(shared);
    looking.fitAll();
  };
  for (const name of /** @type {const} */ (["radius", "tolerance", "opacity", "brightness", "contrast", "blinkMs"])) {
    $(name).oninput = () => state.change({ [name]: Number($(name).value) });
  }
  for (const name of /** @type {const} */ (["advance", "tabOn", "openAtProposal"])) {
    $(name).onchange = () => state.change({ [name]: $(name).checked });
  }
  choose("preset", (name) => {
    if (!name) return;
    const { layers, mode } = PRESETS[name];
    setLayers({ layers: [...layers], spare: [] });
    attempt(modes.change(mode));
  });
  choose("cleanup", (name) => {
    $("cleanup").value = "";
    act(name);
  });
  choose("mode", (mode) => attempt(modes.change(mode)));
  for (const name of /** @type {const} */ (["walkOrder", "walkOpinion"])) {
    choose(name, (value) => {
      state.change({ [name]: value });
      attempt(modes.change("audit"));
    });
  }
  choose("source", (source) => {
    state.change({ source });
    attempt(side.load());
  });
  for (const tab of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-side]"))) {
    tab.onclick = () => {
      tab.blur();
      state.change({ side: tab.dataset.side ?? "proposals" });
      attempt(side.load());
    };
  }
  $("pane-count").onchange = () => setLayers(shareOut(Number($("pane-count").value), state.layers, state.spare));
  $("help-search").oninput = () => fillHelp($("help-keys"), keymap, () => changeKeys(state, keymap, keymap.changes));
  choose("run", (run) => {
    if (link.socket.send({ type: "run", run })) return;
    $("run").value = state.run ?? "";
    notice("The server cannot be reached just now.", true);
  });
  $("reset-keys").onclick = () => changeKeys(state, keymap, {});
  $("close-help").onclick = () => $("help").close();
  for (const menu of document.querySelectorAll("details.menu")) {
    menu.addEventListener("click", ({ target }) => {
      if (target instanceof HTMLButtonElement) menu.removeAttribute("open");
    });
  }
  for (const type of ["pointerdown", "keydown"]) {
    document.addEventListener(type, (event) => {
      for (const menu of document.querySelectorAll("details[open]")) {
        if (!menu.contains(/** @type {Node} */ (event.target))) menu.removeAttribute("open");
      }
    });
  }
}

/** What the page offers depends on the settings that came back.
 * @param {import("./state.js").State} state @param {import("./keys.js").Keymap} keymap
 * @param {import("./panes.js").Panes} panes */
export function fillFields(state, keymap, panes) {
  panes.build(state.layers);
  $("pane-count").replaceChildren(...COUNTS.map((n) => new Option(String(n), String(n))));
  $("preset").replaceChildren(new Option("Own panes", ""), ...Object.entries(PRESETS).map(([name, { title }]) => new Option(title, name)));
  changeKeys(state, keymap, state.keys);
}

/** @param {import("./state.js").State} state @param {import("./keys.js").Keymap} keymap
 * @param {Record<string, string>} changes */
function changeKeys(state, keymap, changes) {
  keymap.changes = changes;
  titleButtons(keymap);
  fillHelp($("help-keys"), keymap, () => changeKeys(state, keymap, keymap.changes));
  $("cleanup").replaceChildren(new Option("Clean up…", ""), ...Object.keys(CLEANUPS).map((name) => {
    const entry = KEYS.find((candidate) => candidate.action === name);
    return new Option(`${entry?.title}  (${keymap.shown(name)})`, name);
  }));
  state.change({ keys: keymap.changes });
}
