// A camera's view of a transmitter's panel: the LEDs as the pins drive them, drawn by a separate program.

import { spawn } from 'node:child_process';

const LEDS = 64n;
// Maximum number of symbols that a frame may show, counted from the frame before.
const REMEMBERED = 64;

export class Eye {
  // `command` is the drawing program and its arguments. It receives one JSON object per line, and answers a frame with its pixels.
  constructor([program, ...options]) {
    Object.assign(this, { share: 0, seed: 1, symbols: [], pulses: [], pulse: { lit_cycles: 0, period_cycles: 1, low_current: false } });
    this.process = spawn(program, options, { stdio: ['pipe', 'pipe', 'inherit'] });
    this.process.on('exit', (code) => this.fail(new Error(`the drawing program has ended: ${code}`)));
    this.process.stdin.on('error', () => {});
    this.bytes = [];
    this.count = 0;
    this.process.stdout.on('data', (bytes) => {
      this.bytes.push(bytes);
      this.count += bytes.length;
      this.settle();
    });
  }

  // Records the events of the transmitter's pins.
  witness({ ns, panel, lit_cycles, period_cycles, low_current }) {
    if (panel !== undefined) this.symbols.push([ns, this.spoilt(panel)]);
    if (this.symbols.length > 2 * REMEMBERED) this.symbols.splice(0, REMEMBERED);
    if (lit_cycles !== undefined) this.pulse = { ...this.pulse, lit_cycles, period_cycles };
    if (low_current !== undefined) this.pulse = { ...this.pulse, low_current };
    if (this.pulses.at(-1)?.[1] !== this.pulse) this.pulses.push([ns, this.pulse]);
    if (this.pulses.length > 2 * REMEMBERED) this.pulses.splice(0, REMEMBERED);
  }

  // Inverts this share of the LEDs in the view, from the next symbol on.
  spoil(share) {
    this.share = share;
  }

  spoilt(panel) {
    let bits = BigInt(`0x${panel}`);
    for (let led = 0n; led < LEDS; led++) if (this.chance() < this.share) bits ^= 1n << led;
    return bits.toString(16).padStart(16, '0');
  }

  // The next pseudorandom number from 0 to 1 (mulberry32); the sequence is always the same.
  chance() {
    this.seed = (this.seed + 0x6d2b79f5) | 0;
    let mixed = Math.imul(this.seed ^ (this.seed >>> 15), 1 | this.seed);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  }

  // A transmitter without power is dark.
  goDark(ns) {
    this.symbols.push([ns, '0'.repeat(16)]);
  }

  // Changes the scene.
  change(scene) {
    this.tell({ scene });
  }

  // The pixels of a frame. The transmitter must have run until the frame's end.
  async see(frame) {
    const middle = frame.ns - (frame.exposureLines - frame.height) * (frame.lineNanos / 2);
    const pulse = this.pulses.findLast(([ns]) => ns <= middle)?.[1] ?? this.pulse;
    this.tell({ frame: { ...frame, symbols: this.symbols.slice(-REMEMBERED), pulse } });
    this.wanted = frame.width * frame.height;
    return new Promise((resolve, reject) => {
      Object.assign(this, { resolve, reject });
      this.settle();
    });
  }

  tell(what) {
    this.process.stdin.write(JSON.stringify(what) + '\n');
  }

  settle() {
    if (!this.resolve || this.count < this.wanted) return;
    const all = Buffer.concat(this.bytes);
    this.bytes = [all.subarray(this.wanted)];
    this.count -= this.wanted;
    const { resolve } = this;
    this.resolve = null;
    resolve(all.subarray(0, this.wanted));
  }

  fail(error) {
    if (this.reject) this.reject(error);
    else throw error;
  }
}
