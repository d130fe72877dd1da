// A transmitter's image on an emulated Raspberry Pi Pico.
//
//   node emulator.mjs IMAGE.elf FLASH.bin SOCKET [--max7219] [--edges] [--stage gate|buffer] [--fault FAULT]... [--slow-flash]
//       [--time NAME]...
//
// IMAGE.elf is flashed into FLASH.bin if that is not there yet. SOCKET is UART 0, a Unix socket for one client at a time.
// --max7219 puts a module with that chip in the place of the shift registers.
// --edges follows each pulse of the dimming, --time counts the cycles of a function or an interrupt. --stage is what drives output enable:
// see `output_enable.mjs`. --fault is one of the LEDs' wires: see `wires.mjs`. With --slow-flash, erasing and programming take the longest
// that the datasheet allows.
//
// Commands, beside those of `harness.mjs`:
//
//   {"lux": 5000, "fault": "none"}   the light on the sensor, and how it fails: none, missing, stuck, silent, hanging
//   {"hang": true}                   the processor executes nothing any more, or goes on
//   {"boot_loader": true}            it starts anew in its boot loader, and runs no program
//   {"power": false}                 it has no supply any more; the registers have theirs
//   {"enter": "NAME"}                it goes on in the function of that (mangled) name
//   {"cut_after": 3}                 cuts the power half-way through a flash operation, after so many more
//
// Events have the simulated time, ns since power-up: {"ns", "panel"}: the LEDs at a latch's edge; {"ns", "lit_cycles",
// "period_cycles"}: the dimming; {"ns", "low_current"}; {"ns", "register", "value"}: of a MAX7219; {"ns", "reset"}.

import fs from 'node:fs';
import { parseArgs } from 'node:util';
import { functions } from './elf.mjs';
import { Harness, plug, say } from './harness.mjs';
import { Pico } from './pico.mjs';
import { Stopwatch } from './stopwatch.mjs';

const { positionals, values } = parseArgs({
  allowPositionals: true,
  options: {
    max7219: { type: 'boolean' },
    edges: { type: 'boolean' },
    stage: { type: 'string' },
    fault: { type: 'string', multiple: true, default: [] },
    'slow-flash': { type: 'boolean' },
    time: { type: 'string', multiple: true, default: [] },
  },
});
const [image, flashFile, socket] = positionals;
const { max7219, edges, stage, fault: faults, time } = values;
const elf = fs.readFileSync(image);
const stopwatch = time.length ? new Stopwatch(elf, time) : null;
const options = { max7219, edges, stage, faults, stopwatch };
const { board: pico, flash, line } = plug(Pico, { elf, flash: flashFile, socket, report: say }, options);
flash.isSlow = values['slow-flash'];

new Harness({
  now: () => pico.nanos,
  advance: (end) => line.run(end - pico.nanos),
  results: () => ({ lit_nanos: pico.panel.takeLitNanos(), cycles: stopwatch?.results() }),
  obey(command) {
    if ('lux' in command) pico.sensor.lux = command.lux;
    if ('fault' in command) pico.sensor.fail(command.fault);
    if ('cut_after' in command) flash.cutAfter(command.cut_after);
    if ('boot_loader' in command) pico.enterBootLoader();
    if ('power' in command) pico.losePower();
    if ('hang' in command) pico.hang(command.hang);
    if ('enter' in command) pico.enter(functions(elf).find(({ name }) => name.includes(command.enter)).address);
  },
});
