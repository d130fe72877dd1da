/** Requests to the workers in which the simulator and the receiver run. */

/** A worker that does not answer for this time is ended. */
const PATIENCE_MS = 20_000;

/** The WebAssembly of this page, unpacked and compiled once for all workers. */
const compiled = (async () => {
  const packed = atob(byId("wasm-code").textContent.trim());
  const bytes = Uint8Array.from(packed, (letter) => letter.charCodeAt(0));
  const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(unpacked).arrayBuffer());
})();
// The first request reports a failure; until then it is not an unhandled error.
compiled.catch(() => {});

let workerUrl = "";

/** The address of the workers' code: the same for all, and kept for workers that are restarted. */
function workerAddress() {
  workerUrl ||= URL.createObjectURL(new Blob([byId("worker-code").textContent], { type: "text/javascript" }));
  return workerUrl;
}

/**
 * @typedef {{answer: any, bytes: Uint8Array | undefined}} Answer
 * @typedef {{done: (answer: Answer) => void, failed: (error: Error) => void, timer: number}} Waiting
 */

/** One worker, and the requests that wait for its answers. */
class Client {
  /**
   * @param {string} name Its task, for error texts.
   * @param {() => void} [onEnded] Called when the worker was ended and has lost its state.
   */
  constructor(name, onEnded = () => {}) {
    this.name = name;
    this.onEnded = onEnded;
    /** @type {Map<number, Waiting>} */
    this.waiting = new Map();
    this.lastId = 0;
    /** @type {Worker | null} */
    this.worker = null;
    /** @type {Promise<unknown> | null} */
    this.started = null;
  }

  /** Starts the worker, if it is not running. */
  start() {
    if (this.started) return this.started;
    const started = compiled.then((module) => {
      // The worker was ended before it started.
      if (this.started !== started) throw new GivenUp();
      this.worker = this.makeWorker();
      return this.post({ module }, [], PATIENCE_MS);
    }, (error) => {
      throw new Error(`This browser does not run the page's WebAssembly: ${error.message}`);
    });
    this.started = started;
    return started;
  }

  /** Makes a worker whose messages are ignored once it has been ended. */
  makeWorker() {
    const worker = new Worker(workerAddress());
    worker.onmessage = (event) => worker === this.worker && this.hear(event.data);
    worker.onerror = (event) => {
      event.preventDefault();
      if (worker === this.worker) this.end(new Error(`The ${this.name} broke: ${event.message || "no reason is known"}. ${this.anew()}`));
    };
    return worker;
  }

  /** The user's next step after the worker was ended. */
  anew() {
    return `The ${this.name} was started anew: ${byId("settings").hidden ? "try again" : "change a setting to go on"}.`;
  }

  /**
   * Sends a request and waits for the answer. An error's message is a sentence for the user.
   * @param {any} request
   * @param {Uint8Array} [bytes] Transferred: only the worker has them afterwards.
   * @param {number} [patience] Milliseconds.
   * @returns {Promise<Answer>}
   */
  async ask(request, bytes, patience = PATIENCE_MS) {
    await this.start();
    return this.post({ request, bytes }, bytes ? [bytes.buffer] : [], patience);
  }

  /**
   * @param {any} message
   * @param {any[]} given
   * @param {number} patience
   * @returns {Promise<Answer>}
   */
  post(message, given, patience) {
    return new Promise((done, failed) => {
      if (!this.worker) throw new GivenUp();
      const id = (this.lastId += 1);
      const tooLate = () => {
        this.end(new Error(`The ${this.name} gave no answer for ${patience / 1000} s. ${this.anew()}`));
      };
      this.waiting.set(id, { done, failed, timer: setTimeout(tooLate, patience) });
      this.worker.postMessage({ id, ...message }, given);
    });
  }

  /** @param {{id: number, answer: any, bytes?: Uint8Array, fault?: {text: string, broken: boolean}}} heard */
  hear({ id, answer, bytes, fault }) {
    if (fault?.broken) {
      this.end(new Error(`${sentence(fault.text)} ${this.anew()}`));
      return;
    }
    const waiting = this.waiting.get(id);
    if (!waiting) return;
    this.waiting.delete(id);
    clearTimeout(waiting.timer);
    if (fault) waiting.failed(new Error(fault.text));
    else waiting.done({ answer, bytes });
  }

  /**
   * Ends the worker. The next request starts another.
   * @param {Error} [why]
   */
  end(why = new GivenUp()) {
    this.worker?.terminate();
    this.worker = null;
    this.started = null;
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    for (const { failed, timer } of waiting) {
      clearTimeout(timer);
      failed(why);
    }
    // Waiting callers report the error themselves, or suppress it for a reason.
    if (waiting.length === 0) sayError(why);
    this.onEnded();
  }
}
