/**
 * The fields of the page: what a person sets in them becomes state, or an action. What a button does
 * is in `actions.js`.
 */
import { CLEANUPS } from "./actions.js";
import { $, attempt, notice } from "./chrome.js";
import { fillHelp, titleButtons } from "./controls.js";
import { KEYS } from "./keys.js";
import { COUNTS, shareOut } from "./panes.js";

/** @param {{state: import("./state.js").State, side: import("./side.js").Side,
 *   modes: import("./modes.js").Modes, keymap: import("./keys.js").Keymap,
 *   panes: import("./panes.js").Panes, looking: import("./looking.js").Looking,
 *   link: import("./desk_link.js").DeskLink, act: (action: string) => void}} parts */
export function wireFields({ state, side, modes, keymap, panes, looking, link, act }) {
  /** The field gives the keys back, and its value is used. @param {"cleanup" | "mode" | "walkOrder" |
   * "walkOpinion" | "source" | "run"} id @param {(value: string) => void} use */
  const choose = (id, use) => {
    $(id).onchange = () => {
      const { value } = $(id);
      $(id).blur();
      use(value);
    };
  };
  for (const name of /** @type {const} */ (["radius", "tolerance", "opacity", "brightness", "contrast"])) {
    $(name).oninput = () => state.change({ [name]: Number($(name).value) });
  }
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
  $("pane-count").onchange = () => {
    const shared = shareOut(Number($("pane-count").value), state.layers, state.spare);
    panes.build(shared.layers);
    state.change(shared);
    looking.fitAll();
  };
  choose("run", (run) => {
    if (link.socket.send({ type: "run", run })) return;
    $("run").value = state.run ?? "";
    notice("The server cannot be reached just now.", true);
  });
  $("reset-keys").onclick = () => changeKeys(state, keymap, {});
  $("close-help").onclick = () => $("help").close();
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
  $("pane-count").value = String(state.layers.length);
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
