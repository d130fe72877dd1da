/**
 * The Receive tab: what a receiver reports, wherever it runs. `sources.js` feeds it from the receiver in this page's worker, and
 * `vocc receive --view`, which serves the same tab, from the events of the program.
 */

/** Maximum number of remarks that stay. */
const REMARKS_MAX = 16;

const received = {
  /** @type {Picture | null} */
  picture: null,
  /** By number. @type {Map<number, PanelCard>} */
  panels: new Map(),
  /** The beginning of the state, while a film or a camera is read. */
  kind: "",
};

function makeReceived() {
  received.picture = new Picture(byId("receive-picture"), "The camera's picture");
}

function clearReceived() {
  clearMessages();
  received.panels.forEach((card) => card.remove());
  received.panels.clear();
  received.kind = "";
  byId("remarks").replaceChildren();
  for (const id of ["receive-stage", "latency-card", "remarks-card", "learnt-card"]) byId(id).hidden = true;
  sayState("");
  sayWrong("");
}

/** @param {string} text */
function sayState(text) {
  sayAt(byId("receive-state"), text);
}

/** Says how far the reading of a film or a camera has come. @param {string} text */
function sayProgress(text) {
  if (received.kind) sayState(`${received.kind}: ${text}`);
}

/** @param {any} source As the event `source` of `vocc receive --view`; `about` is what else is known of it. */
function showSource({ name, about = "", is_live: isLive, is_checked: isChecked }) {
  received.kind = isLive ? "Live" : "Receiving";
  byId("messages-card").hidden = false;
  byId("unchecked").hidden = isChecked;
  sayProgress(`looking for a panel in ${name}${about} …`);
}

/**
 * Shows a frame, whose picture has been painted.
 * @param {any} told As the event `frame`. Single pictures have a name instead of a number.
 * @param {(close: Picture, panel: any, at: number) => void} enlarge Paints one of its panels and its surroundings.
 */
function showReceivedFrame(told, enlarge) {
  byId("receive-stage").hidden = false;
  const caption = captionOf(told);
  sayAt(byId("receive-says"), caption);
  const read = told.panels.filter((/** @type {any} */ panel) => panel.bits);
  received.picture.showOutlines(read.map((/** @type {any} */ panel) => cornersIn(told.picture, panel.corners_px)));
  received.picture.describe(`${caption}, ${several(read.length, "panel")} outlined`);
  told.panels.forEach((/** @type {any} */ panel, /** @type {number} */ at) => {
    cardOf(panel.panel).show(panel, (close) => enlarge(close, panel, at));
  });
  if (read.length > 0 && messages.size === 0) sayProgress("a panel is followed; no message yet …");
  showLearnt(told);
}

/** @param {any} told @returns {string} */
function captionOf({ frame, name = `Frame ${frame}`, size_px: size, symbol_rate_hz: rate = null, latency_s: latency = null, dropped = 0 }) {
  const words = [`${name}: ${size.join(" × ")} pixels`];
  if (rate !== null) words.push(`${short(rate)} symbols a second`);
  if (latency !== null) words.push(`latency ${shortTime(latency)}`);
  if (dropped > 0) words.push(`${several(dropped, "frame")} dropped`);
  return words.join(", ");
}

/** @param {any} picture Where it is in its frame; the whole frame by default. @param {number[][]} corners In the frame. */
function cornersIn(picture, corners) {
  const { left, top, step } = picture ?? { left: 0, top: 0, step: 1 };
  return corners.map(([x, y]) => [(x - left + 0.5) / step - 0.5, (y - top + 0.5) / step - 0.5]);
}

/** @param {number} number @returns {PanelCard} */
function cardOf(number) {
  let card = received.panels.get(number);
  if (!card) {
    card = new PanelCard(number);
    received.panels.set(number, card);
    byId("receive-panels").append(card.card);
  }
  return card;
}

/** @param {{text: string}} remark */
function showRemark({ text }) {
  byId("remarks-card").hidden = false;
  const items = byId("remarks").children;
  byId("remarks").append([...items].find((item) => item.textContent === text) ?? make("li", { textContent: text }));
  while (items.length > REMARKS_MAX) items[0].remove();
}

/** The learnt properties in the order of display. */
const LEARNT_NAMES = {
  encoding: "Curve", black_grey: "Grey of no light", blur_sigma_px: "Blur, px", blur_deviation_px: "Blur, how sure, px",
  blur_aspect: "Blur along x over along y", noise_grey: "Noise, grey levels", read_noise_e: "Read noise, electrons",
  line_delay_exposures: "Line after line, exposures", broken_leds: "Broken LEDs", frames: "Learnt from frames",
};

/** @param {any} told */
function showLearnt({ camera, camera_text: text = "" }) {
  if (!camera) return;
  byId("learnt-card").hidden = false;
  sayAt(byId("learnt-text"), text && sentence(text));
  const keys = new Set([...Object.keys(LEARNT_NAMES), ...Object.keys(camera)]);
  const known = [...keys].filter((key) => key in camera);
  const rows = known.map((key) => [LEARNT_NAMES[key] ?? key.replace(/_/g, " "), plainValue(camera[key])]);
  fillTerms(byId("learnt"), /** @type {[string, string][]} */ (rows));
}

/** @param {any} value @returns {string} Any learnt value in one line. */
function plainValue(value) {
  if (value === null || value === undefined) return "not known";
  if (typeof value === "number") return short(value, 4);
  if (Array.isArray(value)) return value.length === 0 ? "none" : value.map(plainValue).join(", ");
  if (typeof value === "object") return Object.entries(value).map(([key, inner]) => `${key} ${plainValue(inner)}`).join(", ");
  return String(value);
}

/** @param {any} end As the event `end`. */
function showEnd({ frames, read, messages: count, latency = null }) {
  // The last frame may be shown after the end.
  received.kind = "";
  const came = count > 0 ? several(count, "message") : "no message";
  sayState(`Ended: ${came} came; a panel was read in ${short(read, 9)} of ${several(frames, "frame")}.`);
  const names = { to_text: "All", source: "Source", queue: "Queue", reading: "Reading", decoding: "Decoding" };
  const parts = Object.entries(names).filter(([key]) => latency?.[key]);
  const rows = parts.map(([key, name]) => [name, `${shortTime(latency[key].median_s)}, worst ${shortTime(latency[key].worst_s)}`]);
  fillTerms(byId("latency"), /** @type {[string, string][]} */ (rows));
  byId("latency-card").hidden = rows.length === 0;
}
