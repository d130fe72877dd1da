/** The controls of a scene: each sets one key of scene files. */

/**
 * @typedef {object} Control
 * @property {string} key The scene's key.
 * @property {string} label
 * @property {string} unit
 * @property {number} low The slider's minimum.
 * @property {number} high The slider's maximum.
 * @property {boolean} [log] Whether the slider is logarithmic.
 * @property {number} [step] The step to which values are rounded; by default three digits.
 * @property {[number, number]} allowed The range that scenes allow; a typed number may exceed the slider's range.
 * @property {string} hint
 * @property {string} [unset] The label for a scene without the key, which may be left out.
 * @property {boolean} [keeps] Whether it keeps its value if another scene is chosen.
 */

/** @type {Control[]} */
const CONTROLS = [
  { key: "ambient.illuminance_lx", label: "Light", unit: "lx", low: 0.1, high: 200_000, log: true,
    allowed: [0.1, 200_000], hint: "Moon 0.1, street 50, dusk 500, sun 100 000" },
  { key: "pose.distance_m", label: "Distance", unit: "m", low: 2, high: 200, log: true, allowed: [0.5, 2000],
    keeps: true, hint: "From the camera to the panel" },
  { key: "panel.interval", label: "Interval", unit: "× LED", low: 0.25, high: 3, step: 0.05, allowed: [0.05, 10],
    hint: "The gap between LEDs, in LED diameters" },
  { key: "link.l2a", label: "L2A", unit: "1/sr", low: 0.05, high: 10, log: true, allowed: [0.01, 10],
    hint: "LEDs' own light over daylight they reflect" },
  { key: "camera.blur_sigma_px", label: "Blur", unit: "px", low: 0, high: 5, step: 0.05, allowed: [0, 20],
    hint: "How wide the lens draws a point" },
  { key: "panel.board_reflectance", label: "Board", unit: "part", low: 0.02, high: 0.9,
    step: 0.01, allowed: [0, 1], unset: "yes", hint: "Behind the LEDs: black 0.05, white 0.9" },
  { key: "atmosphere.transmission_at_70m", label: "Weather", unit: "part", low: 0.01, high: 1, log: true,
    allowed: [1e-6, 1], hint: "Light left after 70 m: clear 0.99, fog 0.27" },
  { key: "pose.yaw_deg", label: "Turned", unit: "°", low: -60, high: 60, step: 1, allowed: [-80, 80],
    keeps: true, hint: "The panel to the left or to the right" },
  { key: "pose.roll_deg", label: "Tilted", unit: "°", low: -45, high: 45, step: 1, allowed: [-180, 180],
    keeps: true, hint: "The panel to one side" },
  { key: "pose.velocity_m_s", label: "Speed", unit: "m/s", low: -50, high: 50, step: 1, allowed: [-200, 200],
    keeps: true, hint: "At which it comes nearer; negative: away" },
  { key: "link.carrier_cycles", label: "Carrier", unit: "cycles", low: 2, high: 33, step: 1, allowed: [0, 333],
    unset: "yes", hint: "A symbol; 16 at 90 symbols a second: no visible flicker" },
];
for (const { key, label } of CONTROLS) keyLabels.set(key, label);

const VELOCITY = "pose.velocity_m_s";
const L2A = "link.l2a";
const NOISE = "effects.noise";
const AIRLIGHT = "atmosphere.airlight";
const TABLE = "table";

/**
 * The place of a value on a control's slider, 0 to 1.
 * @param {Control} control
 * @param {number} value
 */
function placeOf({ low, high, log }, value) {
  const place = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.min(1, Math.max(0, place));
}

/**
 * The value at a place of a control's slider, rounded as a user would type it.
 * @param {Control} control
 * @param {number} place 0 to 1.
 */
function valueAt({ low, high, log, step }, place) {
  const value = log ? low * (high / low) ** place : low + (high - low) * place;
  return step ? Number((Math.round(value / step) * step).toFixed(6)) : Number(value.toPrecision(3));
}

/**
 * The scene's value for a control's key; null if it has none.
 * @param {any} values The scene, table by table.
 * @param {Control} control
 * @returns {number | null}
 */
function valueIn(values, { key }) {
  const [table, name] = key.split(".");
  const within = Array.isArray(values[table]) ? values[table][0] : values[table];
  const value = within?.[name] ?? null;
  return key === VELOCITY ? 0 - value[2] : value;
}

/**
 * A value in the format of scene files.
 * @param {Control} control
 * @param {number} value
 */
function keyText({ key }, value) {
  return key === VELOCITY ? `[0,0,${value === 0 ? 0 : -value}]` : String(value);
}

/**
 * The value of a scene's key; null if this control does not allow it.
 * @param {Control} control
 * @param {string} text
 */
function valueOf({ key, allowed }, text) {
  const velocity = /^\[[^,\]]+,[^,\]]+,([^,\]]+)\]$/.exec(text);
  if (key === VELOCITY && !velocity) return null;
  const value = key === VELOCITY ? -Number(velocity[1]) : Number(text);
  return text.trim() !== "" && value >= allowed[0] && value <= allowed[1] ? value : null;
}
