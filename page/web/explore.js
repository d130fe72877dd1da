/** Explore: the scene's frames in turn, each read as soon as it is drawn. */

const explore = {
  /** @type {Picture | null} */
  picture: null,
  isPaused: false,
  isAsking: false,
  /** Whether to draw a frame although the picture is paused. */
  isWanted: false,
  /** The next frame to request. */
  next: 0,
  /** The buffer that page and worker pass to each other. @type {Uint8Array | undefined} */
  spare: undefined,
  /** The last readings. @type {any} */
  seen: null,
  /** The time of the last request. */
  askedAt: 0,
  /** Counts since the scene changed: frames, and wrong bits of k-means and of the best detector. */
  tally: { frames: 0, kmeans: 0, ml: 0 },
  /** The time at which the texts beside the pictures last changed: faster changes are unreadable. */
  saidAt: 0,
};

/** The speed of Explore, for tests and the console. */
const stats = { frames: 0, fps: 0 };
/** Milliseconds from the page's start to the first picture. @type {number | null} */
let firstPictureMs = null;
/** @type {() => void} */
let announceFirstPicture = () => {};

function makeExplore() {
  explore.picture = new Picture(byId("explore-picture"), "The panel as the camera sees it");
  pauseAsTold();
  byId("pause").addEventListener("click", () => setPaused(!explore.isPaused));
  byId("step").addEventListener("click", () => {
    const from = explore.isPaused ? Number(settings.fields.frame) : explore.next;
    setPaused(true);
    goToFrame(Math.min(LAST_FRAME, from + 1));
  });
  byId("pace").addEventListener("change", () => {
    settings.fields.pace = byId("pace").value;
    writeAddress();
  });
  byId("frame").addEventListener("change", () => {
    const wrong = FIELDS.frame.wrong(byId("frame").value);
    if (wrong) sayWrong(`The frame ${wrong}.`);
    else {
      setPaused(true);
      goToFrame(Number(byId("frame").value));
    }
  });
  scene.listeners.push((opened) => {
    Object.assign(explore.tally, { frames: 0, kmeans: 0, ml: 0 });
    clearScatter();
    if (explore.isPaused) explore.next = Number(settings.fields.frame);
    if (settings.fields.mode !== "explore") return;
    showOpened(opened);
    explore.isWanted = true;
    lookAtFrame();
  });
  requestAnimationFrame(animate);
}

const showOpened = atMostEvery(READ_MS, (/** @type {any} */ opened) => {
  showNumbers(opened);
  planChanged(opened);
});

/** A frame number in the address pauses; without one, frames run unless the user prefers reduced motion. */
function pauseAsTold() {
  const { frame } = settings.fields;
  explore.isPaused = frame !== FIELDS.frame.usual || matchMedia("(prefers-reduced-motion: reduce)").matches;
  explore.next = Number(frame);
  showPause();
}

/** @param {boolean} isPaused */
function setPaused(isPaused) {
  explore.isPaused = isPaused;
  settings.fields.frame = isPaused ? String(explore.seen?.number ?? explore.next) : FIELDS.frame.usual;
  writeAddress();
  showCommand();
  showPause();
  if (isPaused && explore.seen) sayFrame(explore.seen);
  // If the page was paused without a scene, because the simulator failed, it opens the scene again.
  if (!isPaused && !scene.opened) openScene();
}

function showPause() {
  byId("pause").textContent = explore.isPaused ? "Play" : "Pause";
  // A screen reader does not read texts that change with each frame, only those of a paused frame.
  byId("explore-text").setAttribute("aria-live", explore.isPaused ? "polite" : "off");
}

/** @param {number} frame */
function goToFrame(frame) {
  settings.fields.frame = String(frame);
  explore.next = frame;
  writeAddress();
  showCommand();
  explore.isWanted = true;
  lookAtFrame();
}

/** Runs with the screen: requests a frame whenever the last one has arrived. @param {number} now */
function animate(now) {
  requestAnimationFrame(animate);
  const pace = Number(settings.fields.pace);
  if (settings.fields.mode !== "explore" || explore.isPaused || now - explore.askedAt < pace - 4) return;
  if (lookAtFrame()) explore.askedAt = now;
}

/** Requests the next frame, unless one is on its way or no scene is open. @returns {boolean} Whether it did. */
function lookAtFrame() {
  if (explore.isAsking || !scene.opened) return false;
  explore.isAsking = true;
  explore.isWanted = false;
  takeFrame(explore.next, scene.opened).catch(sayError).finally(() => {
    explore.isAsking = false;
    // The user has stepped on or moved a slider while this frame was on its way.
    if (explore.isWanted) lookAtFrame();
  });
  return true;
}

/** @param {number} number @param {any} opened */
async function takeFrame(number, opened) {
  const spare = explore.spare;
  explore.spare = undefined;
  const { answer, bytes } = await live.ask({ do: "frame", frame: number }, spare);
  const { width, height } = scene.opened?.region ?? opened.region;
  explore.spare = bytes;
  // This frame belongs to a scene of another size, which has been replaced meanwhile.
  if (!bytes || bytes.length !== width * height) return;
  if (!explore.isPaused) explore.next = number === LAST_FRAME ? 0 : number + 1;
  explore.seen = answer;
  explore.picture.showGrey(bytes, width, height);
  if (firstPictureMs === null) {
    firstPictureMs = performance.now();
    announceFirstPicture();
  }
  countFrame(performance.now());
  showFrame(answer);
}

