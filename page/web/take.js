/** The equivalent command line, and the scene as a file. */

/** @param {string} text @returns {string} The text quoted for a shell. */
function quoted(text) {
  return /^[\w./:=,+-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`;
}

/** The scene's part of a command. */
function sceneWords() {
  const sets = [...settings.keys].map(([key, text]) => `--set ${quoted(`${key}=${text}`)}`);
  return [settings.fields.scene, ...sets, `--seed ${settings.fields.seed}`].join(" ");
}

/** The command that does the same as the page. */
function commandOfSettings() {
  const { mode, frame, frames, show, message, detector, fps, rate } = settings.fields;
  const render = `vocc render ${sceneWords()} --frame ${frame || 0} --out frame.png --crop --level ${levelHere()}`;
  switch (mode) {
    case "good":
      return [...COUNTED.map((name) => `vocc evaluate ${sceneWords()} --frames ${frames} --level fast --detector ${name}`),
        ...searchCommand()].join("\n");
    case "accuracy":
      return show === "straightforward" ? `# No command draws it straightforwardly; this is the picture shown:\n${render}` : render;
    case "send":
      return `vocc link ${sceneWords()} --message=${quoted(message)} --level ${levelHere()} --detector ${detector}`;
    case "receive":
      return `vocc ${receiving.command}${receiving.command.startsWith("receive") ? ratesTold(fps, rate) : ""}`;
    default:
      return render;
  }
}

/** @param {string} fps @param {string} rate */
function ratesTold(fps, rate) {
  return `${fps ? ` --fps ${fps}` : ""}${rate ? ` --symbol-rate ${rate}` : ""}`;
}

/** The search for the optimum; without options, the command searches other panels, too. @returns {string[]} */
function searchCommand() {
  if (!scene.opened) return [];
  const { panel, pose } = scene.opened.values;
  const { measure, curve } = settings.fields;
  const place = `--intervals ${panel[0].interval} --distances ${pose.distance_m} --yaws=${pose.yaw_deg}`;
  const search = `--criterion ${measure} --frames ${SEARCH_FRAMES[curve]} --tolerance 0 --detector ${curve}`;
  return [`vocc optimize ${sceneWords()} ${place} ${search}`];
}

function showCommand() {
  byId("command").value = commandOfSettings();
  byId("save-scene").hidden = settings.fields.mode === "receive";
}

/** @param {string} text @param {string} what */
async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    say(`${what} is copied.`);
  } catch {
    // If a page may not write to the clipboard, the text is selected for copying by hand.
    byId("command").value = text;
    byId("command").select();
    say("This browser does not let the page copy: the text is marked, copy it with Ctrl-C.");
  }
}

function makeTake() {
  byId("copy-command").addEventListener("click", () => copy(commandOfSettings(), "The command"));
  byId("copy-link").addEventListener("click", () => {
    history.replaceState(null, "", `#${addressOfSettings()}`);
    copy(location.href, "The address");
  });
  byId("save-scene").addEventListener("click", () => {
    if (scene.opened) download("scene.toml", scene.opened.toml);
    else say("There is no scene yet.");
  });
}
