/** The page's address contains every setting, so that a link shares a scene. */

const MODES = ["explore", "good", "accuracy", "send", "receive"];
const LEVELS = ["fast", "fine", "reference"];
const DETECTORS = ["best", "kmeans"];
const LONGEST_MESSAGE = 1024;
/** Explore counts frames in 32 bits. */
const LAST_FRAME = 2 ** 32 - 1;

/** @param {string[]} words @returns {(text: string) => string | null} */
const oneOf = (words) => (text) => (words.includes(text) ? null : `must be one of ${words.join(", ")}`);
/** @param {number} low @param {number} high @returns {(text: string) => string | null} */
const wholeFrom = (low, high) => (text) =>
  /^\d+$/.test(text) && +text >= low && +text <= high ? null : `must be a whole number from ${low} to ${high}`;
/** @param {string} text */
const rateOrNothing = (text) =>
  text === "" || (Number(text) >= 0.1 && Number(text) <= 10_000) ? null : "must be a number from 0.1 to 10 000";

/**
 * The settings in the address other than the scene's keys, each with its default and a check of its text.
 * @type {Record<string, {usual: string, wrong: (text: string) => string | null}>}
 */
const FIELDS = {
  mode: { usual: "explore", wrong: oneOf(MODES) },
  scene: { usual: "day", wrong: () => null },
  seed: { usual: "1", wrong: wholeFrom(0, Number.MAX_SAFE_INTEGER) },
  level: { usual: "fine", wrong: oneOf(LEVELS) },
  // No frame number: frames run.
  frame: { usual: "", wrong: wholeFrom(0, LAST_FRAME) },
  frames: { usual: "1000", wrong: oneOf(["1000", "10000", "100000", "1000000"]) },
  measure: { usual: "b2w", wrong: oneOf(["b2w", "ber"]) },
  curve: { usual: "kmeans", wrong: oneOf(DETECTORS) },
  show: { usual: "fast", wrong: oneOf([...LEVELS, "straightforward"]) },
  message: { usual: "Ice on the bridge", wrong: wrongMessage },
  detector: { usual: "best", wrong: oneOf(DETECTORS) },
  fps: { usual: "", wrong: rateOrNothing },
  rate: { usual: "", wrong: rateOrNothing },
  film: { usual: "no", wrong: oneOf(["no", "yes"]) },
  pace: { usual: "0", wrong: oneOf(["0", "100", "1000"]) },
  sendpace: { usual: "60", wrong: oneOf(["0", "60"]) },
};

/** The present settings: the fields, and the scene's keys that were set. */
const settings = {
  /** @type {Record<string, string>} */
  fields: Object.fromEntries(Object.entries(FIELDS).map(([name, { usual }]) => [name, usual])),
  /** @type {Map<string, string>} */
  keys: new Map(),
};

/** @param {string} text */
function wrongMessage(text) {
  const length = new TextEncoder().encode(text).length;
  return length <= LONGEST_MESSAGE ? null : `is ${length} bytes long, and ${LONGEST_MESSAGE} is the most that a message may have`;
}

/** @param {string} text A value; characters that an address may contain stay readable. */
function inAddress(text) {
  return encodeURIComponent(text.toWellFormed?.() ?? text).replace(/%20/g, "+").replace(/%(2C|5B|5D|3A|2F)/g, decodeURIComponent);
}

/** The settings as the part of the address after `#`, without defaults except for the mode and the scene. */
function addressOfSettings() {
  const fields = Object.entries(settings.fields).filter(([name, text]) => text !== FIELDS[name].usual || ["mode", "scene"].includes(name));
  return [...fields, ...settings.keys].map(([name, text]) => `${name}=${inAddress(text)}`).join("&");
}

/** Writes the address once the settings are stable, because browsers allow few changes a second. */
const writeAddress = whenRested(250, () => history.replaceState(null, "", `#${addressOfSettings()}`));

/**
 * One `name=value` of an address, or a sentence if it is invalid.
 * @param {string} part
 * @returns {{name: string, text: string} | {wrong: string}}
 */
function readPart(part) {
  const split = part.indexOf("=");
  let name = part;
  let text = "";
  try {
    name = decodeURIComponent(part.slice(0, split < 0 ? undefined : split));
    text = split < 0 ? "" : decodeURIComponent(part.slice(split + 1).replace(/\+/g, " "));
  } catch {
    return { wrong: `“${part}” cannot be read.` };
  }
  if (split < 0) return { wrong: `“${name}” says nothing: it takes a name, = and a value.` };
  if (Object.hasOwn(FIELDS, name)) {
    const wrong = FIELDS[name].wrong(text);
    return wrong ? { wrong: `${name} ${wrong}, not “${text.slice(0, 40)}”.` } : { name, text };
  }
  if (!/^[a-z0-9_]+\.[a-z0-9_]+$/.test(name)) return { wrong: `There is no setting “${name.slice(0, 40)}”.` };
  const control = CONTROLS.find(({ key }) => key === name);
  const named = name === L2A && text === TABLE;
  if (control && !named && valueOf(control, text) === null) {
    const [low, high] = control.allowed;
    return { wrong: `${name} must be a number from ${low} to ${high}, not “${text.slice(0, 40)}”.` };
  }
  return { name, text };
}

const NONSENSE = "The address has what cannot be used; the default stands instead.";

/** Adds to the message about a faulty address, and corrects the address. @param {string} why */
function sayNonsense(why) {
  const before = byId("alert").textContent;
  sayWrong(`${before.startsWith(NONSENSE) ? before : NONSENSE} ${why}`);
  writeAddress();
}

/** Reads all settings from the address. Invalid ones keep their defaults and are reported. */
function readAddress() {
  const parts = location.hash.slice(1).split("&").filter(Boolean).map(readPart);
  for (const [name, { usual }] of Object.entries(FIELDS)) settings.fields[name] = usual;
  settings.keys.clear();
  const wrongs = [];
  for (const part of parts) {
    if ("wrong" in part) wrongs.push(part.wrong);
    else if (Object.hasOwn(FIELDS, part.name)) settings.fields[part.name] = part.text;
    else settings.keys.set(part.name, part.text);
  }
  if (wrongs.length > 0) sayNonsense(wrongs.join(" "));
}
