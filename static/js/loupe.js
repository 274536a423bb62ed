/**
 * The loupe: the place under the cursor six times as large, on the reference and on the live image.
 * @typedef {import("./state.js").State} State
 */
const TIMES = 6;
const SIZE_PX = 216;

/** Draw it, or hide it. @param {HTMLElement} root @param {State} state
 * @param {(layer: "warped" | "reference" | "live") => ImageBitmap | null} picture
 * @param {CanvasImageSource} rim of the mask */
export function showLoupe(root, state, picture, rim) {
  const { cursor, magnifying, pair } = state;
  root.hidden = !(magnifying && cursor && pair);
  if (!cursor || !pair || root.hidden) return;
  // It keeps out of the way of what it shows.
  const below = cursor.y < pair.height / 2;
  root.style.top = below ? "" : "10px";
  root.style.bottom = below ? "calc(var(--strip) + 10px)" : "";
  const ratio = window.devicePixelRatio || 1;
  const side = Math.round(SIZE_PX * ratio);
  const scale = TIMES * ratio;
  for (const [place, canvas] of root.querySelectorAll("canvas").entries()) {
    canvas.width = side;
    canvas.height = side;
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    context.imageSmoothingEnabled = false;
    context.setTransform(scale, 0, 0, scale, side / 2 - scale * cursor.x, side / 2 - scale * cursor.y);
    const bitmap = picture(place ? "live" : state.past);
    if (bitmap) context.drawImage(bitmap, 0, 0, pair.width, pair.height);
    if (!state.hidden) context.drawImage(rim, 0, 0);
    context.setTransform(1, 0, 0, 1, side / 2, side / 2);
    context.strokeStyle = "#fff";
    context.strokeRect(-scale / 2, -scale / 2, scale, scale);
  }
}
