/** AGR and GRI of each LED: a plane with the dividing line of k-means, and histograms of each value at its edges. */

/** Number of frames whose values are kept. */
const KEPT_FRAMES = 40;
const BINS = 40;

const scatter = {
  /** The values of the last frames: AGR, GRI and class of each LED. @type {{agr: Float32Array, gri: Float32Array, on: Uint8Array}[]} */
  frames: [],
  /** The ranges of the axes; they grow with the values and restart with each scene. @type {{x: Axis, y: Axis} | null} */
  axes: null,
};

function clearScatter() {
  scatter.frames = [];
  scatter.axes = null;
}

/** @param {Float32Array} agr @param {Float32Array} gri @param {Uint8Array} on */
function addToScatter(agr, gri, on) {
  scatter.frames.push({ agr, gri, on });
  if (scatter.frames.length > KEPT_FRAMES) scatter.frames.shift();
  const x = widened(scatter.axes?.x, agr, "AGR, over the panel's mean");
  const y = widened(scatter.axes?.y, gri, "GRI, grey levels");
  scatter.axes = { x, y };
}

/** @param {Axis | undefined} axis @param {Float32Array} values @param {string} label @returns {Axis} */
function widened(axis, values, label) {
  let [least, most] = [Infinity, -Infinity];
  for (const value of values) [least, most] = [Math.min(least, value), Math.max(most, value)];
  if (axis && least >= axis.low && most <= axis.high) return axis;
  const { low, high } = spanOf(axis ? [least, most, axis.low, axis.high] : [least, most], false);
  return { low, high, label };
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {[number, number, number]} border nx, ny and d of the dividing line nx·AGR + ny·GRI = d.
 */
function drawScatter(canvas, border) {
  const { context, width, height } = sharpCanvas(canvas);
  const last = scatter.frames.at(-1);
  if (!last || !scatter.axes || width === 0) return;
  const { x, y } = scatter.axes;
  const edge = 44;
  const box = { left: 52, right: width - 10 - edge, top: 24 + edge, bottom: height - 44 };
  const { placeX, placeY } = drawAxes(context, box, x, y, 16);
  drawHistogram(context, box, x, "agr", true, edge);
  drawHistogram(context, box, y, "gri", false, edge);
  context.save();
  context.beginPath();
  context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  context.clip();
  drawBorder(context, border, x, y, placeX, placeY);
  context.restore();
  for (let led = 0; led < 64; led += 1) drawValue(context, placeX(last.agr[led]), placeY(last.gri[led]), last.on[led]);
  drawKey(context, box);
}

/** On is a disc, Off a hollow square, so that they differ in more than colour. */
function drawValue(context, x, y, on) {
  context.lineWidth = 1.5;
  context.fillStyle = colours.on;
  context.strokeStyle = colours.off;
  if (!on) {
    context.strokeRect(x - 3, y - 3, 6, 6);
    return;
  }
  context.beginPath();
  context.arc(x, y, 3.5, 0, 2 * Math.PI);
  context.fill();
}

/** @param {CanvasRenderingContext2D} context @param {Box} box */
function drawKey(context, box) {
  context.font = CHART_FONT;
  context.textBaseline = "middle";
  context.textAlign = "left";
  const top = 9;
  const left = box.right - 100;
  drawValue(context, left, top, 1);
  drawValue(context, left + 55, top, 0);
  context.fillStyle = colours.ink;
  context.fillText("On", left + 8, top);
  context.fillText("Off", left + 63, top);
}

/** Draws the dividing line across the plane. */
function drawBorder(context, [nx, ny, d], x, y, placeX, placeY) {
  const size = Math.hypot(nx * (x.high - x.low), ny * (y.high - y.low));
  if (!(size > 0)) return;
  context.strokeStyle = colours.ink;
  context.lineWidth = 2;
  // Along the axis that the line crosses less steeply, so that no divisor is close to 0.
  if (Math.abs(ny) * (y.high - y.low) > Math.abs(nx) * (x.high - x.low)) {
    const at = (/** @type {number} */ agr) => placeY((d - nx * agr) / ny);
    line(context, placeX(x.low), at(x.low), placeX(x.high), at(x.high));
  } else {
    const at = (/** @type {number} */ gri) => placeX((d - ny * gri) / nx);
    line(context, at(y.low), placeY(y.low), at(y.high), placeY(y.high));
  }
}

/** Draws the histogram of On and Off LEDs above the plane or to the right of it. */
function drawHistogram(context, box, axis, feature, isAbove, edge) {
  const counts = [new Float32Array(BINS), new Float32Array(BINS)];
  for (const frame of scatter.frames) {
    for (let led = 0; led < 64; led += 1) {
      const bin = Math.floor(along(axis, frame[feature][led]) * BINS);
      counts[frame.on[led]][Math.min(BINS - 1, Math.max(0, bin))] += 1;
    }
  }
  const most = Math.max(...counts[0], ...counts[1]);
  const length = (isAbove ? box.right - box.left : box.bottom - box.top) / BINS;
  counts.forEach((bins, on) => {
    context.globalAlpha = 0.65;
    context.fillStyle = on ? colours.on : colours.off;
    bins.forEach((count, bin) => {
      const size = (count / most) * (edge - 6);
      if (isAbove) context.fillRect(box.left + bin * length, box.top - 2 - size, length - 0.5, size);
      else context.fillRect(box.right + 2, box.bottom - (bin + 1) * length, size, length - 0.5);
    });
  });
  context.globalAlpha = 1;
}
