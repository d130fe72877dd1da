/** The source of the Receive tab in `vocc receive --view`: the events that the program sends. */

const view = {
  /** The newest frame that waits for the one before it. @type {any} */
  waiting: null,
  isDecoding: false,
  /** Connections so far. */
  connections: 0,
};

/** @param {any} picture @returns {Promise<HTMLImageElement | null>} */
function decoded(picture) {
  const image = new Image();
  image.src = `data:image/jpeg;base64,${picture?.jpeg ?? ""}`;
  return image.decode().then(() => image, () => null);
}

/** Decodes one frame at a time. Of those that come meanwhile only the newest is shown. @param {any} frame */
async function offerFrame(frame) {
  view.waiting = frame;
  if (view.isDecoding) return;
  view.isDecoding = true;
  try {
    while (view.waiting) {
      const next = view.waiting;
      view.waiting = null;
      await showDecoded(next);
    }
  } finally {
    view.isDecoding = false;
  }
}

/** @param {any} frame */
async function showDecoded(frame) {
  const connection = view.connections;
  const [image, ...enlarged] = await Promise.all([frame, ...frame.panels].map(({ picture }) => decoded(picture)));
  if (connection !== view.connections) return;
  if (image) received.picture.showImage(image);
  showReceivedFrame(frame, (close, panel, at) => {
    if (!enlarged[at]) return;
    close.showImage(enlarged[at]);
    close.showCorners(cornersIn(panel.picture, panel.corners_px));
  });
}

/** @param {any} source */
function showNamedSource(source) {
  sayAt(byId("source"), source.name);
  document.title = `${source.name} – vocc receive`;
  showSource(source);
}

/** @param {any} end */
function showLastEnd(end) {
  showEnd(end);
  sayState(`${byId("receive-state").textContent} This page keeps the last state.`);
  sayWrong(end.why ?? "");
}

/** Each connection begins with all that there is. */
function clear() {
  view.waiting = null;
  view.connections += 1;
  clearReceived();
}

function connect() {
  const events = new EventSource("/events");
  events.addEventListener("open", clear);
  const shows = { source: showNamedSource, frame: offerFrame, message: showMessage, remark: showRemark, end: showLastEnd };
  for (const [name, show] of Object.entries(shows)) {
    events.addEventListener(name, (/** @type {MessageEvent} */ event) => show(JSON.parse(event.data)));
  }
  // There is nothing after the end.
  events.addEventListener("end", () => events.close());
  events.addEventListener("error", () => {
    sayState("Not connected");
    sayWrong("vocc does not answer: it was stopped. This page keeps the last state, and goes on if vocc starts again.");
  });
}

function redraw() {
  readColours();
  redrawLeds();
}

makeReceived();
sayState("Connecting …");
redraw();
window.addEventListener("resize", whenRested(100, redraw));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
connect();
