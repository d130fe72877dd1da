/** Receive: reads pictures, films and cameras with the receiver. */

/** Minimum time between two painted pictures of a film. */
const PAINT_MS = 60;

const receiving = {
  /** Increases with each run, and when one is stopped. */
  run: 0,
  /** @type {Picture | null} */
  picture: null,
  /** @type {Picture | null} */
  close: null,
  /** @type {Film | null} */
  film: null,
  /** Texts so far, each with its number of receptions. @type {Map<string, {place: HTMLElement, times: number}>} */
  texts: new Map(),
  /** The text of the status, so that it is announced once. */
  state: "",
  cameraText: "",
  /** The arguments of `vocc` for the same input. */
  command: "receive film.y4m",
};

function makeReceive() {
  receiving.picture = new Picture(byId("receive-picture"), "What the camera filmed");
  receiving.close = new Picture(byId("receive-close"), "The panel, enlarged");
  byId("choose").addEventListener("click", () => byId("files").click());
  byId("files").addEventListener("change", () => {
    takeFiles([...byId("files").files]);
    // Allows the user to choose the same file again.
    byId("files").value = "";
  });
  const film = (/** @type {number} */ run) => receiveFilm(run, (isWanted) => openCamera(toldRate("fps"), isWanted));
  byId("webcam").addEventListener("click", () => {
    // The program cannot read a webcam, so the command has a recording of it.
    sayReceived("receive recording.mp4");
    startReceiving(film);
  });
  byId("receive-stop").addEventListener("click", stopReceiving);
  byId("save-camera").addEventListener("click", () => download("camera.toml", receiving.cameraText));
  for (const [id, field] of [["fps", "fps"], ["symbol-rate", "rate"]]) byId(id).addEventListener("change", () => setRate(id, field));
  byId("as-film").addEventListener("change", () => {
    settings.fields.film = byId("as-film").checked ? "yes" : "no";
    writeAddress();
  });
  listenToDrops(byId("drop"));
}

/** @param {string} id @param {string} field */
function setRate(id, field) {
  const input = byId(id);
  // An input with an invalid number has an empty value.
  const wrong = input.validity.badInput ? "must be a number" : rateOrNothing(input.value);
  if (wrong) {
    sayWrong(`The ${id === "fps" ? "frames" : "symbols"} a second ${wrong}.`);
    input.value = settings.fields[field];
    return;
  }
  sayWrong("");
  settings.fields[field] = input.value;
  writeAddress();
  showCommand();
}

/** @param {string} field @returns {number | null} */
function toldRate(field) {
  return settings.fields[field] === "" ? null : Number(settings.fields[field]);
}

/** Accepts files dropped anywhere, because outside the drop area the browser would leave the page. @param {HTMLElement} shown The place. */
function listenToDrops(shown) {
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    shown.classList.add("over");
  });
  window.addEventListener("dragleave", () => shown.classList.remove("over"));
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    shown.classList.remove("over");
    const files = [...(event.dataTransfer?.files ?? [])];
    if (files.length > 0 && settings.fields.mode !== "receive") chooseMode("receive");
    takeFiles(files);
  });
}

/** @param {File[]} files */
function takeFiles(files) {
  if (files.length === 0) return;
  startReceiving(async (run) => {
    const kinds = await Promise.all(files.map(kindOf));
    if (run !== receiving.run) return;
    const films = files.filter((_, at) => kinds[at] !== "picture");
    if (films.length > 1) throw new Error("One film at a time: choose one");
    if (films.length === 1) {
      const [film] = films;
      const isPlain = kinds[files.indexOf(film)] === "y4m";
      sayReceived(`receive ${quoted(film.name)}`);
      await receiveFilm(run, (isWanted) => (isPlain ? openY4m(film, isWanted) : openVideo(film, toldRate("fps"), isWanted)));
    } else if (files.length > 1 && byId("as-film").checked) {
      sayReceived("receive pictures/");
      await receiveFilm(run, () => openPictures(files, toldRate("fps")));
    } else {
      sayReceived(`decode ${files.map(({ name }) => quoted(name)).join(" ")}`);
      await readPictures(run, files);
    }
  });
}

/** @param {string} command The arguments of `vocc` for the same input. */
function sayReceived(command) {
  receiving.command = command;
  showCommand();
}

/** @param {File} file */
async function kindOf(file) {
  if (file.name.toLowerCase().endsWith(".y4m") || (await isY4m(file))) return "y4m";
  return file.type.startsWith("video/") || /\.(mp4|m4v|mov|webm|mkv|ogv|avi)$/i.test(file.name) ? "video" : "picture";
}

