/** The places where the page talks: `alert` for what went wrong, `status` for the rest. */

/** @param {string} text What went wrong, as a sentence; nothing takes the last one away. */
function sayWrong(text) {
  sayAt(byId("alert"), text);
}

/** @param {string} text */
function say(text) {
  sayAt(byId("status"), text);
}

/** @param {unknown} error */
function sayError(error) {
  // What was given up on purpose needs no words.
  if (error instanceof GivenUp) return;
  sayWrong(sentence(error instanceof Error ? error.message : String(error)));
}

/** @param {string} text As the receiver and the simulator say it. @returns {string} The same as a sentence. */
function sentence(text) {
  // A key of scene files is called as its slider is, and no number has more digits than anyone reads.
  const named = CONTROLS.reduce((known, { key, label }) => known.replaceAll(key, label), text.trim());
  const words = named.replace(/\d+\.\d{4,}/g, (number) => short(Number(number), 4));
  // A key without a slider is written as it is, such as camera.gamma.
  const first = /^\w+\.\w/.test(words) ? words.charAt(0) : words.charAt(0).toUpperCase();
  return `${first}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}`;
}

/** What a request ends with when its worker was ended on purpose. */
class GivenUp extends Error {}
