/** The page: its tabs and its start. */

/** @param {string} mode */
function showMode(mode) {
  settings.fields.mode = mode;
  for (const name of MODES) {
    const tab = byId(`tab-${name}`);
    const isShown = name === mode;
    tab.setAttribute("aria-selected", String(isShown));
    tab.tabIndex = isShown ? 0 : -1;
    byId(`panel-${name}`).hidden = !isShown;
  }
  byId("settings").hidden = mode === "receive";
  byId("main").classList.toggle("alone", mode === "receive");
  if (mode !== "good") stopGood();
  if (mode !== "explore") stopCosts();
  if (mode !== "send" && !byId("send-stop").disabled) stopSending("Stopped.");
  // A camera that is not visible is switched off.
  if (mode !== "receive") endFilm();
  redrawLeds();
  showCommand();
}

/** @param {string} mode */
function chooseMode(mode) {
  sayWrong("");
  say("");
  showMode(mode);
  settingsChanged();
}

function makeTabs() {
  const tabs = MODES.map((mode) => byId(`tab-${mode}`));
  tabs.forEach((tab, at) => {
    tab.addEventListener("click", () => chooseMode(MODES[at]));
    tab.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
      const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      const next = (to + tabs.length) % tabs.length;
      chooseMode(MODES[next]);
      tabs[next].focus();
    });
  });
}

/** Shows the settings other than the scene's in their inputs. */
function showFields() {
  const { fields } = settings;
  const places = { frames: "good-frames", measure: "measure", curve: "curve-detector", message: "message",
    detector: "send-detector", fps: "fps", rate: "symbol-rate", pace: "pace", sendpace: "send-pace" };
  for (const [name, id] of Object.entries(places)) byId(id).value = fields[name];
  byId("frame").value = fields.frame || "0";
  byId("as-film").checked = fields.film === "yes";
  for (const choice of document.querySelectorAll('input[name="show"]')) {
    const input = /** @type {HTMLInputElement} */ (choice);
    input.checked = input.value === fields.show;
  }
  showLeft(fields.message);
}

/** Applies an address that was typed or pasted while the page was open. */
function followAddress() {
  sayWrong("");
  readAddress();
  scene.isFromAddress = true;
  showFields();
  showMode(settings.fields.mode);
  pauseAsTold();
  openScene();
}

/** Redraws everything that depends on the window's size or the browser's colours. */
const redraw = whenRested(100, () => {
  readColours();
  if (explore.seen && settings.fields.mode === "explore") drawSeen(explore.seen);
  if (settings.fields.mode === "good") showCurve();
  redrawLeds();
  if (accuracy.scale > 0 && settings.fields.mode === "accuracy") drawDifferenceScale(accuracy.scale);
});

async function begin() {
  readColours();
  readAddress();
  makeTabs();
  makeSettings();
  makeExplore();
  makeGood();
  makeAccuracy();
  makeSend();
  makeReceive();
  makeTake();
  showFields();
  showMode(settings.fields.mode);
  window.addEventListener("hashchange", followAddress);
  window.addEventListener("resize", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  const { answer } = await live.ask({ do: "presets" });
  presets = answer.presets;
  fillScenes();
  fillCameras();
  const wrong = FIELDS.scene.wrong(settings.fields.scene);
  if (wrong) {
    sayNonsense(`The scene ${wrong}, not “${settings.fields.scene.slice(0, 40)}”.`);
    settings.fields.scene = FIELDS.scene.usual;
  }
  const firstPicture = /** @type {Promise<void>} */ (new Promise((done) => { announceFirstPicture = done; }));
  await openScene();
  if (settings.fields.mode === "explore" && scene.opened) await firstPicture;
}

const begun = begin();
begun.catch(sayError);

/**
 * For tests and the console. `ready` resolves once a scene is open, and in Explore its first picture is shown (`firstPictureMs` after the
 * page's start). `ask(request, bytes)` sends a request to the simulator's worker, like the page's own requests. `stats` counts Explore's
 * frames, and those of the last second.
 */
/** @type {any} */ (window).vocc = {
  ready: begun,
  get firstPictureMs() {
    return firstPictureMs;
  },
  ask: (/** @type {any} */ request, /** @type {Uint8Array | undefined} */ bytes) => live.ask(request, bytes),
  stats,
};
