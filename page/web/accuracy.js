/** Accuracy: one frame drawn by four methods, and a map of each method's difference from the reference. */

const LEVEL_SAYS = {
  fast: "Fast: promises no more than 0.25 grey levels, half of what rounding does. For simulations of many frames.",
  fine: "Fine: promises no more than 0.01 grey levels. For pictures.",
  reference: "Reference: double precision, no tables. The others are measured against it.",
  straightforward: "Straightforward: what one would write first. 8 × 8 samples a pixel, and whole pixels are blurred.",
};

const accuracy = {
  /** @type {Picture | null} */
  picture: null,
  /** @type {Picture | null} */
  difference: null,
  isAsking: false,
  isStale: false,
  /** The end of the scale of differences; 0 if no differences are shown. */
  scale: 0,
};

function makeAccuracy() {
  accuracy.picture = new Picture(byId("accuracy-picture"), "The frame");
  accuracy.difference = new Picture(byId("difference"), "The difference from the reference");
  for (const choice of document.querySelectorAll('input[name="show"]')) {
    choice.addEventListener("change", () => {
      settings.fields.show = /** @type {HTMLInputElement} */ (choice).value;
      settingsChanged();
    });
  }
  scene.listeners.push(() => {
    if (settings.fields.mode === "accuracy") compareWhenRested();
  });
}

const compareWhenRested = whenRested(200, compareLevels);

/** Compares methods with the newest settings; one comparison at a time. */
async function compareLevels() {
  accuracy.isStale = true;
  if (accuracy.isAsking) return;
  accuracy.isAsking = true;
  try {
    while (accuracy.isStale && scene.opened && settings.fields.mode === "accuracy") {
      accuracy.isStale = false;
      await compareOnce();
    }
  } catch (error) {
    sayError(error);
  } finally {
    accuracy.isAsking = false;
  }
}

async function compareOnce() {
  const { show, frame } = settings.fields;
  byId("level-says").textContent = `${LEVEL_SAYS[show]} Drawing and timing …`;
  try {
    const { region } = scene.opened;
    const drawn = await live.ask({ do: "frame", frame: Number(frame) });
    if (drawn.bytes.length === region.width * region.height) accuracy.picture.showGrey(drawn.bytes, region.width, region.height);
    const { answer, bytes } = await live.ask({ do: "compare", frame: Number(frame), show });
    showLevels(answer.rows, show);
    showDifference(bytes, answer.difference, show);
  } finally {
    byId("level-says").textContent = LEVEL_SAYS[show];
  }
}

/** @param {number | null} ms @param {number} quickest @param {string | null} why The reason why it cannot draw the scene. */
function timeWords(ms, quickest, why) {
  if (ms === null) return sentence(why ?? "");
  return ms > 0 ? `${shortTime(ms / 1000)} (${short(ms / quickest, 2)}${NO_BREAK}×)` : "too short for this clock";
}

/** @param {any[]} rows @param {string} show */
function showLevels(rows, show) {
  const quickest = Math.min(...rows.map(({ ms }) => ms).filter((ms) => ms > 0));
  const table = rows.map(({ level, ms, error_max_grey: most, error_rms_grey: typical, why }) => ({
    cells: [
      `${level === show ? "▸ " : ""}${level}`,
      timeWords(ms, quickest, why),
      most ?? "–",
      typical ?? "–",
    ],
  }));
  fillTable(byId("levels"), table);
}

/** The possible ends of the scale of differences, in grey levels. */
const SCALES = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 255];

/**
 * @param {Uint8Array | undefined} bytes Little-endian floats.
 * @param {{width: number, height: number}} size
 * @param {string} show
 */
function showDifference(bytes, { width, height }, show) {
  const says = byId("difference-says");
  if (!bytes || bytes.length !== 4 * width * height) {
    says.textContent = "This way does not draw this scene.";
    byId("difference").hidden = byId("difference-scale").hidden = true;
    accuracy.scale = 0;
    return;
  }
  byId("difference").hidden = byId("difference-scale").hidden = false;
  const values = new Float32Array(bytes.buffer, bytes.byteOffset, width * height);
  const most = values.reduce((largest, value) => Math.max(largest, Math.abs(value)), 0);
  const scale = SCALES.find((end) => end >= most) ?? 255;
  const image = accuracy.difference.resize(width, height);
  values.forEach((value, at) => image.data.set(differenceColour(value / scale), 4 * at));
  accuracy.difference.context.putImageData(image, 0, 0);
  const words = `at most ${short(most, 2)} grey levels`;
  says.textContent = show === "reference" ? "The reference itself: no difference" : `${show} minus reference, before rounding: ${words}`;
  accuracy.difference.describe(`${show}, ${words}`);
  accuracy.scale = scale;
  drawDifferenceScale(scale);
}

/**
 * Blue for negative values, orange for positive ones, neutral for 0.
 * @param {number} part -1 to 1.
 */
function differenceColour(part) {
  const strength = Math.min(1, Math.abs(part)) ** 0.7;
  const end = part < 0 ? [24, 82, 190] : [205, 74, 10];
  return [...end.map((colour) => Math.round(245 + (colour - 245) * strength)), 255];
}

/** @param {number} scale */
function drawDifferenceScale(scale) {
  const canvas = byId("difference-scale");
  const { context, width } = sharpCanvas(canvas);
  const room = 30;
  for (let x = room; x < width - room; x += 1) {
    const [red, green, blue] = differenceColour((2 * (x - room)) / (width - 2 * room - 1) - 1);
    context.fillStyle = `rgb(${red} ${green} ${blue})`;
    context.fillRect(x, 4, 1.5, 14);
  }
  context.fillStyle = colours.ink;
  context.font = CHART_FONT;
  context.textBaseline = "top";
  context.textAlign = "center";
  const ends = [[room, `−${short(scale)}`], [width / 2, "0 grey levels"], [width - room, `+${short(scale)}`]];
  for (const [x, text] of ends) context.fillText(String(text), Number(x), 22);
  canvas.setAttribute("aria-label", `Scale of the difference: blue is −${scale}, orange +${scale} grey levels`);
}