/** @param {(run: number) => Promise<void>} work */
async function startReceiving(work) {
  const run = endFilm();
  clearReceived();
  sayWrong("");
  byId("receive-stop").disabled = false;
  try {
    await work(run);
  } catch (error) {
    // A newer run makes this result obsolete.
    if (run !== receiving.run) return;
    sayState("Nothing more is read.");
    sayError(error);
  } finally {
    if (run === receiving.run) {
      closeFilm();
      byId("receive-stop").disabled = true;
    }
  }
}

function closeFilm() {
  receiving.film?.close?.();
  receiving.film = null;
}

/** Ends reading or opening without a report. @returns {number} The next run. */
function endFilm() {
  closeFilm();
  if (!byId("receive-stop").disabled) sayState("Stopped.");
  byId("receive-stop").disabled = true;
  return (receiving.run += 1);
}

/** Ends a film with a report of its results, or any other activity. */
function stopReceiving() {
  if (receiving.film) closeFilm();
  else endFilm();
}

function clearReceived() {
  receiving.texts.clear();
  byId("receive-stage").hidden = true;
  for (const id of ["texts", "receive-advice", "learnt"]) byId(id).replaceChildren();
  byId("learnt-card").hidden = byId("pictures-card").hidden = true;
  sayAt(byId("learnt-text"), "");
  fillTable(byId("pictures"), []);
  drawLeds(byId("receive-leds"), null);
  receiving.picture.showCorners(null);
  byId("receive-bits").textContent = "Bits read";
  receiving.state = "";
  byId("receive-state").textContent = "";
}

/** @param {string} text */
function sayState(text) {
  if (receiving.state === text) return;
  receiving.state = text;
  byId("receive-state").textContent = text;
}

/** @param {number} run @param {(isWanted: () => boolean) => Promise<Film>} open */
async function receiveFilm(run, open) {
  sayState("Opening …");
  const film = await open(() => run === receiving.run);
  if (run !== receiving.run) {
    film.close?.();
    return;
  }
  receiving.film = film;
  const { width, height, isY4m: isPlain = false } = film;
  const fps = toldRate("fps") ?? film.fps;
  const keys = byId("keys").value;
  await live.ask({ do: "receive", width, height, fps, symbol_rate: toldRate("rate"), is_y4m: isPlain, keys });
  if (run !== receiving.run) return;
  const assumed = film.isAssumed ? ", which is assumed, as it could not be found" : "";
  const rate = fps ? `${short(fps, 5)} frames a second${assumed}` : "frames a second not told, 100 assumed";
  sayState(`Looking for a panel in ${film.name}: ${width} × ${height} pixels, ${rate} …`);
  const fault = await readShots(run, film);
  if (run !== receiving.run) return;
  const { answer } = await live.ask({ do: "receive_end" });
  showReceiveEnd(answer, fault);
  if (fault) sayError(fault);
}

/** Reads to the end, or until a film is damaged. @param {number} run @param {Film} film @returns {Promise<unknown>} The damage. */
async function readShots(run, film) {
  let paintedAt = -Infinity;
  const shots = film.shots[Symbol.asyncIterator]();
  for (;;) {
    /** @type {IteratorResult<Shot>} */
    let next;
    try {
      next = await shots.next();
    } catch (fault) {
      return fault;
    }
    if (next.done || run !== receiving.run || receiving.film !== film) return null;
    const { number, late, format, bytes, paint } = next.value;
    const isPainted = performance.now() - paintedAt > PAINT_MS;
    if (isPainted) paint(receiving.picture);
    byId("receive-stage").hidden = false;
    const { answer } = await live.ask({ do: "take", number, late, format }, bytes);
    if (run !== receiving.run) return null;
    if (isPainted) paintedAt = performance.now();
    showTaken(number, answer, isPainted);
  }
}

/** @param {number} number @param {any} taken @param {boolean} isPainted */
function showTaken(number, taken, isPainted) {
  const { panel } = taken;
  taken.messages.forEach(showText);
  taken.proofs.forEach(showProof);
  if (taken.messages.length > 0) sayState("A text has arrived; reading on …");
  else if (panel && receiving.texts.size === 0) sayState("A panel is found and followed; no text yet …");
  if (!isPainted) return;
  byId("receive-says").textContent = `Frame ${number}${taken.why ? `: ${sentence(taken.why)}` : ""}`;
  receiving.picture.showCorners(panel?.corners_px ?? null);
  receiving.picture.describe(panel ? `frame ${number}, a panel is outlined` : `frame ${number}, no panel is read`);
  if (panel) showPanel(panel, taken.rate_hz);
  showLearnt(taken.camera);
}

/** @param {any} panel @param {number} [rate] */
function showPanel(panel, rate) {
  receiving.close.showAround(receiving.picture, panel.corners_px);
  showReading(byId("receive-leds"), byId("receive-bits"), panel, rate);
}

/** Bytes that are not text can only be distinguished as digits. @param {any} message @returns {string} */
function shownText({ text, hex }) {
  return hex ? `bytes ${hex}` : text;
}

