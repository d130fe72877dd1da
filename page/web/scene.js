/** The scene that is open in the live worker: all modes except Receive show it. */

/** The worker of Explore, Accuracy, Send and Receive. */
const live = new Client("simulator", () => {
  scene.opened = null;
});

/** The worker that counts: bit error rates and curves. */
const counter = new Client("counting");

const scene = {
  /** The simulator's description of the scene; null while none is open. @type {any} */
  opened: null,
  /** Whether settings have changed since the scene was opened. */
  isStale: true,
  isOpening: false,
  /** Whether a slider is moving: frames are then drawn at the fastest level. */
  isMoving: false,
  /** Whether the settings came from the address and may contain values that the simulator rejects. */
  isFromAddress: true,
  /** Callbacks for each opened scene. @type {((opened: any) => void)[]} */
  listeners: [],
};

/** The scene in a request to a worker. */
function sceneRequest() {
  return { name: settings.fields.scene, toml: null, set: [...settings.keys].map(([key, text]) => `${key}=${text}`) };
}

/** The seed in a request to a worker. */
function seedRequest() {
  return Number(settings.fields.seed);
}

/** Opens the scene with the newest settings; while one is being opened, no other is requested. */
async function openScene() {
  scene.isStale = true;
  if (scene.isOpening) return;
  scene.isOpening = true;
  try {
    while (scene.isStale) {
      scene.isStale = false;
      await openOnce();
    }
    showWhetherOld(false);
  } catch (error) {
    // The visible frame still shows the old scene.
    showWhetherOld(true);
    sayError(error);
  } finally {
    scene.isOpening = false;
  }
}

/** @param {boolean} isOld */
function showWhetherOld(isOld) {
  byId("main").classList.toggle("old", isOld);
}

/** The level for frames in this mode. Send does not use the reference, and bits are counted in fast frames. */
function levelHere() {
  const { mode, level, show } = settings.fields;
  if (mode === "good") return "fast";
  if (mode === "accuracy" && LEVELS.includes(show)) return show;
  return mode === "send" && level === "reference" ? "fine" : level;
}

function openRequest() {
  return { do: "open", scene: sceneRequest(), level: scene.isMoving ? "fast" : levelHere(), seed: seedRequest() };
}

async function openOnce() {
  try {
    const { answer } = await live.ask(openRequest());
    scene.opened = answer;
    scene.isFromAddress = false;
    showCommand();
  } catch (error) {
    if (!scene.isFromAddress || !live.worker) throw error;
    await openWithoutNonsense(/** @type {Error} */ (error));
    return;
  }
  scene.listeners.forEach((tell) => tell(scene.opened));
}

/**
 * Drops settings of the address that the simulator rejects: first unusual keys, then all keys, then the scene.
 * @param {Error} error
 */
async function openWithoutNonsense(error) {
  const usual = new Set([...CONTROLS.map(({ key }) => key), NOISE, AIRLIGHT]);
  const unusual = [...settings.keys.keys()].filter((key) => !usual.has(key));
  if (unusual.length > 0) unusual.forEach((key) => settings.keys.delete(key));
  else if (settings.keys.size > 0) settings.keys.clear();
  else if (settings.fields.scene !== FIELDS.scene.usual) settings.fields.scene = FIELDS.scene.usual;
  else throw error;
  sayNonsense(sentence(error.message));
  await openOnce();
}

/** Reports changed settings: updates the address and reopens the scene. */
function settingsChanged() {
  scene.isMoving = false;
  writeAddress();
  showCommand();
  openScene();
}

const changedWhenRested = whenRested(200, settingsChanged);

/** Reports a moving slider: until it stops, frames are drawn at the fastest level. */
function settingsMove() {
  scene.isMoving = true;
  openScene();
  changedWhenRested();
}
