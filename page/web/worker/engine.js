// The WebAssembly module as an object: requests and answers, and the frames of Explore.

/**
 * The readings of a frame. The arrays are views of WebAssembly's memory, valid until the next call.
 * @typedef {object} View
 * @property {Uint8Array} grey the picture, row by row
 * @property {bigint} sent bit 8*row + column
 * @property {bigint} kmeans
 * @property {bigint} ml
 * @property {Float32Array} agr
 * @property {Float32Array} gri
 * @property {number[]} split the boundary of k-means: split[0]*agr + split[1]*gri = split[2]
 * @property {number} confidence of maximum likelihood
 * @property {boolean} mixed whether the exposure seems to show two symbols
 * @property {boolean[]} readable whether k-means and maximum likelihood could read it
 * @property {string} the reason if they could not
 */

const LEDS = 64;

/** A fault with a text for the user; `broken` if the WebAssembly module cannot continue. */
class EngineFault extends Error {
  /** @param {string} message @param {boolean} [broken] */
  constructor(message, broken = false) {
    super(message);
    this.broken = broken;
  }
}

class Engine {
  /** @param {WebAssembly.Module} module @returns {Promise<Engine>} */
  static async start(module) {
    const engine = new Engine();
    const page = {
      now_ms: () => performance.now(),
      panicked: (/** @type {number} */ at, /** @type {number} */ length) => {
        engine.lastWords = engine.textAt(at, length);
      },
    };
    const instance = await WebAssembly.instantiate(module, { page });
    engine.wasm = /** @type {any} */ (instance.exports);
    return engine;
  }

  constructor() {
    /** @type {any} */
    this.wasm = null;
    /** The reason that it reported when it stopped. */
    this.lastWords = "";
    this.encoder = new TextEncoder();
    this.decoder = new TextDecoder();
  }

  /**
   * @param {object} request
   * @param {Uint8Array} [bytes]
   * @returns {{answer: any, bytes: Uint8Array}} bytes are a copy
   */
  ask(request, bytes = new Uint8Array()) {
    return this.guarded(() => {
      const text = this.encoder.encode(JSON.stringify(request));
      this.write(this.wasm.text_room(text.length), text);
      this.write(this.wasm.bytes_room(bytes.length), bytes);
      const failed = this.wasm.ask();
      const answer = this.textAt(this.wasm.answer(), this.wasm.answer_length());
      if (failed) {
        throw new EngineFault(answer);
      }
      const out = this.memory(Uint8Array, this.wasm.out(), this.wasm.out_length()).slice();
      return { answer: JSON.parse(answer), bytes: out };
    });
  }

  /** Draws and reads a frame of the open scene. @param {number} number @returns {View} */
  frame(number) {
    return this.guarded(() => {
      const failed = this.wasm.frame(number);
      const why = this.textAt(this.wasm.answer(), this.wasm.answer_length());
      if (failed) {
        throw new EngineFault(why);
      }
      const numbers = this.memory(Float32Array, this.wasm.numbers(), 2 * LEDS + 7);
      const [sent, kmeans, ml] = this.memory(BigUint64Array, this.wasm.bits(), 3);
      const rest = 2 * LEDS;
      return {
        grey: this.memory(Uint8Array, this.wasm.grey(), this.wasm.grey_length()),
        sent,
        kmeans,
        ml,
        agr: numbers.subarray(0, LEDS),
        gri: numbers.subarray(LEDS, rest),
        split: [numbers[rest], numbers[rest + 1], numbers[rest + 2]],
        confidence: numbers[rest + 3],
        mixed: numbers[rest + 4] === 1,
        readable: [numbers[rest + 5] === 1, numbers[rest + 6] === 1],
        why,
      };
    });
  }

  /** Converts any stop of the WebAssembly module to a fault with a text. @template T @param {() => T} work @returns {T} */
  guarded(work) {
    try {
      return work();
    } catch (fault) {
      if (fault instanceof EngineFault) {
        throw fault;
      }
      // A module that runs out of memory stops without a reason.
      const words = this.lastWords ? `which is a fault of this page: ${this.lastWords}`
        : `and did not say why (${fault}): its memory may have run out, and a smaller picture takes less`;
      throw new EngineFault(`The computation stopped, ${words}`, true);
    }
  }

  /** @param {number} at @param {Uint8Array} bytes */
  write(at, bytes) {
    this.memory(Uint8Array, at, bytes.length).set(bytes);
  }

  /** @param {number} at @param {number} length @returns {string} */
  textAt(at, length) {
    return this.decoder.decode(this.memory(Uint8Array, at, length));
  }

  /**
   * A view of WebAssembly's memory, created for each access because growth moves the memory.
   * @param {any} Kind @param {number} at @param {number} length
   */
  memory(Kind, at, length) {
    return new Kind(this.wasm.memory.buffer, at, length);
  }
}
