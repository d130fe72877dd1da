/** The presets' cameras: each can film any scene. */

/** Descriptions of the cameras; others have their preset's name. */
const CAMERA_WORDS = {
  paper: "the paper's, 100 frames a second",
  "paper-18mm": "the paper's with a lens of 18 mm",
  "paper-iso3200": "the paper's with less gain",
  "day-driving": "the paper's, in a car that drives",
  phone: "a phone's, 30 frames a second",
  dashcam: "a dash camera, 60 frames a second",
  hm01b0: "a microcontroller's, of 324 × 244 pixels",
};

const SYMBOL_RATE = "link.symbol_rate_hz";

/** @typedef {{name: string, summary: string, camera: Record<string, any>, symbol_rate_hz: number}} Preset */
/** @type {Preset[]} */
let presets = [];

/**
 * Whether two cameras differ only in keys with a slider of their own.
 * @param {Record<string, any>} one
 * @param {Record<string, any>} other
 */
function isSameCamera(one, other) {
  const keys = new Set([...Object.keys(one), ...Object.keys(other)]);
  return [...keys].every((key) => one[key] === other[key] || CONTROLS.some((control) => control.key === `camera.${key}`));
}

/** The first preset with such a camera. @param {Record<string, any>} camera */
function presetOfCamera(camera) {
  return presets.find((preset) => isSameCamera(preset.camera, camera));
}

function fillCameras() {
  const own = presets.filter((preset) => presetOfCamera(preset.camera) === preset);
  const options = own.map(({ name }) => make("option", { value: name, textContent: CAMERA_WORDS[name] ?? name }));
  byId("camera").replaceChildren(...options, make("option", { value: "", textContent: "as set in the address", disabled: true }));
  byId("camera").addEventListener("change", () => chooseCamera(byId("camera").value));
}

/**
 * The keys and values that make a preset's camera film the scene: all keys in which the scene's own camera differs.
 * @param {string} name
 * @returns {[string, string][]}
 */
function keysOfCamera(name) {
  const of = (/** @type {string} */ wanted) => /** @type {Preset} */ (presets.find((preset) => preset.name === wanted));
  const [camera, own] = [of(name).camera, of(settings.fields.scene)];
  const keys = Object.keys(camera).filter((key) => camera[key] !== own.camera[key]);
  if (keys.length === 0) return [];
  // The ratio of symbols to frames stays: a camera cannot follow more symbols than frames.
  const rate = (own.symbol_rate_hz * camera.frame_rate_hz) / own.camera.frame_rate_hz;
  return [...keys.map((key) => [`camera.${key}`, String(camera[key])]), [SYMBOL_RATE, String(Number(rate.toPrecision(4)))]];
}

/** @param {string} name */
function chooseCamera(name) {
  for (const key of [...settings.keys.keys()]) if (key.startsWith("camera.") || key === SYMBOL_RATE) settings.keys.delete(key);
  for (const [key, text] of keysOfCamera(name)) settings.keys.set(key, text);
  scene.isFromAddress = false;
  sayWrong("");
  settingsChanged();
}

/** Shows which camera films. @returns {string[]} The keys that say so. */
function showCamera() {
  const name = presetOfCamera(scene.opened.values.camera)?.name ?? "";
  byId("camera").value = name;
  return name ? keysOfCamera(name).map(([key]) => key) : [];
}
