/** Send: transmits a text over the simulated road; it may arrive or not. */

const sending = {
  /** Increases with each run, and when one is stopped. */
  run: 0,
  /** @type {Picture | null} */
  picture: null,
};

function makeSend() {
  sending.picture = new Picture(byId("send-picture"), "What the camera sees of the panel");
  byId("message").addEventListener("input", () => {
    const text = byId("message").value;
    showLeft(text);
    if (wrongMessage(text)) return;
    settings.fields.message = text;
    writeAddress();
    showCommand();
  });
  byId("send-detector").addEventListener("change", () => {
    settings.fields.detector = byId("send-detector").value;
    writeAddress();
    showCommand();
  });
  byId("send-pace").addEventListener("change", () => {
    settings.fields.sendpace = byId("send-pace").value;
    writeAddress();
  });
  byId("send-form").addEventListener("submit", (/** @type {Event} */ event) => {
    event.preventDefault();
    startSending();
  });
  byId("send-stop").addEventListener("click", () => stopSending("Stopped."));
}

/** Shows the number of bytes left; letters outside ASCII take 2 to 4. @param {string} text */
function showLeft(text) {
  const left = LONGEST_MESSAGE - new TextEncoder().encode(text).length;
  const isEmpty = text.length === 0;
  byId("message-left").textContent = left < 0
    ? `${several(-left, "byte")} too long: a message has at most ${LONGEST_MESSAGE}.`
    : isEmpty ? "Type at least one letter." : `${several(left, "byte")} left.`;
  byId("message").setAttribute("aria-invalid", String(left < 0 || isEmpty));
  return left >= 0 && !isEmpty;
}

/** @param {string} text */
function stopSending(text) {
  sending.run += 1;
  byId("send-start").disabled = false;
  byId("send-stop").disabled = true;
  if (text) byId("send-state").textContent = text;
}

function clearSent() {
  byId("send-arrived").textContent = "";
  byId("send-advice").replaceChildren();
  byId("send-numbers").replaceChildren();
  byId("send-wrong").textContent = "";
}

async function startSending() {
  const message = byId("message").value;
  if (!showLeft(message)) {
    byId("send-state").textContent = message ? "The text is too long to be sent: shorten it." : "There is nothing to send: type a text.";
    byId("message").focus();
    return;
  }
  const run = (sending.run += 1);
  clearSent();
  byId("send-start").disabled = true;
  byId("send-stop").disabled = false;
  byId("send-state").textContent = "The panel begins …";
  try {
    await runSending(run, message);
  } catch (error) {
    if (run === sending.run) stopSending("The sending ended early.");
    sayError(error);
  }
}

/** @param {number} run @param {string} message */
async function runSending(run, message) {
  const { detector } = settings.fields;
  const request = { do: "send", scene: sceneRequest(), level: levelHere(), message, detector, seed: seedRequest() };
  const { answer: begun } = await live.ask(request);
  if (run !== sending.run) return;
  showBegun(begun);
  /** @type {any} */
  let told = null;
  for (let frame = 0; frame < begun.frames && run === sending.run; frame += 1) {
    const began = performance.now();
    const heard = await live.ask({ do: "send_on" });
    if (run !== sending.run) return;
    told = heard.answer;
    if (told.ended) break;
    showSentFrame(told, heard.bytes, begun);
    if (told.delivered) break;
    // Slow enough to watch, or as fast as the screen.
    const pace = Number(settings.fields.sendpace);
    if (pace > 0) await wait(Math.max(0, pace - (performance.now() - began)));
    else if (frame % 8 === 7) await new Promise((done) => requestAnimationFrame(done));
  }
  if (run !== sending.run) return;
  const { answer: end } = await live.ask({ do: "send_end" });
  if (run !== sending.run) return;
  showSendingEnd(end, told);
}

/** @param {any} carrier @returns {string} */
function flickerOf({ pst_lm: pst, svm, longest_period_s: period }) {
  return `P_st ${short(pst, 2)}, SVM ${short(svm, 2)} (at 1, half of all people see it), longest flicker period ${shortTime(period)}`;
}

/** @param {any} begun */
function showBegun(begun) {
  const seconds = begun.frames / begun.frame_rate_hz;
  byId("send-progress").max = begun.frames;
  byId("send-progress").value = 0;
  const { carrier } = begun;
  const times = carrier && `${short(carrier.hz)} Hz, ${short(carrier.low_risk_times, 2)} times the limit of low risk`;
  fillTerms(byId("send-numbers"), [
    ["Carrier", carrier ? `${times}: ${carrier.low_risk_times <= 1 ? "no visible flicker" : "flicker"}` : "none: still panels flicker"],
    ...(carrier ? [["Flicker of the worst LED", flickerOf(carrier)]] : []),
    ["Symbols of one repeat", short(begun.panels, 6)],
    ["Given up after", `${several(begun.frames, "frame")} (${shortTime(seconds)})`],
    ["L2A", short(begun.l2a)],
    ["Luminance of an On LED", `${short(begun.luminance_cd_m2)} cd/m²`],
    ["Exposure", `${shortTime(begun.exposure_s)}, ISO ${short(begun.iso)}`],
  ]);
}

/** @param {any} told @param {Uint8Array} grey @param {any} begun */
function showSentFrame(told, grey, { frames, region }) {
  const sent = ledsOf(told.sent);
  const read = told.read ? ledsOf(told.read) : null;
  drawLeds(byId("send-sent"), sent);
  drawLeds(byId("send-read"), read, sent);
  sending.picture.showGrey(grey, region.width, region.height);
  sending.picture.showCorners(told.corners_px);
  const wrong = !read ? "nothing" : told.bit_errors === 0 ? "all right" : `${told.bit_errors} wrong`;
  byId("send-wrong").textContent = wrong;
  byId("send-sent").setAttribute("aria-label", `Shown: ${spellLeds(sent)}`);
  byId("send-read").setAttribute("aria-label", `Read, ${wrong}: ${read ? spellLeds(read) : ""}`);
  byId("send-progress").value = told.frame + 1;
  // Not a status per frame, because a screen reader would read nothing else.
  const line = told.why ? sentence(told.why) : told.straddled ? "The exposure caught two symbols." : "Read.";
  sending.picture.describe(`frame ${told.frame} of ${frames}. ${line}`);
}

/** @param {any} end @param {any} last */
function showSendingEnd(end, last) {
  const { delivered } = end;
  stopSending(delivered ? arrivalWords(delivered) : "It did not arrive.");
  byId("send-arrived").textContent = delivered ? delivered.message : "";
  const advice = [...end.advice];
  if (last?.ended) advice.unshift(last.ended);
  byId("send-advice").replaceChildren(...advice.map((text) => make("li", { textContent: sentence(text) })));
  const rate = end.bits > 0 ? ` (${short((100 * end.bit_errors) / end.bits, 2)} %)` : "";
  byId("send-numbers").append(
    make("dt", { textContent: "Wrong bits before correction" }),
    make("dd", { textContent: `${short(end.bit_errors, 9)} of ${short(end.bits, 9)}${rate}` }),
    make("dt", { textContent: "Frames not read" }),
    make("dd", { textContent: `${end.unread} of ${end.frames}` }),
  );
}

/** @param {any} delivered */
function arrivalWords({ first_frame: first, last_frame: last, corrected_bits: corrected, is_right: isRight }) {
  if (isRight === false) return "Something arrived that was not sent:";
  const fixed = corrected > 0 ? `, ${several(corrected, "wrong bit")} corrected on the way` : "";
  return `It arrived, read from frame ${first} to ${last}${fixed}:`;
}
