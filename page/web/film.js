/** Films that the browser plays, and cameras: frames in the order of display, numbered by their time. */

const LARGEST_SIDE = 8192;
/** Usual rates of films; a rate that is close to one of them counts as it. */
const USUAL_RATES = [23.976, 24, 25, 29.97, 30, 48, 50, 59.94, 60, 90, 100, 120, 240];
/** The rate at which a browser reliably reports frames, whatever the film's rate. */
const SHOWN_RATE = 20;
/** The assumed rate if a film or a camera does not state one. */
const ASSUMED_RATE = 30;
/** Time after which an idle video has failed. */
const VIDEO_PATIENCE_MS = 20_000;
/** Number of waiting frames at which the film is paused. */
const MOST_WAITING = 4;
/** Weight of a camera's time stamp relative to those before it; the remainder is jitter of the computer. */
const STAMP_TRUST = 0.1;

/** @param {number} width @param {number} height @param {string} name */
function refuseLarge(width, height, name) {
  if (width <= LARGEST_SIDE && height <= LARGEST_SIDE) return;
  throw new Error(`“${name}” has ${width} × ${height} pixels: make it 1 × 1 to ${LARGEST_SIDE} × ${LARGEST_SIDE}`);
}

/** Frames that wait to be read, in order. */
class Shots {
  constructor() {
    /** @type {Shot[]} */
    this.waiting = [];
    this.isOver = false;
    /** @type {Error | null} */
    this.fault = null;
    this.wake = () => {};
    /** Called when a frame was removed. */
    this.onTaken = () => {};
  }

  /** @param {Shot} shot */
  push(shot) {
    this.waiting.push(shot);
    this.wake();
  }

  /** @param {Error | null} [fault] */
  end(fault = null) {
    this.isOver = true;
    this.fault ??= fault;
    this.wake();
  }

  async *[Symbol.asyncIterator]() {
    for (;;) {
      const shot = this.waiting.shift();
      if (shot) {
        this.onTaken();
        yield shot;
      } else if (this.isOver) {
        if (this.fault) throw this.fault;
        return;
      } else {
        await /** @type {Promise<void>} */ (new Promise((done) => { this.wake = done; }));
      }
    }
  }
}

/** Reads the pixels of pictures that the browser shows. */
class Grabber {
  /** @param {number} width @param {number} height */
  constructor(width, height) {
    this.canvas = make("canvas", { width, height });
    this.context = this.canvas.getContext("2d", { willReadFrequently: true });
  }

  /**
   * @param {CanvasImageSource} source
   * @param {{number: number, late: number}} when
   * @returns {Shot}
   */
  grab(source, when) {
    const { width, height } = this.canvas;
    this.context.drawImage(source, 0, 0, width, height);
    const image = this.context.getImageData(0, 0, width, height);
    const paint = (/** @type {Picture} */ picture) => {
      picture.resize(width, height);
      picture.context.putImageData(image, 0, 0);
    };
    return { ...when, format: "rgba", bytes: new Uint8Array(image.data.buffer), paint };
  }
}

/** Checks for the required function before anything is opened. */
function refuseWithoutFrames() {
  if ("requestVideoFrameCallback" in HTMLVideoElement.prototype) return;
  throw new Error("This browser does not tell when a film's frames are shown: take a y4m film or pictures");
}

/** Waits for a limited time. @param {(done: (_: any) => void, failed: (_: Error) => void) => void} begin @param {string} tooLate */
function soon(begin, tooLate) {
  const late = wait(VIDEO_PATIENCE_MS).then(() => { throw new Error(tooLate); });
  return Promise.race([new Promise(begin), late]);
}

/** Stops opening a film that is no longer wanted. @param {() => boolean} isWanted */
function giveUpUnless(isWanted) {
  if (!isWanted()) throw new GivenUp();
}

