// The flash chip. Its contents are in a file, so that they survive the process as they survive a power cut.

import fs from 'node:fs';
import { segments } from './elf.mjs';

const BASE = 0x10000000, SIZE = 2 * 1024 * 1024;

export class Flash {
  // `elf` is flashed if the file does not exist yet.
  constructor(path, elf) {
    if (!fs.existsSync(path)) fs.writeFileSync(path, image(elf));
    this.contents = fs.readFileSync(path);
    this.file = fs.openSync(path, 'r+');
    this.operations = 0;
    this.cutAt = Infinity;
    this.isSlow = false;
  }

  // Cuts the power halfway through an operation, after `operations` more.
  cutAfter(operations) {
    this.cutAt = this.operations + operations;
  }

  erase(at, count) {
    this.change(at, this.contents.subarray(at, at + count).map(() => 0xff));
  }

  // Programming clears bits and sets none.
  program(at, bytes) {
    this.change(at, bytes.map((byte, index) => byte & this.contents[at + index]));
  }

  change(at, bytes) {
    const torn = this.operations++ === this.cutAt;
    const written = torn ? bytes.subarray(0, bytes.length / 2) : bytes;
    this.contents.set(written, at);
    this.mapped?.set(written, at);
    fs.writeSync(this.file, written, 0, written.length, at);
    if (torn) process.exit(0);
  }

  // Makes the contents readable for the processor.
  map(memory) {
    this.mapped = memory;
    memory.fill(0xff);
    memory.set(this.contents);
  }
}

function image(elf) {
  const flash = Buffer.alloc(SIZE, 0xff);
  for (const { address, bytes } of segments(elf)) {
    if (address >= BASE && address < BASE + SIZE) flash.set(bytes, address - BASE);
  }
  return flash;
}
