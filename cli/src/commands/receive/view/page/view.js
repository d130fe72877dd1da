/** The page of `vocc receive --view`: shows the events that the program sends. */

const view = {
  /** @type {Picture | null} */
  picture: null,
  /** By number. @type {Map<number, PanelCard>} */
  panels: new Map(),
  /** By panel and text, the last received last. @type {Map<string, HTMLElement>} */
  texts: new Map(),
  /** The newest frame that waits for the one before it. @type {any} */
  waiting: null,
  isDecoding: false,
  /** Connections so far. */
  connections: 0,
};

/** Different texts that stay on the page; vocc keeps as many for a new page. */
const TEXTS_MAX = 64;

/** A panel's card: enlarged, its bits, its pose. */
class PanelCard {
  /** @param {number} number */
  constructor(number) {
    const enlarged = make("div", { className: "picture" });
    this.leds = make("canvas", { className: "leds" });
    this.leds.setAttribute("role", "img");
    this.leds.setAttribute("aria-label", "Nothing read yet");
    this.heading = make("h2", { textContent: `Panel ${number}` });
    this.why = make("p", { className: "why" });
    this.bits = make("p", { className: "quiet bits" });
    this.pose = make("dl");
    const figures = [enlarged, this.leds].map((shown) => make("figure", {}, [shown]));
    this.card = make("section", { className: "card old unread" }, [this.heading, ...figures, this.bits, this.why, this.pose]);
    byId("panels").append(this.card);
    this.close = new Picture(enlarged, `Panel ${number}, enlarged`);
  }

  /** @param {any} panel @param {HTMLImageElement | null} image */
  show(panel, image) {
    this.card.classList.toggle("old", !panel.bits);
    sayAt(this.why, panel.bits ? "" : `Not read: ${panel.why}`);
    if (!panel.bits) {
      fillTerms(this.pose, []);
      return;
    }
    this.card.classList.remove("unread");
    showReading(this.leds, this.bits, { ...panel, orientation: orientationOf(panel) });
    fillTerms(this.pose, poseRows(panel.pose));
    if (!image) return;
    this.close.showImage(image);
    this.close.showCorners(cornersIn(panel.picture, panel.corners_px));
    this.close.describe(`bits ${panel.bits}`);
  }
}

/** @param {any} panel */
function orientationOf({ turned_deg: degrees, is_mirrored: isMirrored }) {
  const words = [degrees ? `turned by ${degrees}°` : "", isMirrored ? "mirrored" : ""].filter((word) => word);
  return words.join(", ") || null;
}

/** @param {number} value @param {number} sigma @param {string} unit @returns {string} To the digits that are known, as `vocc` prints it. */
function withSigma(value, sigma, unit) {
  const digits = Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(Math.max(sigma, 1e-9)))));
  const shown = value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
  return `${shown} ± ${sigma.toFixed(digits)}${unit === "°" ? "" : NO_BREAK}${unit}`;
}

/** @param {any} pose @returns {[string, string][]} */
function poseRows(pose) {
  if (!pose.known) return [["Pose", `not known: ${pose.why}`]];
  /** @type {[string, string, string, string][]} */
  const numbers = [
    ["Range", "range", "m", "m"], ["Bearing", "azimuth", "deg", "°"], ["Elevation", "elevation", "deg", "°"],
    ["Yaw", "yaw", "deg", "°"], ["Comes nearer at", "closing_speed", "m_s", "m/s"], ["Here in", "time_to_collision", "s", "s"],
  ];
  const known = numbers.filter(([, key, unit]) => Number.isFinite(pose[`${key}_${unit}`]));
  return known.map(([name, key, unit, shown]) => [name, withSigma(pose[`${key}_${unit}`], pose[`${key}_sigma_${unit}`], shown)]);
}

/** @param {any} picture @param {number[][]} corners In the frame's pixels. @returns {number[][]} In the picture's. */
function cornersIn({ left, top, step }, corners) {
  return corners.map(([x, y]) => [(x - left + 0.5) / step - 0.5, (y - top + 0.5) / step - 0.5]);
}

/** @param {any} picture @returns {Promise<HTMLImageElement | null>} */
function decoded(picture) {
  const image = new Image();
  image.src = `data:image/jpeg;base64,${picture?.jpeg ?? ""}`;
  return image.decode().then(() => image, () => null);
}

/** Decodes one frame at a time. Of those that come meanwhile only the newest is shown. @param {any} frame */
async function offerFrame(frame) {
  view.waiting = frame;
  if (view.isDecoding) return;
  view.isDecoding = true;
  try {
    while (view.waiting) {
      const next = view.waiting;
      view.waiting = null;
      await showFrame(next);
    }
  } finally {
    view.isDecoding = false;
  }
}