/** @param {string} name @param {(video: HTMLVideoElement) => void} fill @returns {Promise<HTMLVideoElement>} */
async function loadVideo(name, fill) {
  const video = make("video", { muted: true, playsInline: true, preload: "auto" });
  await soon((done, failed) => {
    video.onloadeddata = done;
    const why = () => video.error?.message || "it does not know the format";
    video.onerror = () => failed(new Error(`This browser does not play “${name}”: ${why()}`));
    fill(video);
  }, `No picture has come of “${name}”: try again, or choose another`);
  refuseLarge(video.videoWidth, video.videoHeight, name);
  if (video.videoWidth === 0) throw new Error(`“${name}” has no pictures`);
  return video;
}

/** @param {HTMLVideoElement} video */
function nextShown(video) {
  return new Promise((done) => video.requestVideoFrameCallback((now, data) => done({ now, ...data })));
}

/**
 * Numbers a frame by its time; the remainder is its delay.
 * @param {number} fps
 * @param {number} last The previous number.
 * @param {number} seconds
 */
function numberAt(fps, last, seconds) {
  const number = Math.max(last + 1, Math.round(seconds * fps));
  return { number, late: seconds * fps - number };
}

/** @param {File} file @param {number | null} toldFps @param {() => boolean} isWanted @returns {Promise<Film>} */
async function openVideo(file, toldFps, isWanted) {
  refuseWithoutFrames();
  const address = URL.createObjectURL(file);
  const shots = new Shots();
  /** @type {HTMLVideoElement | null} */
  let video = null;
  const close = () => {
    shots.end();
    video?.pause();
    video?.removeAttribute("src");
    URL.revokeObjectURL(address);
  };
  try {
    await loadVideo(file.name, (element) => { (video = element).src = address; });
    const found = toldFps ?? (await findRate(video, isWanted));
    giveUpUnless(isWanted);
    const fps = found ?? ASSUMED_RATE;
    playInto(video, fps, shots).catch((error) => shots.end(error));
    return { name: file.name, width: video.videoWidth, height: video.videoHeight, fps, isAssumed: !found, shots, close };
  } catch (error) {
    close();
    throw error;
  }
}

/** Plays a film slowly to measure its frame rate. @param {HTMLVideoElement} video @param {() => boolean} isWanted */
async function findRate(video, isWanted) {
  const times = [];
  const ended = new Promise((done) => { video.onended = () => done(null); });
  video.playbackRate = 0.25;
  await video.play();
  while (times.length < 16 && isWanted()) {
    const shown = await Promise.race([nextShown(video), ended, wait(3000)]);
    if (!shown) break;
    times.push(shown.mediaTime);
  }
  video.pause();
  const steps = times.slice(1).map((time, at) => time - times[at]).filter((step) => step > 0);
  if (steps.length === 0) return null;
  // Frames that the browser skipped cause steps of several periods.
  const least = Math.min(...steps);
  const periods = steps.reduce((sum, step) => sum + Math.round(step / least), 0);
  const rate = periods / steps.reduce((sum, step) => sum + step, 0);
  const usual = USUAL_RATES.reduce((best, next) => (Math.abs(next - rate) < Math.abs(best - rate) ? next : best));
  return Math.abs(usual / rate - 1) < 0.01 ? usual : rate;
}

/**
 * Plays a film from its beginning, slowly enough that each frame is shown, and pauses it while too many frames wait.
 * @param {HTMLVideoElement} video
 * @param {number} fps
 * @param {Shots} shots
 */
