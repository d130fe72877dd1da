/** How good: counts wrong bits, and draws a growing curve over L2A. */

const CURVE_POINTS = 21;
const L2A_SPAN = { low: 0.2, high: 4 };
/** Time for which a worker counts before it reports. */
const COUNT_MS = 250;
/** Time for which a search may run before the worker counts as frozen. */
const SEARCH_PATIENCE_MS = 180_000;
const COUNTED = ["kmeans", "best"];
/** Maximum number of frames per L2A in the search for the optimum. @type {Record<string, number>} */
const SEARCH_FRAMES = { kmeans: 2000, best: 500 };

const good = {
  /** Increases with each run; only the last run's results are shown. */
  run: 0,
  isRunning: false,
  isSearching: false,
  /** @type {any} */
  curve: null,
  /** The optimum that a search has found. @type {{l2a: number, l2a_95: [number, number], at_border: boolean} | null} */
  optimum: null,
};

function makeGood() {
  byId("good-frames").addEventListener("change", () => {
    settings.fields.frames = byId("good-frames").value;
    goodChanged();
  });
  byId("measure").addEventListener("change", () => {
    settings.fields.measure = byId("measure").value;
    curveChanged();
  });
  byId("curve-detector").addEventListener("change", () => {
    settings.fields.curve = byId("curve-detector").value;
    curveChanged();
  });
  byId("good-run").addEventListener("click", () => (good.isRunning ? stopGood() : startGood(true)));
  byId("optimum").addEventListener("click", () => (good.isSearching ? counter.end() : searchOptimum()));
  scene.listeners.push(() => {
    if (settings.fields.mode === "good") goodChanged();
  });
}

const startWhenRested = whenRested(400, () => {
  if (settings.fields.mode === "good") startGood(true);
});

/** Restarts counting once the settings are stable; results for the earlier scene are discarded. */
function goodChanged() {
  stopGood();
  writeAddress();
  showCommand();
  startWhenRested();
}

function curveChanged() {
  stopGood();
  writeAddress();
  showCommand();
  good.optimum = null;
  startGood(false);
}

function stopGood() {
  good.run += 1;
  if (good.isSearching) counter.end();
  showRunning(false, "");
}

/** @param {boolean} isRunning @param {string} text */
function showRunning(isRunning, text) {
  good.isRunning = isRunning;
  byId("good-run").textContent = isRunning ? "Stop" : "Count anew";
  byId("good-progress").textContent = text;
}

/** @param {boolean} doesCount Whether to count bits, or only to redraw the curve. */
async function startGood(doesCount) {
  if (good.isSearching) return;
  const run = (good.run += 1);
  if (doesCount) good.optimum = null;
  good.curve = null;
  sharpCanvas(byId("curve"));
  sayAt(byId("curve-text"), "");
  showRunning(true, "Counting …");
  try {
    if (doesCount) for (const detector of COUNTED) await countBits(run, detector);
    await growCurve(run);
    if (run !== good.run) return;
    showRunning(false, "Done.");
    byId("good-done").textContent = `Bit error rate by k-means: ${byId("ber-kmeans").textContent}; by the best detector: ` +
      `${byId("ber-best").textContent}. ${byId("curve-text").textContent}`;
  } catch (error) {
    if (run === good.run) showRunning(false, "");
    sayError(error);
  }
}

/** @param {string} detector */
function countRequest(detector) {
  return { scene: sceneRequest(), level: "fast", detector, seed: seedRequest() };
}

/**
 * @param {number} frames The number of frames in the last request.
 * @param {number} ms Its duration.
 * @param {number} left The remaining number of frames.
 */
function nextPiece(frames, ms, left) {
  return Math.max(1, Math.min(left, Math.round((frames * COUNT_MS) / Math.max(ms, 5)), frames * 8));
}

/** @param {number} run @param {string} detector */
async function countBits(run, detector) {
  const wanted = Number(settings.fields.frames);
  if (run !== good.run) return;
  byId(`ber-${detector}`).textContent = "…";
  await counter.ask({ do: "count", ...countRequest(detector) });
  let piece = detector === "kmeans" ? 1000 : 100;
  let counted = 0;
  let ms = 0;
  while (counted < wanted && run === good.run) {
    const { answer } = await counter.ask({ do: "count_on", frames: piece });
    if (run !== good.run) return;
    ms += answer.ms;
    counted = answer.frames;
    showCount(detector, answer, ms);
    showRunning(true, `${detector === "kmeans" ? "k-means" : "best detector"}: ${short(counted, 7)} of ${short(wanted, 7)} frames`);
    piece = nextPiece(piece, answer.ms, wanted - counted);
  }
}

