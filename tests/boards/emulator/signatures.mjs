// The flash, cycles and stack of Ed25519 by several crates, on an emulated RP2040.
//
//   node signatures.mjs NONE.elf IMAGE.elf …
//
// Prints a table: a line for each image, named by its file. The flash is what the image has more than the first one.

import fs from 'node:fs';
import path from 'node:path';
import { segments } from './elf.mjs';
import { timed } from './timed.mjs';

const CLOCK_HZ = 125e6;

const flash = (elf) => segments(elf).reduce((sum, { bytes }) => sum + bytes.length, 0);
const number = (value) => String(value).replace(/\B(?=(\d{3})+$)/g, ' ');
const time = ({ mean }) => `${number(mean)} cycles, ${number(Math.round((mean / CLOCK_HZ) * 1e3))} ms`;

const [none, ...images] = process.argv.slice(2);
const empty = flash(fs.readFileSync(none));
console.log('| program | flash | key and signature | keys: cycles apart | verification | stack: sign, verify |');
console.log('|---|---|---|---|---|---|');
for (const image of images) {
  const elf = fs.readFileSync(image);
  const { timed_sign: sign, timed_verify: verify } = timed(elf);
  const columns = [
    path.basename(image),
    `${number(flash(elf) - empty)} bytes`,
    time(sign),
    `${sign.count}: ${number(sign.most - sign.least)}`,
    time(verify),
    `${number(sign.stack)}, ${number(verify.stack)} bytes`,
  ];
  console.log(`| ${columns.join(' | ')} |`);
}