async function playInto(video, fps, shots) {
  const grabber = new Grabber(video.videoWidth, video.videoHeight);
  const broken = () => new Error(`The film cannot be played any further: ${video.error?.message || "it is damaged"}`);
  if (video.error) throw broken();
  if (video.currentTime > 0) {
    await soon((done, failed) => {
      video.onseeked = done;
      video.onerror = () => failed(broken());
      video.currentTime = 0;
    }, "The film cannot be wound back to its beginning: it is damaged");
  }
  let last = -1;
  const take = (/** @type {number} */ _, /** @type {VideoFrameCallbackMetadata} */ { mediaTime }) => {
    if (shots.isOver) return;
    video.requestVideoFrameCallback(take);
    const when = numberAt(fps, last, mediaTime);
    last = when.number;
    shots.push(grabber.grab(video, when));
    if (shots.waiting.length >= MOST_WAITING) video.pause();
  };
  shots.onTaken = () => {
    if (video.paused && !video.ended && !shots.isOver && shots.waiting.length === 0) video.play().catch((error) => shots.end(error));
  };
  video.requestVideoFrameCallback(take);
  video.onended = () => shots.end();
  video.onerror = () => shots.end(broken());
  video.playbackRate = Math.min(1, Math.max(0.1, SHOWN_RATE / fps));
  await video.play();
}

/** @param {number | null} toldFps @param {() => boolean} isWanted @returns {Promise<Film>} */
async function openCamera(toldFps, isWanted) {
  refuseWithoutFrames();
  if (!navigator.mediaDevices?.getUserMedia) throw new Error("This browser gives pages no camera");
  const stream = await navigator.mediaDevices
    .getUserMedia({ video: { width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 60 }, facingMode: "environment" } })
    .catch((error) => { throw new Error(cameraRefusal(error)); });
  const shots = new Shots();
  const close = () => {
    shots.end();
    stream.getTracks().forEach((track) => track.stop());
  };
  try {
    // The browser's question about permission may stay open for long.
    giveUpUnless(isWanted);
    const video = await loadVideo("the camera", (element) => {
      element.srcObject = stream;
      element.play().catch(() => {});
    });
    giveUpUnless(isWanted);
    const [track] = stream.getVideoTracks();
    const found = toldFps ?? track.getSettings().frameRate;
    const fps = found || ASSUMED_RATE;
    track.onended = () => shots.end(new Error("The camera was taken away"));
    filmInto(video, fps, shots);
    const { videoWidth: width, videoHeight: height } = video;
    return { name: "the camera", width, height, fps, isAssumed: !found, isLive: true, shots, close };
  } catch (error) {
    close();
    throw error;
  }
}

/** @param {DOMException} error */
function cameraRefusal(error) {
  const reasons = {
    NotAllowedError: "The camera was refused: allow it in the browser's settings of this page, or choose files",
    NotFoundError: "There is no camera: connect one, or choose files",
    NotReadableError: "The camera is in use by another program",
  };
  return reasons[error.name] ?? `The camera cannot be used: ${error.message}`;
}

/**
 * Takes a camera's frames while the receiver keeps up; frames that it cannot take are gaps.
 * @param {HTMLVideoElement} video
 * @param {number} fps
 * @param {Shots} shots
 */
function filmInto(video, fps, shots) {
  const { videoWidth: width, videoHeight: height } = video;
  const grabber = new Grabber(width, height);
  /** The time of the last frame in frame periods, with most of the stamps' jitter filtered out. */
  let smooth = 0;
  let first = 0;
  let last = -1;
  const take = (/** @type {number} */ now, /** @type {VideoFrameCallbackMetadata} */ data) => {
    if (shots.isOver) return;
    if (video.videoWidth !== width || video.videoHeight !== height) {
      shots.end(new Error("The camera was turned, and its picture has another shape: use the camera anew"));
      return;
    }
    video.requestVideoFrameCallback(take);
    const stamp = ((data.captureTime ?? now) / 1000) * fps;
    if (last < 0) first = stamp;
    const expected = smooth + Math.max(last < 0 ? 0 : 1, Math.round(stamp - first - smooth));
    smooth = expected + STAMP_TRUST * (stamp - first - expected);
    const when = numberAt(1, last, smooth);
    last = when.number;
    if (shots.waiting.length === 0) shots.push(grabber.grab(video, when));
  };
  video.requestVideoFrameCallback(take);
}
