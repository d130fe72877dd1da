// The cycles of the transmitter's control path in different arithmetic, on an emulated RP2040.
//
//   node arithmetic.mjs IMAGE.elf
//
// Prints lines of name,mean,least,most: cycles from entry to return of the functions named timed_… in the image.

import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { functions } from './elf.mjs';
import { Flash } from './flash.mjs';
import { Pico } from './pico.mjs';
import { Stopwatch } from './stopwatch.mjs';

const STEP_NANOS = 1e8, STEPS_MAX = 1000;

const elf = fs.readFileSync(process.argv[2]);
const names = functions(elf).map(({ name }) => name.match(/timed_\w+?(?=17h[0-9a-f]{16}|$)/)?.[0]).filter(Boolean);
const stopwatch = new Stopwatch(elf, names);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'arithmetic-'));
const pico = new Pico(new Flash(path.join(folder, 'flash.bin'), elf), () => {}, { stopwatch });
let steps = 0;
do {
  pico.run(STEP_NANOS);
  steps += 1;
} while (!pico.mcu.core.waiting && steps < STEPS_MAX);
fs.rmSync(folder, { recursive: true });
if (steps === STEPS_MAX) throw new Error('the program has not come to its end');

console.log('# Cycles of an emulated Cortex-M0+ (RP2040) from a reading of the light to the luminance.');
console.log('# Made by tests/tools/count-cycles; lines: path,mean,least,most.');
for (const [name, { mean, least, most }] of Object.entries(stopwatch.results())) {
  console.log([name.replace(/^timed_|_$/g, ''), mean, least, most].join(','));
}
