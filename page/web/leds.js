/** A panel's 64 bits, drawn as lamps. */

/** The page's colours by name, read again when the browser switches between light and dark. @type {Record<string, string>} */
let colours = {};

function readColours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "soft", "line", "card", "accent", "on", "off", "bad", "good", "led-on", "led-off", "bad-back", "warm"];
  colours = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/**
 * Sets a canvas to the screen's resolution and clears it; coordinates are CSS pixels.
 * @param {HTMLCanvasElement} canvas
 * @returns {{context: CanvasRenderingContext2D, width: number, height: number}}
 */
function sharpCanvas(canvas) {
  const dots = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  const [wide, high] = [Math.round(width * dots), Math.round(height * dots)];
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.setTransform(dots, 0, 0, dots, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** The last bits drawn on each canvas. @type {Map<HTMLCanvasElement, [Uint8Array | null, Uint8Array | null]>} */
const drawnLeds = new Map();

/** Redraws all visible lamps after a change of size or colours. */
function redrawLeds() {
  for (const [canvas, [bits, truth]] of drawnLeds) if (canvas.clientWidth > 0) drawLeds(canvas, bits, truth);
}

/**
 * Draws lamps: On filled, Off hollow; wrong ones crossed out on red.
 * @param {HTMLCanvasElement} canvas
 * @param {Uint8Array | null} bits None draws nothing.
 * @param {Uint8Array | null} [truth]
 */
function drawLeds(canvas, bits, truth = null) {
  drawnLeds.set(canvas, [bits, truth]);
  const { context, width } = sharpCanvas(canvas);
  if (!bits) return;
  const cell = width / 8;
  for (let led = 0; led < 64; led += 1) {
    const [x, y] = [(led % 8) * cell, Math.floor(led / 8) * cell];
    const isWrong = truth && truth[led] !== bits[led];
    if (isWrong) {
      context.fillStyle = colours["bad-back"];
      context.fillRect(x + 1, y + 1, cell - 2, cell - 2);
    }
    context.beginPath();
    context.arc(x + cell / 2, y + cell / 2, cell * 0.3, 0, 2 * Math.PI);
    context.lineWidth = Math.max(1, cell * 0.06);
    context.fillStyle = colours["led-on"];
    context.strokeStyle = colours["led-off"];
    if (bits[led]) context.fill();
    context.stroke();
    if (isWrong) drawCross(context, x, y, cell);
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} cell */
function drawCross(context, x, y, cell) {
  const [near, far] = [cell * 0.12, cell * 0.88];
  context.strokeStyle = colours.bad;
  context.lineWidth = Math.max(1.5, cell * 0.11);
  context.beginPath();
  context.moveTo(x + near, y + near);
  context.lineTo(x + far, y + far);
  context.moveTo(x + far, y + near);
  context.lineTo(x + near, y + far);
  context.stroke();
}

/** @param {Uint8Array} bits One word per row from the top, for screen readers. */
function spellLeds(bits) {
  return Array.from({ length: 8 }, (_, row) => [...bits.subarray(8 * row, 8 * row + 8)].join("")).join(" ");
}
