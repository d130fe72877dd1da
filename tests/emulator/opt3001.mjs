// An OPT3001 light sensor on an I2C bus (OPT3001 datasheet, 7.6), and the ways in which it fails.

const ADDRESS = 0x44;
const RESULT = 0x00, CONFIGURATION = 0x01, MANUFACTURER = 0x7e, DEVICE = 0x7f;
const OVERFLOW = 1 << 8, READY = 1 << 7, LONG = 1 << 11, CONTINUOUS = 1 << 10;
const MOST_LX = 0.01 * 2 ** 11 * 4095;
const NANOS_PER_MS = 1e6, WRITE = 0;

export class Opt3001 {
  constructor(mcu, i2c) {
    this.clock = mcu.clock;
    this.lux = 0;
    this.fault = 'none';
    this.registers = { [RESULT]: 0, [CONFIGURATION]: 0xc810, [MANUFACTURER]: 0x5449, [DEVICE]: 0x3001 };
    this.pointer = 0;
    this.bytes = [];
    this.conversion = mcu.clock.createAlarm(() => this.convert());
    this.connect(mcu, i2c);
  }

  // Bytes take nine clocks of the bus; a hanging sensor holds the clock line down.
  connect(mcu, i2c) {
    const after = (finish) => {
      const alarm = mcu.clock.createAlarm(() => this.fault === 'hanging' || finish());
      return () => alarm.schedule((9e9 * (i2c.sclLowPeriod + i2c.sclHighPeriod)) / mcu.clkSys);
    };
    const acknowledge = after(() => i2c.completeConnect(i2c.targetAddress === ADDRESS && this.fault !== 'missing'));
    const written = after(() => i2c.completeWrite(true));
    const read = after(() => i2c.completeRead(this.bytes.shift() ?? 0xff));
    i2c.onStart = () => i2c.completeStart();
    i2c.onStop = () => i2c.completeStop();
    i2c.onConnect = (_, mode) => {
      if (mode === WRITE) this.bytes = [];
      else this.bytes = this.take();
      this.writing = mode === WRITE;
      acknowledge();
    };
    i2c.onWriteByte = (byte) => {
      this.bytes.push(byte);
      if (this.bytes.length === 1) this.pointer = byte;
      if (this.bytes.length === 3) this.put((this.bytes[1] << 8) | this.bytes[2]);
      written();
    };
    i2c.onReadByte = () => read();
  }

  take() {
    const value = this.registers[this.pointer] ?? 0;
    if (this.pointer === CONFIGURATION) this.registers[CONFIGURATION] &= ~READY;
    return [value >> 8, value & 0xff];
  }

  put(value) {
    this.registers[this.pointer] = value;
    if (this.pointer !== CONFIGURATION) return;
    this.registers[CONFIGURATION] &= ~(READY | OVERFLOW);
    this.conversion.cancel();
    if (value & CONTINUOUS) this.startConversion();
  }

  startConversion() {
    const milliseconds = this.registers[CONFIGURATION] & LONG ? 800 : 100;
    this.conversion.schedule(milliseconds * NANOS_PER_MS);
  }

  convert() {
    this.startConversion();
    if (this.fault === 'silent') return;
    this.registers[CONFIGURATION] |= READY;
    if (this.fault === 'stuck') return;
    const overflow = this.lux > MOST_LX;
    this.registers[CONFIGURATION] = (this.registers[CONFIGURATION] & ~OVERFLOW) | (overflow ? OVERFLOW : 0);
    this.registers[RESULT] = encode(Math.min(this.lux, MOST_LX));
  }
}

// The least exponent with which the mantissa fits.
function encode(lux) {
  for (let exponent = 0; ; exponent++) {
    const mantissa = Math.round(lux / (0.01 * 2 ** exponent));
    if (mantissa <= 4095) return (exponent << 12) | mantissa;
  }
}
