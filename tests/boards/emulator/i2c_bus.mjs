// A device on an I2C bus. A byte takes nine clocks of the bus, and a device that hangs holds the clock line down. A device that was being
// read when the processor was reset, or that missed clocks, holds the data line until it has received the clocks for the rest of its byte,
// and needs a STOP then.

const WRITE = 0, BITS = 9, NANOS_PER_SECOND = 1e9, LOW = 0;
// Both boards have the bus on these pins, with pull-ups.
const DATA_PIN = 4, CLOCK_PIN = 5;

export class I2cBus {
  // `device` has `answers(address)`, `started()`, `written(byte)`, which returns whether it acknowledges, and `read()`.
  constructor(mcu, i2c, device) {
    this.held = null;
    this.hangs = false;
    this.data = mcu.gpio[DATA_PIN];
    this.clock = mcu.gpio[CLOCK_PIN];
    this.data.setInputValue(true);
    this.clock.setInputValue(true);
    let byte = 0;
    const after = (finish) => {
      const alarm = mcu.clock.createAlarm(() => {
        if (this.hangs) this.held = finish;
        else finish();
      });
      return () => alarm.schedule((BITS * NANOS_PER_SECOND * (i2c.sclLowPeriod + i2c.sclHighPeriod)) / mcu.clkSys);
    };
    const acknowledge = after(() => i2c.completeConnect(device.answers(i2c.targetAddress)));
    const written = after(() => i2c.completeWrite(device.written(byte)));
    const read = after(() => i2c.completeRead(device.read()));
    i2c.onStart = () => i2c.completeStart();
    i2c.onStop = () => i2c.completeStop();
    i2c.onConnect = (_, mode) => {
      device.started(mode === WRITE);
      acknowledge();
    };
    i2c.onWriteByte = (value) => {
      byte = value;
      written();
    };
    i2c.onReadByte = () => read();
  }

  // Holds the data line until it has received this many clocks, and then waits for a STOP: the data line rises while the clock is high.
  holdFor(clocks) {
    this.hang(true);
    this.data.setInputValue(false);
    let left = clocks;
    const ignoreClock = this.clock.addListener((level) => {
      if (level === LOW && --left === 0) this.data.setInputValue(true);
    });
    const ignoreData = this.data.addListener((level, before) => {
      if (left > 0 || before !== LOW || this.clock.value === LOW) return;
      ignoreClock();
      ignoreData();
      // The transfer that it did not complete has been given up.
      this.held = null;
      this.hang(false);
    });
  }

  // Holds the clock line down from now on, or releases it.
  hang(hangs) {
    this.hangs = hangs;
    if (hangs) return;
    this.held?.();
    this.held = null;
  }
}
