/** The sources of the Receive tab: pictures, films and cameras, read by the receiver in the worker. */

/** Minimum time between two painted pictures of a film. */
const PAINT_MS = 60;

const receiving = {
  /** Increases with each run, and when one is stopped. */
  run: 0,
  /** @type {Film | null} */
  film: null,
  /** Messages so far (count). */
  messages: 0,
  /** Each message and the verdict on it, by its key. @type {Map<string, {times: number, report: any, proof: any}>} */
  heard: new Map(),
  cameraText: "",
  /** The arguments of `vocc` for the same input. */
  command: "receive film.y4m",
};

function makeReceive() {
  makeReceived();
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
  byId("learnt-card").append(byId("save-camera"));
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
  clearHeard();
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
  const about = `: ${width} × ${height} pixels, ${rate}`;
  showSource({ name: film.name, about, is_live: film.isLive ?? false, is_checked: keys.trim() !== "" });
  const fault = await readShots(run, film);
  if (run !== receiving.run) return;
  const { answer } = await live.ask({ do: "receive_end" });
  showFilmEnd(answer);
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
    if (isPainted) paint(received.picture);
    const { answer } = await live.ask({ do: "take", number, late, format }, bytes);
    if (run !== receiving.run) return null;
    hearMessages(answer);
    if (!isPainted) continue;
    paintedAt = performance.now();
    showReceivedFrame(answer, enlarge);
  }
}

/** @param {Picture} close @param {any} panel */
function enlarge(close, { corners_px: corners }) {
  close.showAround(received.picture, corners);
}

function clearHeard() {
  receiving.heard.clear();
  receiving.messages = 0;
  byId("pictures-card").hidden = byId("save-camera").hidden = true;
  fillTable(byId("pictures"), []);
}

/** Shows a message, or the verdict on one that came before. @param {"report" | "proof"} part @param {any} told */
function hearMessage(part, told) {
  const key = keyOf(told);
  const { times, report } = receiving.heard.get(key) ?? { times: 0, report: null };
  const heard = part === "report" ? { times: times + 1, report: told, proof: null } : { times, report, proof: told };
  receiving.heard.set(key, heard);
  showMessage(heard);
}

/** Shows the messages and proofs of an answer. @param {any} answer */
function hearMessages({ messages: reports, proofs }) {
  for (const report of reports) hearMessage("report", report);
  for (const proof of proofs) hearMessage("proof", proof);
  receiving.messages += reports.length;
}

/** @param {any} end */
function showFilmEnd(end) {
  hearMessages({ ...end, messages: end.messages.slice(receiving.messages) });
  showEnd({ ...end, messages: receiving.messages });
  for (const text of end.advice) showRemark({ text: sentence(text) });
  showLearnt(end);
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
    const { width, height, bits, confidence, why, corners_px, camera } = answer;
    received.picture.showGrey(bytes, width, height);
    const panel = bits ? { panel: 0, bits, confidence, corners_px } : { panel: 0, why };
    showReceivedFrame({ name: file.name, size_px: [width, height], panels: [panel], camera }, enlarge);
    const sure = bits ? `${short(100 * confidence, 4)} %` : "";
    const says = why ? sentence(why) : "Read.";
    return { isRead: Boolean(bits), cells: [file.name, `${width} × ${height}`, bits ?? "–", sure, says] };
  } catch (error) {
    if (error instanceof GivenUp || run !== receiving.run) throw error;
    const text = sentence(/** @type {Error} */ (error).message);
    sayWrong(text);
    return { isRead: false, cells: [file.name, "", "–", "", text] };
  }
}
