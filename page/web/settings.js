/** The form of the scene's settings. */

/** Descriptions of the presets; others have the simulator's own. */
const SCENES = {
  paper: "the paper's setting, without noise",
  "paper-18mm": "the paper, with a lens of 18 mm",
  "paper-iso3200": "the paper, with less gain",
  day: "an overcast day",
  dusk: "when it gets dark",
  night: "a lit street at night",
  "day-driving": "an overcast day, from a car that drives",
  "dusk-driving": "when it gets dark, from a car that drives",
  "night-driving": "a lit street at night, from a car that drives",
  fog: "fog by day",
  phone: "by day, through a phone's camera",
  dashcam: "by day, through a dash camera",
  hm01b0: "in a lit hall, through a microcontroller's camera",
};

/** Minimum time between changes of texts and numbers while a slider moves. */
const READ_MS = 150;

/** @typedef {{control: Control, root: any, range: any, number: any, has: any, tick: any}} Slider */
/** @type {Slider[]} */
const sliders = [];

/** @param {Control} control @returns {Slider} */
function makeSlider(control) {
  const id = `set-${control.key.split(".")[1]}`;
  const range = make("input", { type: "range", min: 0, max: 1000, step: 1, id });
  range.setAttribute("aria-describedby", `${id}-hint`);
  const number = make("input", { type: "number", step: "any", min: control.allowed[0], max: control.allowed[1] });
  number.setAttribute("aria-label", `${control.label}, ${control.unit}`);
  const tick = make("span", { className: "tick", hidden: true });
  const track = make("span", { className: "track" }, [range, tick]);
  const label = make("label", { className: "name", htmlFor: id, textContent: control.label });
  const has = control.unset ? make("input", { type: "checkbox" }) : null;
  has?.setAttribute("aria-label", `${control.label}: ${control.unset}`);
  const there = has ? [make("label", {}, [has, ` ${control.unset}`])] : [];
  const row = make("div", { className: "row" }, [label, ...there, number, make("span", { className: "unit", textContent: control.unit })]);
  const hint = make("p", { className: "hint", id: `${id}-hint`, textContent: control.hint });
  return { control, root: make("div", { className: "field slider" }, [row, track, hint]), range, number, has, tick };
}

/** The box under L2A that makes the panel follow the transmitter's table. */
function makeTableBox() {
  const box = make("input", { type: "checkbox", id: "follow-table" });
  return make("label", { id: "follow" }, [box, " follow the transmitter's table", make("span", { id: "table-says", className: "quiet" })]);
}

/** @param {string} key @param {string | null} text Null restores the scene's own value. */
function setKey(key, text) {
  noteKey(key, text);
  settingsChanged();
}

/** @param {string} key @param {string | null} text */
function noteKey(key, text) {
  if (text === null) settings.keys.delete(key);
  else settings.keys.set(key, text);
  scene.isFromAddress = false;
  sayWrong("");
}

/** @param {Slider} slider */
function listenToSlider({ control, range, number, has }) {
  range.addEventListener("input", () => {
    const value = valueAt(control, range.value / 1000);
    number.value = value;
    noteKey(control.key, keyText(control, value));
    settingsMove();
  });
  number.addEventListener("change", () => {
    const value = number.value === "" ? NaN : Number(number.value);
    const [low, high] = control.allowed;
    if (value >= low && value <= high) setKey(control.key, keyText(control, value));
    else {
      sayWrong(`${control.label} must be a number from ${short(low)} to ${short(high)} ${control.unit}.`);
      showValues();
    }
  });
  // A scene without a board has no number for it, so removing one restores the scene's own value.
  has?.addEventListener("change", () => setKey(control.key, has.checked ? keyText(control, valueAt(control, 0.1)) : null));
}

function makeSettings() {
  for (const control of CONTROLS) {
    const slider = makeSlider(control);
    if (control.key === L2A) slider.root.append(makeTableBox());
    sliders.push(slider);
    listenToSlider(slider);
  }
  byId("sliders").append(...sliders.map(({ root }) => root));
  byId("settings-form").addEventListener("submit", (/** @type {Event} */ event) => event.preventDefault());
  byId("follow-table").addEventListener("change", (/** @type {any} */ event) => {
    setKey(L2A, event.target.checked ? TABLE : String(Number((scene.opened?.l2a ?? 1).toPrecision(3))));
  });
  byId("noise").addEventListener("change", (/** @type {any} */ event) => setKey(NOISE, event.target.checked ? "on" : "off"));
  byId("airlight").addEventListener("change", (/** @type {any} */ event) => setKey(AIRLIGHT, String(event.target.checked)));
  byId("scene").addEventListener("change", (/** @type {any} */ event) => chooseScene(event.target.value));
  byId("level").addEventListener("change", (/** @type {any} */ event) => setField("level", event.target.value));
  byId("seed").addEventListener("change", (/** @type {any} */ event) => setField("seed", event.target.value));
  byId("reset").addEventListener("click", () => {
    settings.keys.clear();
    sayWrong("");
    settingsChanged();
  });
  scene.listeners.push(atMostEvery(READ_MS, showValues));
  // On a narrow screen, the picture comes first.
  if (matchMedia("(max-width: 61.99rem)").matches) byId("settings").open = false;
}

