// An 8×8 module with a MAX7219 on SPI 0, its LOAD at the controller's chip select (MAX7219 datasheet, "Detailed Description").

const LOAD_PIN = 17, SPI_FUNCTION = 1;
const CONTROL = 0x000, PHASE = 1 << 7, POLARITY = 1 << 6;
const NO_OPERATION = 0x0, SHUTDOWN = 0xc;

export class Max7219 {
  // `report` receives each change of a register. At power-up, all are 0: the chip is in shutdown.
  constructor(report) {
    this.report = report;
    this.registers = new Uint8Array(16);
    this.litNanos = 0;
    this.litSince = null;
  }

  // A board that was reset finds the module in its last state.
  connect(mcu) {
    this.takeLitNanos(true);
    this.clock = mcu.clock;
    this.litSince = this.isLit() ? 0 : null;
    const spi = mcu.spi[0];
    let shifted = 0;
    spi.onFrame = (frame, bits) => {
      shifted = ((shifted << bits) | frame) & 0xffff;
      // Only in this mode does the controller raise its chip select after each frame (RP2040 datasheet, 4.4.3.9), on its own pin.
      const mode = spi.readUint32(CONTROL) & (PHASE | POLARITY);
      if (mcu.gpio[LOAD_PIN].functionSelect === SPI_FUNCTION && mode === 0) this.load(shifted);
    };
  }

  // LOAD rises: the last sixteen bits take effect.
  load(word) {
    const register = (word >> 8) & 0xf, value = word & 0xff;
    if (register === NO_OPERATION || this.registers[register] === value) return;
    this.takeLitNanos(true);
    this.registers[register] = value;
    if (register === SHUTDOWN) this.litSince = this.isLit() ? this.clock.nanos : null;
    this.report({ register, value });
  }

  isLit() {
    return (this.registers[SHUTDOWN] & 1) === 1;
  }

  // Time out of shutdown since the last call.
  takeLitNanos(keep = false) {
    if (this.litSince !== null && this.clock) {
      const { nanos } = this.clock;
      this.litNanos += nanos - this.litSince;
      this.litSince = nanos;
    }
    const lit = this.litNanos;
    if (!keep) this.litNanos = 0;
    return lit;
  }
}
