// The LEDs: eight shift registers on SPI 0, their latch and their output-enable line.
//
// There are two kinds of latch. Some take the shifted bits when the line rises (74HC595, TPIC6B595). Others are transparent while the line
// is high and keep their bits when it falls (TLC5916, STP08DP05). Both must show the same panel.

import { Wires } from './wires.mjs';

const LATCH_PIN = 17, OUTPUT_ENABLE_PIN = 20, CURRENT_PIN = 21, DIMMING_SLICE = 2;
const COMPARE = 0x0c, TOP = 0x10, HIGH = 1;
const LEDS_MASK = (1n << 64n) - 1n;

export class Panel {
  // `report` receives the events. With `edges`, each pulse of the output-enable line is followed, which costs time. `outputEnable` drives
  // that line, and `faults` are those of the wires.
  constructor(mcu, report, edges, outputEnable, faults) {
    this.mcu = mcu;
    this.wires = new Wires(faults);
    this.outputEnable = outputEnable;
    this.shifted = 0n;
    this.litNanos = 0;
    this.litSince = null;
    this.followLatch(mcu.spi[0], mcu.gpio[LATCH_PIN], report);
    mcu.gpio[CURRENT_PIN].addListener((level) => report({ low_current: level !== HIGH }));
    this.followDimming(mcu.pwm.channels[DIMMING_SLICE], report);
    if (edges) this.followEdges(mcu.gpio[OUTPUT_ENABLE_PIN], mcu.gpio[LATCH_PIN]);
    else stopEdges(mcu.pwm.channels[DIMMING_SLICE]);
  }

  followLatch(spi, latch, report) {
    const shiftedBy = (frame, bits, all) =>
      ((this.shifted << BigInt(bits)) | (BigInt(frame) >> BigInt(all - bits))) & LEDS_MASK;
    const { lateBits } = this.wires;
    const show = (panel) => report({ panel: digits(this.wires.lit(panel)) });
    let running = null, taken = null, isLate = false;
    spi.onStart = (frame, bits, bitNanos) => (running = { frame, bits, bitNanos, since: this.mcu.clock.nanos });
    spi.onFrame = (frame, bits) => {
      // After the right edge, the next panel's bits are shifted.
      if (isLate) show(shiftedBy(frame, lateBits, bits));
      isLate = false;
      this.shifted = shiftedBy(frame, bits, bits);
      running = null;
    };
    // In mode 0 the clock rises in the middle of each bit.
    const soFar = () => {
      if (!running) return this.shifted;
      const { frame, bits, bitNanos, since } = running;
      return shiftedBy(frame, Math.min(Math.floor((this.mcu.clock.nanos - since) / bitNanos + 0.5), bits), bits);
    };
    const digits = (panel) => panel.toString(16).padStart(16, '0');
    latch.addListener((level) => {
      if (lateBits > 0) {
        isLate ||= level === HIGH;
      } else if (level === HIGH) {
        taken = soFar();
        show(taken);
      } else if (taken !== null && taken !== soFar()) {
        report({ error: `a transparent latch keeps ${digits(soFar())} of ${digits(taken)}` });
      }
    });
  }

  // A new period or pulse, in clock cycles, for which the LEDs are lit.
  followDimming(slice, report) {
    const write = slice.writeRegister.bind(slice);
    slice.writeRegister = (offset, value) => {
      write(offset, value);
      if (offset === COMPARE || offset === TOP) {
        const [high, period] = [slice.cc & 0xffff, slice.top + 1];
        report({ lit_cycles: this.outputEnable.inverts ? high : Math.max(period - high, 0), period_cycles: period });
      }
    };
  }

  followEdges(pin, latch) {
    const follow = (state) => {
      const { nanos } = this.mcu.clock;
      if (this.litSince !== null) this.litNanos += nanos - this.litSince;
      this.litSince = this.outputEnable.lights(state, latch.value) ? nanos : null;
    };
    follow(pin.value);
    pin.addListener(follow);
    // A supply or a wire has changed.
    this.update = () => follow(pin.value);
  }

  // Time for which the LEDs were lit since the last call.
  takeLitNanos() {
    const { nanos } = this.mcu.clock;
    if (this.litSince !== null) {
      this.litNanos += nanos - this.litSince;
      this.litSince = nanos;
    }
    const lit = this.litNanos;
    this.litNanos = 0;
    return lit;
  }
}

function stopEdges(slice) {
  for (const alarm of [slice.alarmA, slice.alarmB, slice.alarmBottom]) alarm.enable = false;
}