/** @param {any} message */
function showText(message) {
  const { first_frame: first, last_frame: last, corrected_bits: corrected } = message;
  const shown = shownText(message);
  const known = receiving.texts.get(shown);
  const place = known?.place ?? make("p");
  const times = (known?.times ?? 0) + 1;
  const often = times > 1 ? `, ${times} times so far` : "";
  showReceived(place, shown, ` frames ${first} to ${last}, ${several(corrected, "bit")} corrected${often}`);
  showVerdict(place, message);
  if (!known) byId("texts").append(place);
  receiving.texts.set(shown, { place, times });
}

/** @param {any} proof Who signed a text that came before. */
function showProof(proof) {
  const known = receiving.texts.get(shownText(proof));
  if (known) showVerdict(known.place, proof);
}

/** The learnt properties in the order of display. */
const LEARNT_NAMES = {
  encoding: "Curve", black_grey: "Grey of no light", blur_sigma_px: "Blur, px", blur_deviation_px: "Blur, how sure, px",
  blur_aspect: "Blur along x over along y", noise_grey: "Noise, grey levels", read_noise_e: "Read noise, electrons",
  line_delay_exposures: "Line after line, exposures", broken_leds: "Broken LEDs", frames: "Learnt from frames",
};

/** @param {any} learnt */
function showLearnt(learnt) {
  if (!learnt) return;
  byId("learnt-card").hidden = false;
  const keys = new Set([...Object.keys(LEARNT_NAMES), ...Object.keys(learnt)]);
  const known = [...keys].filter((key) => key in learnt);
  const rows = known.map((key) => [LEARNT_NAMES[key] ?? key.replace(/_/g, " "), plainValue(learnt[key])]);
  fillTerms(byId("learnt"), /** @type {[string, string][]} */ (rows));
}

/** Any learnt value in one line. @returns {string} Whatever was learnt, in a line. */
function plainValue(value) {
  if (value === null || value === undefined) return "not known";
  if (typeof value === "number") return short(value, 4);
  if (Array.isArray(value)) return value.length === 0 ? "none" : value.map(plainValue).join(", ");
  if (typeof value === "object") return Object.entries(value).map(([key, inner]) => `${key} ${plainValue(inner)}`).join(", ");
  return String(value);
}

/** @param {any} end @param {unknown} fault */
function showReceiveEnd(end, fault) {
  end.messages.slice([...receiving.texts.values()].reduce((sum, { times }) => sum + times, 0)).forEach(showText);
  end.proofs.forEach(showProof);
  const read = `a panel was read in ${end.read} of ${several(end.frames, "frame")}`;
  const came = receiving.texts.size > 0 ? `${several(receiving.texts.size, "text")} came; ${read}` : `No text came: ${read}`;
  sayState(`${fault ? "The film breaks off. " : ""}${came}.`);
  byId("receive-advice").replaceChildren(...end.advice.map((/** @type {string} */ text) => make("li", { textContent: sentence(text) })));
  showLearnt(end.camera);
  sayAt(byId("learnt-text"), end.camera_text ? sentence(end.camera_text) : "");
  receiving.cameraText = end.camera_toml ?? "";
  byId("save-camera").hidden = !receiving.cameraText;
}

/** @param {number} run @param {File[]} files */
async function readPictures(run, files) {
  byId("pictures-card").hidden = false;
  const rows = [];
  let found = 0;
  for (const file of files) {
    sayState(`Reading ${file.name} …`);
    const row = await readPicture(file, run);
    rows.push(row.cells);
    found += Number(row.isRead);
    fillTable(byId("pictures"), rows.map((cells) => ({ cells })));
  }
  sayState(`A panel was read in ${found} of ${several(files.length, "picture")}.`);
}

/** @param {File} file @param {number} run @returns {Promise<{isRead: boolean, cells: string[]}>} A row of the table. */
async function readPicture(file, run) {
  try {
    const { answer, bytes } = await decodePicture(file);
    giveUpUnless(() => run === receiving.run);
    const { width, height, bits, confidence, corners_px: corners, camera } = answer;
    byId("receive-stage").hidden = false;
    receiving.picture.showGrey(bytes, width, height);
    receiving.picture.showCorners(corners ?? null);
    byId("receive-says").textContent = file.name;
    if (bits) showPanel({ bits, confidence, corners_px: corners });
    showLearnt(camera);
    const sure = bits ? `${short(100 * confidence, 4)} %` : "";
    const why = answer.why ? sentence(answer.why) : "Read.";
    return { isRead: Boolean(bits), cells: [file.name, `${width} × ${height}`, bits ?? "–", sure, why] };
  } catch (error) {
    if (error instanceof GivenUp || run !== receiving.run) throw error;
    const text = sentence(/** @type {Error} */ (error).message);
    sayWrong(text);
    return { isRead: false, cells: [file.name, "", "–", "", text] };
  }
}
