/** The scene that is open in the live worker: what all modes but Receive look at. */

/** The worker of Explore, Accuracy, Send and Receive. */
const live = new Client("simulator", () => {
  scene.opened = null;
});

/** The worker that counts: bit error rates and curves. */
const counter = new Client("counting");

const scene = {
  /** What the simulator said of the scene, or nothing while none is open. @type {any} */
  opened: null,
  /** Whether settings have changed since it was opened. */
  isStale: true,
  isOpening: false,
  /** Whether a slider moves: what is seen meanwhile is drawn at the quickest level. */
  isMoving: false,
  /** Whether what is set came from the address, and may hold what the simulator does not take. */
  isFromAddress: true,
  /** Those who want to know of each scene that is opened. @type {((opened: any) => void)[]} */
  listeners: [],
};

/** The scene as the workers are told it. */
function sceneRequest() {
  return { name: settings.fields.scene, toml: null, set: [...settings.keys].map(([key, text]) => `${key}=${text}`) };
}

/** The seed as the workers are told it. */
function seedRequest() {
  return Number(settings.fields.seed);
}

/** Opens the scene with the newest settings; while one is being opened, no other is asked for. */
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
    // What is seen is still the scene of before.
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

/** How frames are drawn in this mode. Links are not filmed by the reference, and bits are counted in frames drawn quickly. */
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
 * Gives up what an address holds and the simulator does not take: first unusual keys, then all, then the scene.
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

/** Says that the settings have changed: the address follows, and the scene is opened anew. */
function settingsChanged() {
  scene.isMoving = false;
  writeAddress();
  showCommand();
  openScene();
}

const changedWhenRested = whenRested(200, settingsChanged);

/** The same of a slider that may move on: until it rests, frames are drawn quickly. */
function settingsMove() {
  scene.isMoving = true;
  openScene();
  changedWhenRested();
}
