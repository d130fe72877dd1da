// Two Picos that are connected by light alone: a transmitter's image, whose pins drive LEDs, and a receiver's image, whose camera sees
// them.
//
//   node two_picos.mjs TRANSMITTER.elf RECEIVER.elf FOLDER [--time NAME]... -- EYE [its arguments]
//
// EYE draws the camera's view (`hm01b0_eye` of the tests' package). FOLDER has the flash chips, the sockets `transmitter` and `receiver`,
// which are each board's UART 0 for one client at a time, and `receiver_usb`, the receiver's port over USB. --time counts the cycles of a
// function or an interrupt of the receiver. Initially, the receiver has no power.
//
// Both share one time, which starts at the transmitter's power-up. Light has one direction, so the transmitter may be ahead of the receiver
// by the readout time of a frame, because its last line is exposed that much later than its first.
//
// Commands, in addition to those of `harness.mjs`:
//
//   {"receiver": "on"}               switches the receiver's power on; "off" and, for a moment, "brown-out" switch it off
//   {"transmitter": "off"}           the same for the transmitter, which is on initially
//   {"camera": "none"}               the camera's fault: none, missing, wrong_id, deaf, hanging, frozen, misread, holding; or brown-out:
//                                    its supply fails for a moment
//   {"spoilt": 0.1}                  inverts this share of the LEDs in the view, at random, in each symbol from now on
//   {"lost_lines": [40, 41]}         drops these lines from all frames from now on
//   {"scene": ["pose.x_m=0.3"]}      changes the camera's scene
//   {"lux": 5000}                    the light on the transmitter's sensor
//   {"film_to": "PATH"}              adds each frame to this file, as PGM
//   {"hang": true}                   stops the receiver's processor
//   {"fault": true}                  makes the receiver's processor fault
//   {"enter": "NAME"}                continues in the function with that (mangled) name
//   {"stack": "full", "enter": …}    the same with a full stack
//   {"count_anew": true}             resets the counted cycles
//
// Events have the simulated time and the board: {"ns", "board", …}. {"text"}: a line from the receiver's UART; {"usb"}: a line over USB,
// whose port is open; {"lamp"}; {"frame", "exposure_ms", "gain"}; {"streaming", "frame_ms"}; {"late"}: the PIO may be too slow for the
// pixels; {"reset"}; {"error"}. Those of the transmitter are the events of `emulator.mjs`.

import fs from 'node:fs';
import path from 'node:path';
import { parseArgs } from 'node:util';
import { address, functions } from './elf.mjs';
import { Eye } from './eye.mjs';
import { Harness, NANOS_PER_MS, plug, say } from './harness.mjs';
import { Pico } from './pico.mjs';
import { Receiver } from './receiver.mjs';
import { Stopwatch } from './stopwatch.mjs';
import { Text } from './text.mjs';
import { UsbSocket } from './usb_socket.mjs';

const { positionals, values } = parseArgs({
  allowPositionals: true,
  options: { time: { type: 'string', multiple: true, default: [] } },
});
const [transmitterImage, receiverImage, folder, ...eyeCommand] = positionals;
const inFolder = (name) => path.join(folder, name);
const places = (name) => ({ name, flash: inFolder(`${name}.bin`), socket: inFolder(name) });

const eye = new Eye(eyeCommand);
const { board: transmitter, line: transmitterLine } = plug(Pico, {
  ...places('transmitter'),
  elf: fs.readFileSync(transmitterImage),
  report(event) {
    eye.witness(event);
    say({ board: 'transmitter', ...event });
  },
});
const receiverElf = fs.readFileSync(receiverImage);
const stopwatch = values.time.length ? new Stopwatch(receiverElf, values.time) : null;
const uartText = new Text((text) => receiver.report({ text }));
const usbText = new Text((usb) => receiver.report({ usb }));
const usb = new UsbSocket(
  inFolder('receiver_usb'),
  () => say({ listening: 'receiver_usb' }),
  (bytes) => bytes.forEach((byte) => usbText.push(byte)),
);
const { board: receiver, line: receiverLine } = plug(Receiver, {
  ...places('receiver'),
  elf: receiverElf,
  report: (event) => say({ board: 'receiver', ...event }),
  hear: (byte) => uartText.push(byte),
}, { usb, stopwatch });
let now = 0;
let receiverIsOn = false;
let transmitterIsOn = true;
let filmTo = null;

function runTo(line, nanos) {
  if (line.board.nanos < nanos) line.run(nanos - line.board.nanos);
}

async function advance(end) {
  while (now < end) {
    const { camera } = receiver;
    const next = receiverIsOn ? Math.min(end, Math.max(camera.dueNanos, now + 1)) : end;
    if (transmitterIsOn) runTo(transmitterLine, next);
    if (receiverIsOn) runTo(receiverLine, next);
    now = next;
    if (receiverIsOn && receiver.nanos >= camera.dueNanos) await expose(camera);
  }
}

async function expose(camera) {
  const frame = camera.begin();
  if (!frame) return;
  if (transmitterIsOn) runTo(transmitterLine, frame.ns + frame.height * frame.lineNanos);
  const pixels = await eye.see(frame);
  if (filmTo) fs.appendFileSync(filmTo, Buffer.concat([Buffer.from(`P5 ${frame.width} ${frame.height} 255\n`), pixels]));
  camera.show(frame, pixels);
  receiver.report({ frame: frame.number, exposure_ms: (frame.exposureLines * frame.lineNanos) / NANOS_PER_MS, gain: frame.gain });
}

function power(receiverIs) {
  if (receiverIs === 'brown-out') return receiver.brownOut();
  receiverIsOn = receiverIs === 'on';
  if (!receiverIsOn) return;
  receiver.camera.powerUp();
  receiver.startedNanos = now;
  receiver.powerUp();
}

function powerTransmitter(transmitterIs) {
  // The transmitter may be ahead of the receiver.
  const since = Math.max(now, transmitter.nanos);
  if (transmitterIs !== 'on') eye.goDark(since);
  if (transmitterIs === 'brown-out') return transmitter.brownOut();
  transmitterIsOn = transmitterIs === 'on';
  if (!transmitterIsOn) return;
  transmitter.startedNanos = since;
  transmitter.powerUp();
}

function obey(command) {
  if ('lux' in command) transmitter.sensor.lux = command.lux;
  if ('receiver' in command) power(command.receiver);
  if ('transmitter' in command) powerTransmitter(command.transmitter);
  if (command.camera === 'brown-out') receiver.camera.powerUp();
  else if ('camera' in command) receiver.camera.fail(command.camera);
  if ('spoilt' in command) eye.spoil(command.spoilt);
  if ('lost_lines' in command) receiver.camera.lostLines = command.lost_lines;
  if ('scene' in command) eye.change(command.scene);
  if ('film_to' in command) filmTo = command.film_to;
  if ('hang' in command) receiver.hang();
  if ('fault' in command) receiver.fault();
  if ('stack' in command) receiver.fillStack(address(receiverElf, '_stack_end'));
  if ('count_anew' in command) stopwatch.forget();
  if ('enter' in command) receiver.enter(functions(receiverElf).find(({ name }) => name.includes(command.enter)).address);
}

new Harness({ now: () => now, advance, obey, results: () => ({ cycles: stopwatch?.results() }) });