/** @param {any} frame */
async function showFrame(frame) {
  const connection = view.connections;
  const images = await Promise.all([frame, ...frame.panels].map(({ picture }) => decoded(picture)));
  if (connection !== view.connections) return;
  const latency = frame.latency_s === null ? "" : `, latency ${shortTime(frame.latency_s)}`;
  const dropped = frame.dropped > 0 ? `, ${several(frame.dropped, "frame")} dropped` : "";
  const rate = `, ${short(frame.symbol_rate_hz)} symbols a second`;
  sayAt(byId("frame"), `Frame ${frame.frame}: ${frame.size_px.join(" × ")} pixels${rate}${latency}${dropped}`);
  const [image, ...enlarged] = images;
  const read = frame.panels.filter((/** @type {any} */ panel) => panel.bits);
  if (image) {
    view.picture.showImage(image);
    view.picture.showOutlines(read.map((/** @type {any} */ panel) => cornersIn(frame.picture, panel.corners_px)));
    view.picture.describe(`frame ${frame.frame}, ${several(read.length, "panel")} outlined`);
  }
  frame.panels.forEach((/** @type {any} */ panel, /** @type {number} */ at) => cardOf(panel.panel).show(panel, enlarged[at]));
}

/** @param {number} number @returns {PanelCard} */
function cardOf(number) {
  let card = view.panels.get(number);
  if (!card) view.panels.set(number, card = new PanelCard(number));
  return card;
}

/** @param {any} message */
function showMessage({ times, report, proof }) {
  const { panel, message, message_hex: hex = null } = report ?? proof;
  const key = JSON.stringify([panel, message, hex]);
  const place = view.texts.get(key) ?? make("p");
  view.texts.delete(key);
  view.texts.set(key, place);
  // Bytes that are no text differ in their digits only.
  const isText = !hex || !message.includes("\ufffd");
  const notes = [view.panels.size > 1 ? [`panel ${panel}`] : [], report ? noteOf(report, times) : []].flat();
  showReceived(place, isText ? message : `bytes ${hex}`, notes.join(", "));
  showVerdict(place, proof ?? report);
  byId("texts").append(place);
  while (view.texts.size > TEXTS_MAX) dropOldestText();
  byId("no-texts").hidden = true;
}

/** Drops the text that was not received for the longest time. */
function dropOldestText() {
  const [[key, place]] = view.texts;
  view.texts.delete(key);
  place.remove();
}

/** @param {any} report @param {number} times @returns {string[]} */
function noteOf({ first_frame: first, last_frame: last, corrected_bits: corrected, latency_s: latency }, times) {
  const words = [`frames ${first} to ${last}`, `${several(corrected, "bit")} corrected`];
  if (latency !== undefined) words.push(`latency ${shortTime(latency)}`);
  if (times > 1) words.push(`${times} times so far`);
  return words;
}

/** @param {any} remark */
function showRemark({ text }) {
  byId("remarks-card").hidden = false;
  const same = [...byId("remarks").children].find((item) => item.textContent === text);
  byId("remarks").append(same ?? make("li", { textContent: text }));
  while (byId("remarks").children.length > 16) byId("remarks").firstChild.remove();
}

/** @param {any} source */
function showSource({ name, is_live: isLive, is_checked: isChecked }) {
  sayAt(byId("source"), name);
  document.title = `${name} – vocc receive`;
  byId("unchecked").hidden = isChecked;
  sayAt(byId("state"), isLive ? "Live" : "Receiving …");
}

/** @param {any} end */
function showEnd({ why, frames, messages, latency }) {
  sayAt(byId("state"), `Ended: ${several(frames, "frame")}, ${several(messages, "message")}. This page keeps the last state.`);
  sayAt(byId("alert"), why ?? "");
  const names = { to_text: "All", source: "Source", queue: "Queue", reading: "Reading", decoding: "Decoding" };
  const parts = Object.entries(names).filter(([key]) => latency?.[key]);
  const rows = parts.map(([key, name]) => [name, `${shortTime(latency[key].median_s)}, worst ${shortTime(latency[key].worst_s)}`]);
  fillTerms(byId("latency"), /** @type {[string, string][]} */ (rows));
  byId("latency-card").hidden = rows.length === 0;
}

/** Each connection begins with all that there is. */
function clear() {
  view.texts.clear();
  view.panels.clear();
  view.waiting = null;
  view.connections += 1;
  for (const id of ["texts", "panels", "remarks"]) byId(id).replaceChildren();
  byId("no-texts").hidden = false;
  byId("remarks-card").hidden = byId("latency-card").hidden = true;
  sayAt(byId("alert"), "");
}

function connect() {
  const events = new EventSource("/events");
  events.addEventListener("open", clear);
  const shows = { source: showSource, frame: offerFrame, message: showMessage, remark: showRemark, end: showEnd };
  for (const [name, show] of Object.entries(shows)) {
    events.addEventListener(name, (/** @type {MessageEvent} */ event) => show(JSON.parse(event.data)));
  }
  // There is nothing after the end.
  events.addEventListener("end", () => events.close());
  events.addEventListener("error", () => {
    sayAt(byId("state"), "Not connected");
    sayAt(byId("alert"), "vocc does not answer: it was stopped. This page keeps the last state, and goes on if vocc starts again.");
  });
}

function redraw() {
  readColours();
  redrawLeds();
}

view.picture = new Picture(byId("picture"), "The camera's picture");
redraw();
window.addEventListener("resize", whenRested(100, redraw));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
connect();
