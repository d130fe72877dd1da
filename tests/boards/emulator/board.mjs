// A Raspberry Pi Pico in simulated time: processor and memories. Each kind of board overrides `attach` for the parts on its pins.

import { Simulator } from 'rp2040js';
import { BootRom } from './boot_rom.mjs';
import { repair } from './repairs.mjs';

// Behind the 256 bytes of the second-stage boot loader, which the emulator does not need.
const VECTORS = 0x10000100;
const WATCHDOG = 0x40058, TIMED_OUT = 1;
const HARD_FAULT = 3;
const NANOS_PER_SECOND = 1e9;

export class Board {
  constructor(flash, report, { stopwatch = null } = {}) {
    Object.assign(this, { flash, stopwatch });
    this.startedNanos = 0;
    this.report = (event) => report({ ns: Math.round(this.nanos), ...event });
  }

  // Connects the parts to the pins of a processor that has just started.
  attach() {}

  get nanos() {
    return this.startedNanos + (this.clock?.nanos ?? 0);
  }

  powerUp() {
    const { rp2040: mcu, clock } = new Simulator();
    mcu.logger = { debug() {}, info() {}, warn() {}, error: (part, text) => this.report({ error: `${part}: ${text}` }) };
    repair(mcu, () => this.hang());
    this.flash.map(mcu.flash);
    Object.assign(this, { mcu, clock, wanted: null, hung: false });
    this.rom = new BootRom(mcu, this.flash);
    this.attach();
    mcu.uart[0].onByte = (byte) => this.onSerial?.(byte);
    const watchdog = mcu.peripherals[WATCHDOG];
    watchdog.onWatchdogTrigger = () => {
      this.wanted = 'reset';
      // Otherwise it would trigger again before any time has passed.
      watchdog.alarm.enable = false;
    };
    this.stopwatch?.attach(mcu);
    const { core } = mcu;
    core.VTOR = VECTORS;
    core.SP = mcu.readUint32(VECTORS);
    core.PC = mcu.readUint32(VECTORS + 4) & ~1;
  }

  // A reset by the watchdog: the chip restarts, and its register has the reason. The memory keeps its contents.
  reset() {
    const { sram } = this.mcu;
    const { reason } = this.mcu.peripherals[WATCHDOG];
    this.startedNanos += this.clock.nanos;
    this.powerUp();
    this.mcu.sram.set(sram);
    this.mcu.peripherals[WATCHDOG].reason = reason;
    this.report({ reset: reason === TIMED_OUT ? 'timed out' : 'forced' });
  }

  // The supply fails for a moment: only the flash keeps its contents.
  brownOut() {
    this.startedNanos += this.clock.nanos;
    this.powerUp();
    this.report({ reset: 'brown-out' });
  }

  // Stops the processor, as a loop with interrupts off would, or lets it continue.
  hang(on = true) {
    this.hung = on;
  }

  // Makes the processor fault.
  fault() {
    const { core } = this.mcu;
    core.waiting = false;
    this.report({ fault_at: core.PC });
    core.exceptionEntry(HARD_FAULT);
    core.PC &= ~1;
  }

  // Fills the stack except for two words.
  fillStack(end) {
    this.mcu.core.SP = end + 8;
  }

  // Continues in another function, with interrupts off.
  enter(address) {
    const { core } = this.mcu;
    core.PM = true;
    core.waiting = false;
    core.PC = address;
  }

  run(nanos) {
    // Compares the clock, not `this.nanos`, whose sum is rounded and may stay below the end after the clock has reached it.
    let end = this.clock.nanos + nanos;
    while (this.clock.nanos < end) {
      this.runUntil(end);
      if (this.wanted === 'reset') {
        // The reset starts a new clock at 0.
        end -= this.clock.nanos;
        this.reset();
      }
    }
  }

  // Runs until the clock shows this time, or the board wants to be reset.
  runUntil(end) {
    const { clock, mcu, rom, stopwatch } = this;
    const { core } = mcu;
    const cycleNanos = NANOS_PER_SECOND / mcu.clkSys;
    while (clock.nanos < end && !this.wanted) {
      if (core.waiting || this.hung) {
        const sleep = clock.nanosToNextAlarm;
        // At least one cycle: a smaller step would vanish in the time, which is a sum of floating-point numbers.
        clock.tick(Math.max(Math.min(sleep, end - clock.nanos), cycleNanos));
      } else if (rom.holds(core.PC)) {
        rom.enter();
      } else {
        stopwatch?.step(core);
        clock.tick(core.executeInstruction() * cycleNanos);
      }
    }
  }

  // Receives a byte at UART 0.
  feed(byte) {
    this.mcu.uart[0].feedByte(byte);
  }

  // The duration of a byte on its line: start, eight data and stop bits.
  byteNanos() {
    return (10 * NANOS_PER_SECOND) / (this.mcu.uart[0].baudRate || 115200);
  }
}
