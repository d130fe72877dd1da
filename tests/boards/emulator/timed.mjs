// Runs a program on an emulated RP2040 until it sleeps, and measures its functions named timed_….

import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { functions } from './elf.mjs';
import { Flash } from './flash.mjs';
import { Pico } from './pico.mjs';
import { Stopwatch } from './stopwatch.mjs';

const STEP_NANOS = 1e8, STEPS_MAX = 1000;

// The stopwatch's results by the functions' names.
export function timed(elf) {
  const names = functions(elf).map(({ name }) => name.match(/timed_\w+?(?=17h[0-9a-f]{16}|$)/)?.[0]).filter(Boolean);
  const stopwatch = new Stopwatch(elf, names);
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'timed-'));
  const pico = new Pico(new Flash(path.join(folder, 'flash.bin'), elf), () => {}, { stopwatch });
  let steps = 0;
  do {
    pico.run(STEP_NANOS);
    steps += 1;
  } while (!pico.mcu.core.waiting && steps < STEPS_MAX);
  fs.rmSync(folder, { recursive: true });
  if (steps === STEPS_MAX) throw new Error('the program has not come to its end');
  return stopwatch.results();
}
