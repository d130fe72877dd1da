// The common parts of all emulations: boards that are flashed and plugged in, time that passes as fast as possible or with the wall clock,
// commands as JSON, one per line, on standard input, and answers and events on standard output.
//
// {"run_ms": 500}                  runs for this simulated time as fast as possible; answered by {"ran": …}
// {"real_time": true}              continues, no faster than the wall clock, until {"real_time": false}
//
// Commands are executed one after the other.

import fs from 'node:fs';
import readline from 'node:readline';
import { Flash } from './flash.mjs';
import { SerialSocket } from './serial_socket.mjs';

export const NANOS_PER_MS = 1e6;
const SLICE_NANOS = 2e6;

export const say = (event) => fs.writeSync(1, JSON.stringify(event) + '\n');

// A board of a kind, with its image and its serial line. The image is flashed if the flash chip's file does not exist yet; `options` are
// those of the kind.
export function plug(Kind, { elf, flash, socket, name, report, hear }, options) {
  const chip = new Flash(flash, elf);
  const board = new Kind(chip, report, options);
  return { board, flash: chip, line: new SerialSocket(board, socket, () => say({ listening: name ?? socket }), hear) };
}

export class Harness {
  // `now` returns the simulated time, and `advance` runs until another time; `obey` executes a command; `results` is added to the answer to
  // a run.
  constructor({ now, advance, obey, results = () => ({}) }) {
    Object.assign(this, { now, advance, obey, results, realTime: null, busy: Promise.resolve() });
    const commands = readline.createInterface({ input: process.stdin });
    commands.on('line', (line) => this.inTurn(() => this.command(JSON.parse(line))));
    // The parent process has ended.
    commands.on('close', () => process.exit(0));
  }

  inTurn(work) {
    this.busy = this.busy.then(work).catch((error) => say({ error: `${error.stack}` }));
  }

  async command(command) {
    await this.obey(command);
    if ('real_time' in command) {
      this.realTime = command.real_time ? this.thisMoment() : null;
      say({ real_time: command.real_time, ns: Math.round(this.now()) });
      this.inTurn(() => this.keepUp());
    }
    if ('run_ms' in command) await this.run(command.run_ms);
  }

  async run(milliseconds) {
    const end = this.now() + milliseconds * NANOS_PER_MS;
    while (this.now() < end) {
      await this.advance(Math.min(this.now() + SLICE_NANOS, end));
      await new Promise(setImmediate);
    }
    say({ ran: Math.round(this.now()), ...this.results() });
  }

  thisMoment() {
    return { at: performance.now(), nanos: this.now() };
  }

  async keepUp() {
    if (!this.realTime) return;
    const due = this.realTime.nanos + (performance.now() - this.realTime.at) * NANOS_PER_MS;
    if (this.now() < due) await this.advance(Math.min(this.now() + SLICE_NANOS, due));
    // Time that a slow machine has lost is not caught up.
    if (due - this.now() > 20 * SLICE_NANOS) this.realTime = this.thisMoment();
    const again = () => this.inTurn(() => this.keepUp());
    if (this.now() < due) setImmediate(again);
    else setTimeout(again, 1);
  }
}