/** @param {string} detector @param {any} count @param {number} ms */
function showCount(detector, count, ms) {
  const [low, high] = count.ber_95;
  byId(`ber-${detector}`).textContent = count.bit_errors === 0 ? `no wrong bit: below ${short(high, 2)}` : `${short(count.ber, 2)}`;
  const rows = [
    ["Bit error rate, 95 %", `${short(low, 2)} to ${short(high, 2)}`],
    ["Wrong bits", `${short(count.bit_errors, 9)} of ${short(count.bits, 12)}`],
    ["Frames", `${short(count.frames, 9)} in ${shortTime(ms / 1000)}`],
  ];
  if (count.b2w !== null && count.b2w !== undefined) rows.push(["B2W", short(count.b2w)]);
  fillTerms(byId(`count-${detector}`), /** @type {[string, string][]} */ (rows));
}

/** @param {number} run */
async function growCurve(run) {
  if (run !== good.run) return;
  const { measure, curve: detector } = settings.fields;
  const wanted = Number(settings.fields.frames);
  await counter.ask({ do: "curve", ...countRequest(detector), measure, points: CURVE_POINTS });
  let piece = 8;
  let counted = 0;
  while (counted < wanted && run === good.run) {
    const began = performance.now();
    const { answer } = await counter.ask({ do: "curve_on", frames: piece });
    if (run !== good.run) return;
    counted = answer.frames;
    good.curve = { ...answer, measure, detector };
    showCurve();
    showRunning(true, `Curve: ${short(counted, 7)} of ${short(wanted, 7)} frames at each of ${CURVE_POINTS} ratios`);
    piece = nextPiece(piece, performance.now() - began, wanted - counted);
  }
}

function showCurve() {
  const { curve } = good;
  if (!curve || !scene.opened) return;
  const isRate = curve.measure === "ber";
  const known = curve.points.filter((/** @type {any} */ point) => point.value !== null);
  const points = known.map(({ l2a, value, low, high }) => ({ x: l2a, y: value, low, high }));
  const rates = points.flatMap((point) => [point.y, point.high, point.low]);
  const span = spanOf(isRate ? rates : points.map(({ y }) => y), isRate);
  drawChart(byId("curve"), {
    x: { ...L2A_SPAN, log: true, label: "L2A, 1/sr" },
    y: { ...span, log: isRate, label: isRate ? "bit error rate" : "B2W" },
    points,
    marks: curveMarks(),
  });
  const words = curveMarks().map(({ label }) => label).join("; ");
  const what = isRate ? "Lower is better; bars are 95 % intervals." : "Higher is better.";
  const atBorder = good.optimum?.at_border ? " The optimum is at the end of what was searched: the best may lie beyond." : "";
  byId("curve-text").textContent = `${what} ${sentence(words)}${atBorder}`;
  byId("curve").setAttribute("aria-label", `${isRate ? "Bit error rate" : "B2W"} over L2A. ${words}.`);
  fillTable(byId("curve-table"), known.map(({ l2a, value, low, high }) => ({ cells: [short(l2a), value, low ?? "–", high ?? "–"] })));
}

/** @returns {Mark[]} */
function curveMarks() {
  const { opened } = scene;
  const marks = [{ x: opened.l2a, label: `in use ${short(opened.l2a)}`, colour: colours.ink, dash: [2, 4] }];
  if (opened.table_l2a !== null) {
    marks.unshift({ x: opened.table_l2a, label: `the table's choice ${short(opened.table_l2a)}`, colour: colours.good, dash: [6, 4] });
  }
  const { optimum } = good;
  if (optimum) {
    const [low, high] = optimum.l2a_95.map((value) => short(value));
    marks.unshift({ x: optimum.l2a, label: `optimum ${short(optimum.l2a)} (95 %: ${low} to ${high})`, colour: colours.warm, dash: [] });
  } else if (good.curve.best && !isFlat()) {
    const { l2a } = good.curve.best;
    marks.unshift({ x: l2a, label: `best of the curve ${short(l2a)}`, colour: colours.warm, dash: [] });
  }
  return marks;
}

/** Whether several points share the best value, for example if no bit is wrong, so that none of them is the best. */
function isFlat() {
  const { points, best } = good.curve;
  return points.filter((/** @type {any} */ point) => point.value === best.value).length > 1;
}

async function searchOptimum() {
  stopGood();
  good.isSearching = true;
  byId("optimum").textContent = "Stop the search";
  showRunning(false, "Searching for the optimum …");
  byId("good-run").disabled = true;
  const run = good.run;
  const { measure, curve: detector } = settings.fields;
  try {
    const request = { do: "optimum", scene: sceneRequest(), measure, detector, frames: SEARCH_FRAMES[detector], seed: seedRequest() };
    const { answer } = await counter.ask(request, undefined, SEARCH_PATIENCE_MS);
    if (run === good.run) {
      good.optimum = answer;
      showCurve();
    }
  } catch (error) {
    sayError(error);
  } finally {
    good.isSearching = false;
    byId("good-run").disabled = false;
    byId("optimum").textContent = "Find the optimum";
    if (settings.fields.mode !== "good") showRunning(false, "");
    else if (run !== good.run) startGood(true);
    else if (good.curve) showRunning(false, "");
    else startGood(false);
  }
}
