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
  // More digits than anyone reads.
  const words = text.trim().replace(/\d+\.\d{4,}/g, (number) => short(Number(number), 4));
  // A scene's key is written as it is, such as link.l2a.
  const first = /^\w+\.\w/.test(words) ? words.charAt(0) : words.charAt(0).toUpperCase();
  return `${first}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}`;
}

/** What a request ends with when its worker was ended on purpose. */
class GivenUp extends Error {}
