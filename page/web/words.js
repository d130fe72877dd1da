/** Readable numbers and bits, and short helpers for the document. */

/**
 * The element with that id; the page's HTML must contain it.
 * @param {string} id
 * @returns {any}
 */
function byId(id) {
  return document.getElementById(id);
}

/**
 * @param {string} name
 * @param {Record<string, any>} [properties]
 * @param {(Node | string)[]} [children]
 * @returns {any}
 */
function make(name, properties = {}, children = []) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

/**
 * A number with this many significant digits: 10 000, 0.35, 4.7·10⁻⁵.
 * @param {number} value
 * @param {number} [digits]
 */
function short(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-3 || size >= 1e7) {
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    return `${Number(mantissa)}·10${[...String(Number(power))].map((sign) => RAISED[sign]).join("")}`;
  }
  const rounded = Number(value.toPrecision(Math.max(digits, Math.ceil(Math.log10(size + 1)))));
  const [whole, part] = String(Math.abs(rounded)).split(".");
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
  return `${rounded < 0 ? "−" : ""}${grouped}${part ? `.${part}` : ""}`;
}

/** Prevents a line break between a number and its unit. */
const NO_BREAK = "\u00a0";

/** @param {number} seconds */
function shortTime(seconds) {
  if (seconds >= 1) return `${short(seconds)}${NO_BREAK}s`;
  if (seconds >= 1e-3) return `${short(seconds * 1e3)}${NO_BREAK}ms`;
  return `${short(seconds * 1e6)}${NO_BREAK}µs`;
}

/** @param {number} count @param {string} thing */
function several(count, thing) {
  return `${short(count, 9)} ${thing}${count === 1 ? "" : "s"}`;
}

/**
 * The 64 bits of a panel, LED by LED.
 * @param {bigint | string} bits A number, or its 16 hexadecimal digits.
 */
function ledsOf(bits) {
  const number = typeof bits === "string" ? BigInt(`0x${bits}`) : bits;
  const halves = [Number(number & 0xffffffffn), Number((number >> 32n) & 0xffffffffn)];
  return Uint8Array.from({ length: 64 }, (_, led) => (halves[led >> 5] >>> (led & 31)) & 1);
}

/** @param {Uint8Array} read @param {Uint8Array} truth */
function countWrong(read, truth) {
  let wrong = 0;
  for (let led = 0; led < 64; led += 1) wrong += read[led] ^ truth[led];
  return wrong;
}

/** Sets a text if it differs: unchanged text costs the browser nothing. @param {Node} place @param {string} text */
function sayAt(place, text) {
  if (place.textContent !== text) place.textContent = text;
}

/**
 * Fills a list of terms.
 * @param {HTMLElement} list
 * @param {[string, string][]} rows
 */
function fillTerms(list, rows) {
  if (list.children.length !== 2 * rows.length) list.replaceChildren(...rows.flatMap(() => [make("dt"), make("dd")]));
  rows.flat().forEach((text, at) => sayAt(list.children[at], text));
}

/**
 * Fills a table's body; the first cell of a row is its header, and numbers are right-aligned.
 * @param {HTMLElement} table
 * @param {{cells: (string | number)[], kind?: string, title?: string}[]} rows
 */
function fillTable(table, rows) {
  const body = table.querySelector("tbody");
  if (body.rows.length !== rows.length) body.replaceChildren(...rows.map(({ cells }) => emptyRow(cells.length)));
  rows.forEach(({ cells, kind = "", title = "" }, at) => {
    const row = body.rows[at];
    if (row.title !== title) row.title = title;
    if (row.className !== kind) row.className = kind;
    cells.forEach((cell, column) => {
      const isNumber = typeof cell === "number";
      row.cells[column].classList.toggle("number", isNumber);
      sayAt(row.cells[column], isNumber ? short(cell) : cell);
    });
  });
}

/** @param {number} columns */
function emptyRow(columns) {
  const cells = Array.from({ length: columns }, (_, column) => (column === 0 ? make("th", { scope: "row" }) : make("td")));
  return make("tr", {}, cells);
}

/**
 * Calls only the last of several calls in quick succession.
 * @template {any[]} A
 * @param {number} milliseconds
 * @param {(...given: A) => void} act
 */
function whenRested(milliseconds, act) {
  let timer = 0;
  return (/** @type {A} */ ...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => act(...given), milliseconds);
  };
}

/**
 * Calls with the newest arguments, at most once per interval, because nobody reads faster.
 * @template {any[]} A
 * @param {number} milliseconds
 * @param {(...given: A) => void} act
 */
function atMostEvery(milliseconds, act) {
  let timer = 0;
  let last = -Infinity;
  /** @type {A} */
  let newest;
  return (/** @type {A} */ ...given) => {
    newest = given;
    timer ||= setTimeout(() => {
      timer = 0;
      last = performance.now();
      act(...newest);
    }, Math.max(0, last + milliseconds - performance.now()));
  };
}

/** @param {number} milliseconds */
function wait(milliseconds) {
  return new Promise((done) => setTimeout(done, milliseconds));
}

/**
 * Downloads a file to the user's computer.
 * @param {string} name
 * @param {string} text
 */
function download(name, text) {
  const address = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