/** @type {number[]} */
const arrivals = [];

/** @param {number} now */
function countFrame(now) {
  stats.frames += 1;
  arrivals.push(now);
  while (arrivals.length > 1 && now - arrivals[0] > 1000) arrivals.shift();
  stats.fps = arrivals.length > 1 ? (1000 * (arrivals.length - 1)) / (now - arrivals[0]) : 0;
}

/** @param {any} seen */
function showFrame(seen) {
  const [sent, kmeans, ml] = [seen.sent, seen.kmeans, seen.ml].map(ledsOf);
  const [byKmeans, byMl] = seen.readable;
  explore.tally.frames += 1;
  // An unreadable panel counts as 32 errors, not as none.
  explore.tally.kmeans += byKmeans ? countWrong(kmeans, sent) : 32;
  explore.tally.ml += byMl ? countWrong(ml, sent) : 32;
  if (byKmeans) addToScatter(seen.agr, seen.gri, sent);
  drawSeen(seen);
  const now = performance.now();
  if (explore.isPaused || now - explore.saidAt > 2 * READ_MS) {
    explore.saidAt = now;
    sayFrame(seen);
  }
}

/** @param {any} seen */
function drawSeen({ sent, kmeans, ml, readable: [byKmeans, byMl], split }) {
  const truth = ledsOf(sent);
  drawLeds(byId("leds-sent"), truth);
  drawLeds(byId("leds-kmeans"), byKmeans ? ledsOf(kmeans) : null, truth);
  drawLeds(byId("leds-ml"), byMl ? ledsOf(ml) : null, truth);
  if (byKmeans) drawScatter(byId("scatter"), split);
}

/** @param {any} seen */
function sayFrame(seen) {
  const [sent, kmeans, ml] = [seen.sent, seen.kmeans, seen.ml].map(ledsOf);
  const [byKmeans, byMl] = seen.readable;
  const wrong = [byKmeans ? countWrong(kmeans, sent) : null, byMl ? countWrong(ml, sent) : null];
  const words = wrong.map((count) => (count === null ? "nothing read" : count === 0 ? "all right" : `${count} wrong`));
  const { frames, kmeans: tallyKmeans, ml: tallyMl } = explore.tally;
  // While frames run, the average, which changes slowly enough to read; for a paused frame, its own number.
  const share = (/** @type {number} */ count) => `${short((100 * count) / (64 * frames), 2)} % wrong`;
  byId("wrong-kmeans").textContent = explore.isPaused || !byKmeans ? words[0] : share(tallyKmeans);
  byId("wrong-ml").textContent = explore.isPaused || !byMl ? words[1] : share(tallyMl);
  if (document.activeElement !== byId("frame")) byId("frame").value = seen.number;
  byId("rate").textContent = explore.isPaused ? "" : `${Math.round(stats.fps)} a second`;
  byId("explore-text").textContent = [
    explore.isPaused ? "" : `Counted over ${several(frames, "frame")}.`,
    byMl ? `The best detector expects ${short(100 * seen.confidence, 4)} % of its bits to be right.` : "",
    seen.mixed ? "This exposure caught two symbols." : "",
    seen.why ? sentence(seen.why) : "",
  ].filter(Boolean).join(" ");
  byId("leds-sent").setAttribute("aria-label", `Shown, row by row: ${spellLeds(sent)}`);
  byId("leds-kmeans").setAttribute("aria-label", `Read by k-means, ${words[0]}: ${byKmeans ? spellLeds(kmeans) : ""}`);
  byId("leds-ml").setAttribute("aria-label", `Read by the best detector, ${words[1]}: ${byMl ? spellLeds(ml) : ""}`);
  byId("scatter").setAttribute("aria-label", `AGR and GRI of 64 LEDs, and the line by which k-means divides them: ${words[0]}`);
  explore.picture.describe(`frame ${seen.number}; ${several(sent.reduce((sum, bit) => sum + bit, 0), "LED")} of 64 on`);
}

/** @param {any} opened */
function showNumbers(opened) {
  fillTerms(byId("numbers"), [
    ["Exposure", shortTime(opened.exposure_s)],
    ["ISO", short(opened.iso)],
    ["Duty of an On LED", Number.isFinite(opened.duty) ? `${short(100 * opened.duty)} %` : sentence(opened.no_duty ?? "")],
    ["Luminance of an On LED", `${short(opened.luminance_cd_m2)} cd/m²`],
    ["Intensity of a message", `${short(opened.candela)} cd; with all LEDs on ${short(opened.candela_max)} cd`],
    ["L2A in use", `${short(opened.l2a)} per sr`],
    ["The table's choice", opened.table_l2a === null ? "none here" : `${short(opened.table_l2a)} per sr`],
    ["LEDs apart in the picture", `${short(opened.pitch_px)} px`],
    ["Camera", `${opened.sensor.width} × ${opened.sensor.height} px, ${short(opened.values.camera.frame_rate_hz)} frames/s`],
    ["Symbols", `${short(opened.values.link.symbol_rate_hz)} a second`],
  ]);
  byId("explore-size").textContent = `The camera's picture: ${opened.region.width} × ${opened.region.height} of its pixels`;
}
