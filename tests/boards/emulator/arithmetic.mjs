// The cycles of the transmitter's control path in different arithmetic, on an emulated RP2040.
//
//   node arithmetic.mjs IMAGE.elf
//
// Prints lines of name,mean,least,most: cycles from entry to return of the functions named timed_… in the image.

import fs from 'node:fs';
import { timed } from './timed.mjs';

const results = timed(fs.readFileSync(process.argv[2]));
console.log('# Cycles of an emulated Cortex-M0+ (RP2040) from a reading of the light to the luminance.');
console.log('# Made by tests/tools/count-cycles; lines: path,mean,least,most.');
for (const [name, { mean, least, most }] of Object.entries(results)) {
  console.log([name.replace(/^timed_|_$/g, ''), mean, least, most].join(','));
}