function fillScenes() {
  FIELDS.scene.wrong = oneOf(presets.map(({ name }) => name));
  const options = presets.map(({ name, summary }) => make("option", { value: name, textContent: `${name}: ${SCENES[name] ?? summary}` }));
  byId("scene").replaceChildren(...options);
}

/** @param {string} name */
function chooseScene(name) {
  settings.fields.scene = name;
  // The panel keeps its place; light, weather, camera and panel are those of the new scene.
  const kept = new Set(CONTROLS.filter(({ keeps }) => keeps).map(({ key }) => key));
  for (const key of [...settings.keys.keys()]) if (!kept.has(key)) settings.keys.delete(key);
  sayWrong("");
  settingsChanged();
}

/** @param {string} name @param {string} text */
function setField(name, text) {
  const wrong = FIELDS[name].wrong(text);
  if (wrong) {
    sayWrong(`${name} ${wrong}.`);
    showValues();
    return;
  }
  sayWrong("");
  settings.fields[name] = text;
  settingsChanged();
}

/** Whether the open scene takes its L2A from the transmitter's table. */
function followsTable() {
  const set = settings.keys.get(L2A);
  return set ? set === TABLE : /^\s*l2a\s*=\s*"/m.test(scene.opened?.toml ?? "");
}

/** Shows the values of the open scene, except where the user is typing. */
function showValues() {
  byId("scene").value = settings.fields.scene;
  const { mode } = settings.fields;
  byId("level").value = levelHere();
  byId("level").disabled = mode === "good" || mode === "accuracy";
  byId("level").querySelector('[value="reference"]').disabled = mode === "send";
  byId("seed").value = settings.fields.seed;
  if (!scene.opened) return;
  for (const slider of sliders) showSlider(slider);
  byId("follow-table").checked = followsTable();
  const { table_l2a: byTable } = scene.opened;
  byId("table-says").textContent = byTable === null ? " (it has none here)" : ` (${short(byTable)}, green mark)`;
  const noise = scene.opened.plan.find((/** @type {any} */ { effect }) => effect === "noise");
  byId("noise").checked = Boolean(noise?.included);
  byId("airlight").checked = scene.opened.values.atmosphere.airlight;
  const { ambient, pose } = scene.opened.values;
  const light = `${short(ambient.illuminance_lx)} lx, ${short(pose.distance_m)} m, L2A ${short(scene.opened.l2a)}`;
  byId("scene-summary").textContent = `${settings.fields.scene}, ${light}`;
  const known = new Set([...CONTROLS.map(({ key }) => key), NOISE, AIRLIGHT, ...showCamera()]);
  const others = [...settings.keys].filter(([key]) => !known.has(key)).map(([key, text]) => `${key} = ${text}`);
  byId("other-keys").textContent = others.length > 0 ? `Also set by the address: ${others.join(", ")}` : "";
}

/** @param {Slider} slider */
function showSlider({ control, root, range, number, has, tick }) {
  const value = control.key === L2A ? scene.opened.l2a : valueIn(scene.opened.values, control);
  const isThere = value !== null && value !== undefined;
  root.classList.toggle("set", settings.keys.has(control.key));
  if (has) has.checked = isThere;
  range.disabled = number.disabled = !isThere;
  // While a slider moves, it is ahead of the simulator.
  if (isThere && !scene.isStale) {
    const isMoved = scene.isMoving && document.activeElement === range;
    if (!isMoved) range.value = Math.round(placeOf(control, value) * 1000);
    if (document.activeElement !== number) number.value = Number(value.toPrecision(4));
    range.setAttribute("aria-valuetext", `${short(value)} ${control.unit}`);
  }
  if (control.key === L2A) {
    tick.hidden = scene.opened.table_l2a === null;
    // The centre of a slider's thumb does not reach the ends of its track.
    tick.style.left = `calc(8px + ${placeOf(control, scene.opened.table_l2a)} * (100% - 16px))`;
    tick.title = `The table's choice: ${short(scene.opened.table_l2a)}`;
  }
}
