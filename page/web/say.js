/** The page's messages: `alert` for errors, `status` for the rest. */

/** @param {string} text The error as a sentence; an empty text removes the last one. */
function sayWrong(text) {
  sayAt(byId("alert"), text);
}

/** @param {string} text */
function say(text) {
  sayAt(byId("status"), text);
}

/** @param {unknown} error */
function sayError(error) {
  // An action that the user cancelled needs no message.
  if (error instanceof GivenUp) return;
  sayWrong(sentence(error instanceof Error ? error.message : String(error)));
}

/** The labels of the sliders, by the keys of scene files that they set. @type {Map<string, string>} */
const keyLabels = new Map();

/** @param {string} text A text of the receiver or the simulator. @returns {string} The text as a sentence. */
function sentence(text) {
  // Keys of scene files are replaced by their sliders' labels, and numbers are shortened to readable digits.
  const named = [...keyLabels].reduce((known, [key, label]) => known.replaceAll(key, label), text.trim());
  const words = named.replace(/\d+\.\d{4,}/g, (number) => short(Number(number), 4));
  // A key without a slider, such as camera.gamma, keeps its spelling.
  const first = /^\w+\.\w/.test(words) ? words.charAt(0) : words.charAt(0).toUpperCase();
  return `${first}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}`;
}

/** The error of a request whose worker was ended on purpose. */
class GivenUp extends Error {}
