// A Raspberry Pi Pico on simulated time: processor, memories, light sensor and panel.

import { Simulator } from 'rp2040js';
import { BootRom } from './boot_rom.mjs';
import { Opt3001 } from './opt3001.mjs';
import { Panel } from './panel.mjs';
import { repair } from './repairs.mjs';

// Behind the 256 bytes of the second-stage boot loader, which the emulator does not need.
const VECTORS = 0x10000100;
const WATCHDOG = 0x40058;
const NANOS_PER_SECOND = 1e9;

export class Pico {
  constructor(flash, report, { edges = false, stopwatch = null } = {}) {
    Object.assign(this, { flash, edges, stopwatch });
    this.startedNanos = 0;
    this.report = (event) => report({ ns: Math.round(this.nanos), ...event });
    this.powerUp();
  }

  get nanos() {
    return this.startedNanos + (this.clock?.nanos ?? 0);
  }

  powerUp() {
    const light = this.sensor ?? { lux: 0, fault: 'none' };
    const { rp2040: mcu, clock } = new Simulator();
    mcu.logger = { debug() {}, info() {}, warn() {}, error: (part, text) => this.report({ error: `${part}: ${text}` }) };
    repair(mcu);
    this.flash.map(mcu.flash);
    Object.assign(this, { mcu, clock, wanted: null });
    this.rom = new BootRom(mcu, this.flash);
    this.sensor = Object.assign(new Opt3001(mcu, mcu.i2c[0]), { lux: light.lux, fault: light.fault });
    this.panel = new Panel(mcu, this.report, this.edges);
    mcu.uart[0].onByte = (byte) => this.onSerial?.(byte);
    mcu.peripherals[WATCHDOG].onWatchdogTrigger = () => (this.wanted = 'reset');
    this.stopwatch?.attach(mcu);
    const { core } = mcu;
    core.VTOR = VECTORS;
    core.SP = mcu.readUint32(VECTORS);
    core.PC = mcu.readUint32(VECTORS + 4) & ~1;
  }

  reset() {
    this.startedNanos += this.clock.nanos;
    this.powerUp();
    this.report({ reset: 'watchdog' });
  }

  run(nanos) {
    const end = this.nanos + nanos;
    while (this.nanos < end) {
      this.runUntil(end - this.startedNanos);
      if (this.wanted === 'reset') this.reset();
    }
  }

  runUntil(end) {
    const { clock, mcu, rom, stopwatch } = this;
    const { core } = mcu;
    const cycleNanos = NANOS_PER_SECOND / mcu.clkSys;
    while (clock.nanos < end && !this.wanted) {
      if (core.waiting) {
        const sleep = clock.nanosToNextAlarm;
        clock.tick(sleep > 0 ? Math.min(sleep, end - clock.nanos) : cycleNanos);
      } else if (rom.holds(core.PC)) {
        rom.enter();
      } else {
        stopwatch?.step(core);
        clock.tick(core.executeInstruction() * cycleNanos);
      }
    }
  }

  // A byte arrives at UART 0.
  feed(byte) {
    this.mcu.uart[0].feedByte(byte);
  }

  // What a byte takes on its line: start, eight data and stop bits.
  byteNanos() {
    return (10 * NANOS_PER_SECOND) / (this.mcu.uart[0].baudRate || 115200);
  }
}
