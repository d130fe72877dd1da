/** The worker: it starts the engine once, then answers one request after another. */

/** @type {Engine | null} */
let engine = null;

/**
 * One frame of Explore. Its pixels go into the buffer that the page returns with each request, so that none is allocated.
 * @param {number} number
 * @param {Uint8Array | undefined} spare
 */
function answerFrame(number, spare) {
  const view = engine.frame(number);
  const bytes = spare && spare.length === view.grey.length ? spare : new Uint8Array(view.grey.length);
  bytes.set(view.grey);
  const { grey: _, ...others } = view;
  return { answer: { ...others, number, agr: view.agr.slice(), gri: view.gri.slice(), split: Array.from(view.split) }, bytes };
}

/**
 * @param {any} request
 * @param {Uint8Array | undefined} bytes
 */
function answerTo(request, bytes) {
  if (!engine) throw new Error("The simulator has not started.");
  return request.do === "frame" ? answerFrame(request.frame, bytes) : engine.ask(request, bytes);
}

/** @param {MessageEvent} event */
self.onmessage = async (event) => {
  const { id, module, request, bytes } = event.data;
  try {
    if (module) {
      engine = await Engine.start(module);
      self.postMessage({ id, answer: {} });
      return;
    }
    const given = answerTo(request, bytes);
    // WebAssembly's memory cannot be transferred, only copied.
    const own = given.bytes && given.bytes.byteLength === given.bytes.buffer.byteLength ? given.bytes : given.bytes && given.bytes.slice();
    /** @type {any} */ (self).postMessage({ id, answer: given.answer, bytes: own }, own ? [own.buffer] : []);
  } catch (error) {
    const fault = /** @type {any} */ (error);
    const broken = Boolean(fault.broken) || error instanceof WebAssembly.RuntimeError || !engine;
    self.postMessage({ id, fault: { text: String(fault.message || fault), broken } });
  }
};
