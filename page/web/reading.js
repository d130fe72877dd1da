/** What is read of a panel, as lamps and as words; also on the page of `vocc receive --view`. */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Element} words
 * @param {{bits: string, confidence: number, symbol?: number | null, orientation?: string | null}} panel
 * @param {number} [rate] Symbols a second.
 */
function showReading(canvas, words, { bits: digits, confidence, symbol, orientation }, rate) {
  const bits = ledsOf(digits);
  drawLeds(canvas, bits);
  canvas.setAttribute("aria-label", `Bits read, row by row: ${spellLeds(bits)}`);
  const shown = symbol === null || symbol === undefined ? "" : `, symbol ${symbol}`;
  const symbols = rate ? `, ${short(rate)} symbols a second` : "";
  const turned = orientation ? `, ${orientation}` : "";
  sayAt(words, `Bits ${digits}, held right by ${short(100 * confidence, 4)} %${shown}${symbols}${turned}`);
}

/** Shows a text that was received, and a note on it. @param {HTMLElement} place @param {string} text @param {string} note */
function showReceived(place, text, note) {
  // A text may turn the direction of what follows it.
  place.replaceChildren(make("bdi", { textContent: text }), make("small", { textContent: note }));
}

/** Shows the verdict on a text's signer beside it, in place of an earlier one. @param {HTMLElement} place @param {any} proof */
function showVerdict(place, { verdict, signer, signer_name: name, counter }) {
  if (!verdict) return;
  const by = signer ? ` by ${name ? `${name} (${signer})` : signer}` : "";
  const checked = verdict === "unchecked" ? `, not checked, counter ${counter}` : `${signer ? `, counter ${counter}` : ""}: ${verdict}`;
  place.querySelector(".verdict")?.remove();
  place.append(make("small", { className: `verdict ${verdict}`, textContent: `${signer ? "signed" : "signature"}${by}${checked}` }));
}
