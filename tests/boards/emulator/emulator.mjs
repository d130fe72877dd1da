// A transmitter's image on an emulated Raspberry Pi Pico.
//
//   node emulator.mjs IMAGE.elf FLASH.bin SOCKET [--max7219] [--edges] [--time NAME]...
//
// IMAGE.elf is flashed into FLASH.bin if that is not there yet. SOCKET is UART 0, a Unix socket for one client at a time.
// --max7219 puts a module with that chip in the place of the shift registers.
// --edges follows each pulse of the dimming, --time counts the cycles of a function or an interrupt.
//
// Commands come as JSON, one a line, on standard input, and answers and events leave on standard output:
//
//   {"run_ms": 500}                  runs so much simulated time as fast as it goes; answered by {"ran": …}
//   {"real_time": true}              runs on, no faster than the clock on the wall, until {"real_time": false}
//   {"lux": 5000, "fault": "none"}   the light on the sensor, and how it fails: none, missing, stuck, silent, hanging
//   {"hang": true}                   the processor executes nothing any more
//   {"enter": "NAME"}                it goes on in the function of that (mangled) name
//   {"cut_after": 3}                 cuts the power half-way through a flash operation, after so many more
//
// Events have the simulated time, ns since power-up: {"ns", "panel"}: the LEDs at a latch's edge; {"ns", "lit_cycles",
// "period_cycles"}: the dimming; {"ns", "low_current"}; {"ns", "register", "value"}: of a MAX7219; {"ns", "reset"}.

import fs from 'node:fs';
import readline from 'node:readline';
import { parseArgs } from 'node:util';
import { functions } from './elf.mjs';
import { Flash } from './flash.mjs';
import { Pico } from './pico.mjs';
import { SerialSocket } from './serial_socket.mjs';
import { Stopwatch } from './stopwatch.mjs';

const SLICE_NANOS = 2e6, NANOS_PER_MS = 1e6;

const { positionals, values } = parseArgs({
  allowPositionals: true,
  options: { max7219: { type: 'boolean' }, edges: { type: 'boolean' }, time: { type: 'string', multiple: true, default: [] } },
});
const [imagePath, flashPath, socketPath] = positionals;
const elf = fs.readFileSync(imagePath);

const say = (event) => fs.writeSync(1, JSON.stringify(event) + '\n');
const stopwatch = values.time.length ? new Stopwatch(elf, values.time) : null;
const flash = new Flash(flashPath, elf);
const pico = new Pico(flash, say, { max7219: values.max7219, edges: values.edges, stopwatch });
const line = new SerialSocket(pico, socketPath, () => say({ listening: socketPath }));
let realTime = null;

async function run(milliseconds) {
  const end = pico.nanos + milliseconds * NANOS_PER_MS;
  while (pico.nanos < end) {
    line.run(Math.min(SLICE_NANOS, end - pico.nanos));
    await new Promise(setImmediate);
  }
  say({ ran: Math.round(pico.nanos), lit_nanos: pico.panel.takeLitNanos(), cycles: stopwatch?.results() });
}

function keepUp() {
  if (!realTime) return;
  const due = realTime.nanos + (performance.now() - realTime.at) * NANOS_PER_MS;
  if (pico.nanos < due) line.run(Math.min(SLICE_NANOS, due - pico.nanos));
  // Time that a slow machine lost is not made up for.
  if (due - pico.nanos > 20 * SLICE_NANOS) realTime = { at: performance.now(), nanos: pico.nanos };
  if (pico.nanos < due) setImmediate(keepUp);
  else setTimeout(keepUp, 1);
}

const commands = readline.createInterface({ input: process.stdin });
commands.on('line', async (line) => {
  const command = JSON.parse(line);
  if ('lux' in command) pico.sensor.lux = command.lux;
  if ('fault' in command) pico.sensor.fail(command.fault);
  if ('cut_after' in command) flash.cutAfter(command.cut_after);
  if ('hang' in command) pico.hang();
  if ('enter' in command) pico.enter(functions(elf).find(({ name }) => name.includes(command.enter)).address);
  if ('real_time' in command) {
    realTime = command.real_time ? { at: performance.now(), nanos: pico.nanos } : null;
    say({ real_time: command.real_time, ns: Math.round(pico.nanos) });
    keepUp();
  }
  if ('run_ms' in command) await run(command.run_ms);
});
// Whoever started this is gone.
commands.on('close', () => process.exit(0));
