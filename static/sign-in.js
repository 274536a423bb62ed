/**
 * Take the token out of the link's fragment, which no server and no log sees, into the form; the
 * address and the history keep the page without it.
 */
function takeToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (!token) return;
  const field = /** @type {HTMLInputElement} */ (document.querySelector("input[name=token]"));
  field.value = token;
  history.replaceState(null, "", location.pathname + location.search);
}

takeToken();
window.addEventListener("hashchange", takeToken);

// The workbench asks for the panels of this person before it knows who is signed in.
document.querySelector("form")?.addEventListener("submit", () => {
  const field = /** @type {HTMLInputElement} */ (document.querySelector("input[name=name]"));
  localStorage.setItem("reviewer.annotator", field.value.trim());
});
