/** One panel of the Receive tab: enlarged, its bits as lamps, its pose, or why it was not read. */

class PanelCard {
  /** @param {number} number */
  constructor(number) {
    const enlarged = make("div", { className: "picture" });
    this.leds = make("canvas", { className: "leds" });
    this.leds.setAttribute("role", "img");
    this.leds.setAttribute("aria-label", "Nothing read yet");
    const heading = make("h2", {}, ["Panel", make("span", { textContent: ` ${number}` })]);
    const figures = [enlarged, this.leds].map((shown) => make("figure", {}, [shown]));
    this.bits = make("p", { className: "quiet bits" });
    this.why = make("p", { className: "why" });
    this.pose = make("dl");
    this.card = make("section", { className: "card unread" }, [heading, ...figures, this.bits, this.why, this.pose]);
    this.close = new Picture(enlarged, `Panel ${number}, enlarged`);
  }

  /** @param {any} panel @param {(close: Picture) => void} enlarge Paints the panel and its surroundings. */
  show(panel, enlarge) {
    this.card.classList.toggle("old", !panel.bits);
    sayAt(this.why, panel.bits ? "" : `Not read: ${panel.why}`);
    fillTerms(this.pose, panel.pose ? poseRows(panel.pose) : []);
    if (!panel.bits) return;
    this.card.classList.remove("unread");
    const bits = ledsOf(panel.bits);
    drawLeds(this.leds, bits);
    this.leds.setAttribute("aria-label", `Bits read, row by row: ${spellLeds(bits)}`);
    sayAt(this.bits, bitsWords(panel));
    enlarge(this.close);
    this.close.describe(`bits ${panel.bits}`);
  }

  remove() {
    drawnLeds.delete(this.leds);
    this.card.remove();
  }
}

/** @param {any} panel */
function bitsWords({ bits, confidence, symbol = null, orientation }) {
  const words = [`Bits ${bits}`, `held right by ${short(100 * confidence, 4)} %`];
  if (symbol !== null) words.push(`symbol ${symbol}`);
  if (orientation) words.push(orientation);
  return words.join(", ");
}

/** @param {any} pose @returns {[string, string][]} */
function poseRows(pose) {
  if (!pose.known) return [["Pose", `not known: ${pose.why}`]];
  /** @type {[string, string, string, string][]} */
  const numbers = [
    ["Range", "range", "m", "m"], ["Bearing", "azimuth", "deg", "°"], ["Elevation", "elevation", "deg", "°"],
    ["Yaw", "yaw", "deg", "°"], ["Comes nearer at", "closing_speed", "m_s", "m/s"], ["Here in", "time_to_collision", "s", "s"],
  ];
  const known = numbers.filter(([, key, unit]) => Number.isFinite(pose[`${key}_${unit}`]));
  return known.map(([name, key, unit, shown]) => [name, withSigma(pose[`${key}_${unit}`], pose[`${key}_sigma_${unit}`], shown)]);
}

/** @param {number} value @param {number} sigma @param {string} unit @returns {string} To the digits that are known, as `vocc` prints it. */
function withSigma(value, sigma, unit) {
  const digits = Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(Math.max(sigma, 1e-9)))));
  const shown = value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
  return `${shown} ± ${sigma.toFixed(digits)}${unit === "°" ? "" : NO_BREAK}${unit}`;
}
