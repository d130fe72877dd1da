// An OPT3001 light sensor on an I2C bus (OPT3001 datasheet, 7.6), and its faults.

import { I2cBus } from './i2c_bus.mjs';

const ADDRESS = 0x44;
const RESULT = 0x00, CONFIGURATION = 0x01, MANUFACTURER = 0x7e, DEVICE = 0x7f;
const OVERFLOW = 1 << 8, READY = 1 << 7, LONG = 1 << 11, CONTINUOUS = 1 << 10;
const LEAST_LX = 0.01, FULL_MANTISSA = 4095, LAST_RANGE = 11;
const NANOS_PER_MS = 1e6;
const CLOCKS_LEFT = 7;

export class Opt3001 {
  constructor(mcu, i2c) {
    this.clock = mcu.clock;
    this.lux = 0;
    this.fault = 'none';
    this.registers = { [RESULT]: 0, [CONFIGURATION]: 0xc810, [MANUFACTURER]: 0x5449, [DEVICE]: 0x3001 };
    this.pointer = 0;
    this.bytes = [];
    this.conversion = mcu.clock.createAlarm(() => this.convert());
    this.bus = new I2cBus(mcu, i2c, this);
  }

  answers(address) {
    return address === ADDRESS && this.fault !== 'missing';
  }

  started(writing) {
    this.bytes = writing ? [] : this.take();
  }

  written(byte) {
    this.bytes.push(byte);
    if (this.bytes.length === 1) this.pointer = byte;
    if (this.bytes.length === 3) this.put((this.bytes[1] << 8) | this.bytes[2]);
    return true;
  }

  read() {
    return this.bytes.shift() ?? 0xff;
  }

  // Sets the fault; a clock line that was held down is released.
  fail(fault) {
    this.fault = fault;
    this.bus.hang(fault === 'hanging');
    // It was being read when the processor was reset, or misses clocks of a read.
    if (fault === 'holding') this.bus.holdFor(CLOCKS_LEFT);
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
    const { range, mantissa, overflow } = measure(this.lux, this.registers[CONFIGURATION] >> 12);
    this.registers[CONFIGURATION] = (this.registers[CONFIGURATION] & ~OVERFLOW) | (overflow ? OVERFLOW : 0);
    this.registers[RESULT] = (range << 12) | mantissa;
  }
}

// Measures in the requested range, or in the first one that holds the light.
function measure(lux, asked) {
  const counts = (range) => Math.round(lux / (LEAST_LX * 2 ** range));
  let range = Math.min(asked, LAST_RANGE);
  if (asked > LAST_RANGE) {
    range = 0;
    while (range < LAST_RANGE && counts(range) > FULL_MANTISSA) range += 1;
  }
  return { range, mantissa: Math.min(counts(range), FULL_MANTISSA), overflow: counts(range) > FULL_MANTISSA };
}
