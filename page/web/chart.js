/** Charts on a canvas: axes with ticks and units, curves with their intervals, marks. */

/**
 * @typedef {{low: number, high: number, log?: boolean, label: string}} Axis
 * @typedef {{left: number, right: number, top: number, bottom: number}} Box
 * @typedef {{x: number, y: number, low?: number | null, high?: number | null}} Point
 * @typedef {{x: number, label: string, colour: string, dash: number[]}} Mark
 */

const CHART_FONT = "13px system-ui, sans-serif";

/** @param {Axis} axis @param {number} value @returns {number} Its place on the axis, 0 to 1. */
function along({ low, high, log }, value) {
  return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
}

/** @param {Axis} axis @param {number} most The maximum number of ticks. @returns {number[]} */
function ticksOf({ low, high, log }, most) {
  return log ? logTicks(low, high, most) : linearTicks(low, high, most);
}

/** @param {number} low @param {number} high @param {number} most */
function linearTicks(low, high, most) {
  const rough = (high - low) / Math.max(1, most);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough) ?? rough;
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  return Array.from({ length: count }, (_, tick) => Number(((first + tick) * step).toPrecision(12)));
}

/** @param {number} low @param {number} high @param {number} most */
function logTicks(low, high, most) {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const decades = Math.log10(high / low);
  const factors = decades * 3 <= most ? [1, 2, 5] : [1];
  const skip = Math.max(1, Math.ceil(decades / most));
  const powers = Array.from({ length: last - first + 1 }, (_, at) => first + at).filter((power) => power % skip === 0);
  const ticks = powers.flatMap((power) => factors.map((factor) => Number(`${factor}e${power}`)));
  return ticks.filter((tick) => tick >= low * 0.999 && tick <= high * 1.001);
}

/**
 * Draws axes, and returns functions that map values to places.
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box
 * @param {Axis} x
 * @param {Axis} y
 * @param {number} [top] The place of the vertical axis's name.
 */
function drawAxes(context, box, x, y, top = box.top - 6) {
  const placeX = (/** @type {number} */ value) => box.left + along(x, value) * (box.right - box.left);
  const placeY = (/** @type {number} */ value) => box.bottom - along(y, value) * (box.bottom - box.top);
  context.font = CHART_FONT;
  context.lineWidth = 1;
  context.strokeStyle = colours.line;
  context.fillStyle = colours.soft;
  context.textBaseline = "top";
  context.textAlign = "center";
  for (const tick of ticksOf(x, (box.right - box.left) / 48)) {
    line(context, placeX(tick), box.top, placeX(tick), box.bottom);
    context.fillText(short(tick), placeX(tick), box.bottom + 5);
  }
  context.textBaseline = "middle";
  context.textAlign = "right";
  for (const tick of ticksOf(y, (box.bottom - box.top) / 36)) {
    line(context, box.left, placeY(tick), box.right, placeY(tick));
    context.fillText(short(tick), box.left - 6, placeY(tick));
  }
  context.fillStyle = colours.ink;
  context.textBaseline = "bottom";
  context.textAlign = "right";
  context.fillText(x.label, box.right, box.bottom + 38);
  context.textAlign = "left";
  context.fillText(y.label, 2, top);
  return { placeX, placeY };
}

/** @param {CanvasRenderingContext2D} context @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

/**
 * Draws a curve with the intervals of its points, and marks across it.
 * @param {HTMLCanvasElement} canvas
 * @param {{x: Axis, y: Axis, points: Point[], marks: Mark[]}} chart
 */
function drawChart(canvas, { x, y, points, marks }) {
  const { context, width, height } = sharpCanvas(canvas);
  if (width === 0) return;
  const box = { left: 62, right: width - 14, top: 30 + 17 * marks.length, bottom: height - 44 };
  const { placeX, placeY } = drawAxes(context, box, x, y);
  const inside = (/** @type {number} */ value) => Math.min(box.bottom, Math.max(box.top, placeY(value)));
  context.strokeStyle = context.fillStyle = colours.accent;
  context.lineWidth = 1.5;
  for (const point of points) {
    if (point.high === undefined || point.high === null || point.low === null || point.low === point.high) continue;
    // Values that a logarithmic axis cannot show, such as an error rate of 0, are drawn at its edge.
    line(context, placeX(point.x), y.log && !(point.low > 0) ? box.bottom : inside(point.low), placeX(point.x), inside(point.high));
  }
  const drawn = points.filter((point) => !y.log || point.y > 0);
  context.lineWidth = 2;
  context.beginPath();
  drawn.forEach((point) => context.lineTo(placeX(point.x), inside(point.y)));
  context.stroke();
  for (const point of drawn) {
    context.beginPath();
    context.arc(placeX(point.x), inside(point.y), 3, 0, 2 * Math.PI);
    context.fill();
  }
  const places = marks.map((mark, row) => ({ ...mark, at: Math.min(box.right, Math.max(box.left, placeX(mark.x))), top: 30 + 17 * row }));
  // All lines before all labels, so that labels stay readable.
  for (const { at, top, colour, dash } of places) {
    context.strokeStyle = colour;
    context.setLineDash(dash);
    line(context, at, top, at, box.bottom);
  }
  context.setLineDash([]);
  for (const { at, top, colour, label } of places) drawWords(context, label, colour, at, top, at > (box.left + box.right) / 2);
}

/**
 * Draws a label beside a line, on a background of the card's colour, because other lines may cross it.
 * @param {CanvasRenderingContext2D} context
 * @param {string} words
 * @param {string} colour
 * @param {number} at
 * @param {number} top
 * @param {boolean} isLeft Whether the label is to the left of the line.
 */
function drawWords(context, words, colour, at, top, isLeft) {
  const x = at + (isLeft ? -6 : 6);
  context.textAlign = isLeft ? "right" : "left";
  context.textBaseline = "middle";
  context.strokeStyle = colours.card;
  context.lineWidth = 5;
  context.strokeText(words, x, top + 2);
  context.fillStyle = colour;
  context.fillText(words, x, top + 2);
}

/** @param {number[]} values @param {boolean} log @returns {{low: number, high: number}} The range of an axis for these values. */
function spanOf(values, log) {
  const known = values.filter((value) => Number.isFinite(value) && (!log || value > 0));
  if (known.length === 0) return log ? { low: 1e-4, high: 1 } : { low: 0, high: 1 };
  const [least, most] = [Math.min(...known), Math.max(...known)];
  if (log) return { low: 10 ** Math.floor(Math.log10(least) - 0.01), high: 10 ** Math.ceil(Math.log10(most) + 0.01) };
  const room = (most - least || Math.abs(most) || 1) * 0.06;
  return { low: least - room, high: most + room };
}
