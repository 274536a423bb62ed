/**
 * Marks over the pictures: the selected proposal's box, clicks, outlines, and where the cursor is.
 * Lines keep their width on the screen whatever the zoom is.
 */

/** The selected proposal's box, clicks, outlines, and the brush where the cursor is, on every pane.
 * @param {CanvasRenderingContext2D} context @param {import("./state.js").State} state
 * @param {number} scale */
export function drawMarks(context, state, scale) {
  const box = state.blind ? null : state.proposal?.box_xyxy;
  if (box && box[2] > box[0] && !state.hidden) {
    context.lineWidth = 1.5 / scale;
    context.strokeStyle = "#2bb3bf";
    const margin = 3 / scale;
    context.strokeRect(box[0] - margin, box[1] - margin,
      box[2] - box[0] + 2 * margin, box[3] - box[1] + 2 * margin);
  }
  if (state.tile && !state.hidden) drawTile(context, state.tile, scale);
  if (state.candidate) drawClicks(context, state.candidate, scale);
  if (state.sketch.length > 1) {
    context.beginPath();
    for (const { x, y } of state.sketch) context.lineTo(x, y);
    if (!["polygon", "magnetic"].includes(state.tool)) context.closePath();
    strokeTwice(context, scale);
    context.beginPath();
    const [first] = state.sketch;
    context.arc(first.x, first.y, 4 / scale, 0, 2 * Math.PI);
    strokeTwice(context, scale);
  }
  if (!state.cursor) return;
  if (!["brush", "eraser"].includes(state.tool)) return drawCross(context, state.cursor, scale);
  context.beginPath();
  context.arc(state.cursor.x, state.cursor.y, Math.max(state.radius, 0.5), 0, 2 * Math.PI);
  strokeTwice(context, scale);
}

/** The corners of the tile that is swept. @param {CanvasRenderingContext2D} context
 * @param {number[]} tile @param {number} scale */
function drawTile(context, [x0, y0, x1, y1], scale) {
  const arm = 14 / scale;
  context.beginPath();
  for (const [x, dx] of [[x0, arm], [x1, -arm]]) {
    for (const [y, dy] of [[y0, arm], [y1, -arm]]) {
      context.moveTo(x + dx, y);
      context.lineTo(x, y);
      context.lineTo(x, y + dy);
    }
  }
  strokeTwice(context, scale);
}

/** A plus for a positive click, a minus for a negative one, and the box.
 * @param {CanvasRenderingContext2D} context @param {import("./state.js").Candidate} candidate
 * @param {number} scale */
function drawClicks(context, { points, box }, scale) {
  if (box) {
    context.beginPath();
    context.rect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
    strokeTwice(context, scale);
  }
  const arm = 5 / scale;
  for (const { x, y, positive } of points) {
    context.beginPath();
    context.arc(x, y, 1.7 * arm, 0, 2 * Math.PI);
    context.fillStyle = positive ? "rgba(0, 90, 160, .75)" : "rgba(170, 60, 0, .8)";
    context.fill();
    context.beginPath();
    context.moveTo(x - arm, y);
    context.lineTo(x + arm, y);
    if (positive) {
      context.moveTo(x, y - arm);
      context.lineTo(x, y + arm);
    }
    strokeTwice(context, scale);
  }
}

/** The linked cursor: a small open cross.
 * @param {CanvasRenderingContext2D} context @param {{x: number, y: number}} at @param {number} scale */
function drawCross(context, { x, y }, scale) {
  context.beginPath();
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(x + (3 * dx) / scale, y + (3 * dy) / scale);
    context.lineTo(x + (9 * dx) / scale, y + (9 * dy) / scale);
  }
  strokeTwice(context, scale);
}

/** Dark under light, so that a line shows on every picture.
 * @param {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} context @param {number} scale
 * @param {{path: Path2D, colour: string}} [line] in place of the context's path, in white */
export function strokeTwice(context, scale, line) {
  for (const [width, colour] of [[3, "rgba(0,0,0,.55)"], [1.3, line?.colour ?? "#fff"]]) {
    context.lineWidth = Number(width) / scale;
    context.strokeStyle = String(colour);
    if (line) context.stroke(line.path);
    else context.stroke();
  }
}
