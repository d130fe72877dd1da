// A camera's parallel port. Pixels change on the falling edge of PCLK and are sampled on the rising one. HREF is high during the pixels of
// a line, VSYNC during the lines of a frame.

const D0_PIN = 6, DATA_BITS = 8, PCLK_PIN = 14, HREF_PIN = 15, VSYNC_PIN = 16;
const NANOS_PER_SECOND = 1e9;

export class PixelPort {
  constructor(mcu, report) {
    Object.assign(this, { mcu, report, frame: null });
    this.alarm = mcu.clock.createAlarm(() => this.step());
    this.data = mcu.gpio.slice(D0_PIN, D0_PIN + DATA_BITS);
    for (const pin of [PCLK_PIN, HREF_PIN, VSYNC_PIN]) this.drive(pin, false);
  }

  // Sends a frame from now on; `lost` has the numbers of missing lines.
  show(frame, pixels, lost) {
    if (this.frame) this.report({ error: 'camera: a frame begins before the last is out' });
    Object.assign(this, { frame, pixels, lost, line: 0, column: 0, complained: false });
    this.startedNanos = this.mcu.clock.nanos;
    this.drive(VSYNC_PIN, true);
    this.wait(0);
  }

  stop() {
    this.alarm.cancel();
    this.frame = null;
    for (const pin of [PCLK_PIN, HREF_PIN, VSYNC_PIN]) this.drive(pin, false);
  }

  // Waits until this many ns after the frame's beginning.
  wait(nanos) {
    this.alarm.schedule(Math.max(this.startedNanos + nanos - this.mcu.clock.nanos, 0));
  }

  step() {
    const { frame } = this;
    if (this.line === frame.height) {
      this.drive(VSYNC_PIN, false);
      this.frame = null;
      return;
    }
    const lineStart = this.line * frame.lineNanos;
    if (this.column === 0 && this.lost.has(this.line)) this.endLine();
    else if (this.column === frame.width) {
      this.drive(HREF_PIN, false);
      this.endLine();
    } else {
      // The first pixel comes half a pixel later.
      if (this.column === 0) this.expectWithinHalfAPixel(this.drive(HREF_PIN, true));
      this.clockPixel(this.pixels[this.line * frame.width + this.column]);
      this.column += 1;
      this.wait(lineStart + this.column * frame.pixelNanos);
    }
  }

  endLine() {
    this.line += 1;
    this.column = 0;
    this.wait(this.line * this.frame.lineNanos);
  }

  // Both edges at once: the PIO program between them takes no emulated time, but its cycles are checked against the available time.
  clockPixel(value) {
    for (let bit = 0; bit < DATA_BITS; bit++) this.data[bit].rawInputValue = (value & (1 << bit)) !== 0;
    this.expectWithinHalfAPixel(this.drive(PCLK_PIN, true));
    this.expectWithinHalfAPixel(this.drive(PCLK_PIN, false));
  }

  expectWithinHalfAPixel(cycles) {
    const given = (this.frame.pixelNanos / 2 / NANOS_PER_SECOND) * this.mcu.clkSys;
    if (cycles <= given || this.complained) return;
    this.complained = true;
    this.report({ late: `the PIO may take ${cycles} cycles where the camera gives it ${given.toFixed(1)}` });
  }

  // Sets a pin. Returns the maximum number of cycles that a PIO's program takes until it waits again.
  drive(pin, level) {
    this.mcu.gpio[pin].setInputValue(level);
    return Math.max(...this.mcu.pio.map((pio) => pio.settle()));
  }
}
