// A transmitter's image on an emulated Raspberry Pi Pico.
//
//   node emulator.mjs IMAGE.elf FLASH.bin SOCKET [--max7219] [--edges] [--stage gate|no-resistor|buffer] [--at-3v3 gate|registers]...
//       [--direct] [--fault FAULT]... [--slow-flash] [--time NAME]...
//
// IMAGE.elf is flashed into FLASH.bin if that does not exist yet. SOCKET is UART 0, a Unix socket for one client at a time. --max7219
// replaces the shift registers by a module with that chip. --edges follows each pulse of the dimming, --time counts the cycles of a
// function or an interrupt. --stage selects the driver of output enable, --at-3v3 a part that the Pico feeds; with --direct there is no
// shifter: see `output_enable.mjs`. --fault is a fault of the LEDs' wires: see `wires.mjs`. With --slow-flash, erasing and programming take
// the maximum times of the datasheet.
//
// Commands, in addition to those of `harness.mjs`:
//
//   {"lux": 5000, "fault": "none"}   the light on the sensor, and its fault: none, missing, stuck, silent, hanging,
//                                   holding: it holds the data line, from now on and at each start
//   {"hang": true}                   stops the processor, or lets it continue
//   {"boot_loader": true}            restarts in the boot loader, which runs no program
//   {"power": false}                 the board loses its power; what it does not feed keeps its own supply
//   {"wire": false}                  the wire from the dimming's pin to the gate breaks
//   {"supply": false}                the LEDs lose their supply, and all else that the board does not feed
//   {"enter": "NAME"}                continues in the function with that (mangled) name
//   {"hard_fault": true}             makes the processor fault
//   {"cut_after": 3}                 cuts the power halfway through a flash operation, after this many more
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
    'at-3v3': { type: 'string', multiple: true },
    direct: { type: 'boolean' },
    fault: { type: 'string', multiple: true, default: [] },
    'slow-flash': { type: 'boolean' },
    time: { type: 'string', multiple: true, default: [] },
  },
});
const [image, flashFile, socket] = positionals;
const { max7219, edges, fault: faults, time } = values;
const kit = { stage: values.stage, at3v3: values['at-3v3'], isDirect: values.direct };
const elf = fs.readFileSync(image);
const stopwatch = time.length ? new Stopwatch(elf, time) : null;
const options = { max7219, edges, kit, faults, stopwatch };
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
    if ('wire' in command) pico.breakWire();
    if ('supply' in command) pico.cutSupply();
    if ('hang' in command) pico.hang(command.hang);
    if ('hard_fault' in command) pico.fault();
    if ('enter' in command) pico.enter(functions(elf).find(({ name }) => name.includes(command.enter)).address);
  },
});
