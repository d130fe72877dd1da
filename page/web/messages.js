/** The messages of the Receive tab, each with its signer and the verdict on it. */

/** Maximum number of different messages that stay; `vocc receive` keeps as many for a new page. */
const MESSAGES_MAX = 64;

/** By panel and text, the last received last. @type {Map<string, HTMLElement>} */
const messages = new Map();

/** @param {any} message @returns {string} The same for the same bytes of the same panel. */
function keyOf({ panel, message, message_hex: hex = null }) {
  return JSON.stringify([panel, message, hex]);
}

/**
 * Shows a message in place of an earlier report on it.
 * @param {{times: number, report: any, proof: any}} told As the event `message` of `vocc receive --view`.
 */
function showMessage({ times, report, proof }) {
  const { panel, message, message_hex: hex = null } = report ?? proof;
  const key = keyOf(report ?? proof);
  const place = messages.get(key) ?? make("p");
  messages.delete(key);
  messages.set(key, place);
  // Bytes that are no text differ in their digits only.
  const shown = hex && message.includes("\ufffd") ? `bytes ${hex}` : message;
  const of = received.panels.size > 1 ? [`panel ${panel}`] : [];
  const note = [...of, ...(report ? noteOf(report, times) : [])].join(", ");
  // A text may turn the direction of what follows it.
  place.replaceChildren(make("bdi", { textContent: shown }), make("small", { textContent: note }), ...verdictOn(proof ?? report));
  byId("texts").append(place);
  while (messages.size > MESSAGES_MAX) dropOldestMessage();
  byId("no-texts").hidden = true;
  sayProgress("a message has come; reading on …");
}

/** @param {any} report @param {number} times @returns {string[]} */
function noteOf({ first_frame: first, last_frame: last, corrected_bits: corrected, latency_s: latency }, times) {
  const words = [`frames ${first} to ${last}`, `${several(corrected, "bit")} corrected`];
  if (latency !== undefined) words.push(`latency ${shortTime(latency)}`);
  if (times > 1) words.push(`${times} times so far`);
  return words;
}

/** @param {any} proof @returns {HTMLElement[]} What is known of the signer, if anything. */
function verdictOn({ verdict, signer, signer_name: name, counter }) {
  if (!verdict) return [];
  const whom = name ? `${name} (${signer})` : signer;
  /** @type {Record<string, string>} */
  const words = {
    unchecked: `signed by ${whom}, not checked, counter ${counter}`,
    unknown: `names the key ${whom}, which is not trusted, counter ${counter}: unknown`,
    forged: `${whom} has not signed this, counter ${counter}: forged`,
  };
  const checked = signer ? `signed by ${whom}, counter ${counter}: ${verdict}` : `signature: ${verdict}`;
  return [make("small", { className: `verdict ${verdict}`, textContent: words[verdict] ?? checked })];
}

/** Drops the message that was not received for the longest time. */
function dropOldestMessage() {
  const [[key, place]] = messages;
  messages.delete(key);
  place.remove();
}

function clearMessages() {
  messages.clear();
  byId("texts").replaceChildren();
  byId("no-texts").hidden = false;
  byId("messages-card").hidden = true;
}
