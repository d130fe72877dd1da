// What the LEDs do: eight shift registers on SPI 0, their latch and their output-enable line.

const LATCH_PIN = 17, OUTPUT_ENABLE_PIN = 20, CURRENT_PIN = 21, DIMMING_SLICE = 2;
const COMPARE = 0x0c, TOP = 0x10, HIGH = 1, LOW = 0;
const LEDS_MASK = (1n << 64n) - 1n;

export class Panel {
  // `report` takes what happened; with `edges`, each pulse of the output-enable line is followed, which costs time.
  constructor(mcu, report, edges) {
    this.mcu = mcu;
    this.shifted = 0n;
    this.litNanos = 0;
    this.litSince = null;
    mcu.spi[0].onFrame = (frame, bits) => {
      this.shifted = ((this.shifted << BigInt(bits)) | BigInt(frame)) & LEDS_MASK;
    };
    mcu.gpio[LATCH_PIN].addListener((level) => {
      if (level === HIGH) report({ panel: this.shifted.toString(16).padStart(16, '0') });
    });
    mcu.gpio[CURRENT_PIN].addListener((level) => report({ low_current: level !== HIGH }));
    this.followDimming(mcu.pwm.channels[DIMMING_SLICE], report);
    if (edges) this.followEdges(mcu.gpio[OUTPUT_ENABLE_PIN]);
    else stopEdges(mcu.pwm.channels[DIMMING_SLICE]);
  }

  // A new period or pulse, in clock cycles.
  followDimming(slice, report) {
    const write = slice.writeRegister.bind(slice);
    slice.writeRegister = (offset, value) => {
      write(offset, value);
      if (offset === COMPARE || offset === TOP) {
        report({ lit_cycles: slice.cc & 0xffff, period_cycles: slice.top + 1 });
      }
    };
  }

  // Low lights the LEDs; a pull-up holds the line high when nothing drives it.
  followEdges(pin) {
    pin.addListener((level) => {
      const { nanos } = this.mcu.clock;
      if (this.litSince !== null) this.litNanos += nanos - this.litSince;
      this.litSince = level === LOW ? nanos : null;
    });
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
