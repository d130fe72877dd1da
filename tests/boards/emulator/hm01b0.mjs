// A Himax HM01B0 camera: its registers on the I2C bus, the timing of its frames, and its faults. The registers follow the datasheet's map,
// as public drivers use it.

import { I2cBus } from './i2c_bus.mjs';
import { PixelPort } from './pixel_port.mjs';

const ADDRESS = 0x24;
const MODEL_ID = [0x01, 0xb0], ANOTHER_ID = [0x03, 0x60];
const MODEL_ID_HIGH = 0x0000, FRAME_COUNT = 0x0005, MODE_SELECT = 0x0100, SOFTWARE_RESET = 0x0103, COMMAND_UPDATE = 0x0104;
const INTEGRATION = 0x0202, ANALOG_GAIN = 0x0205, DIGITAL_GAIN = 0x020e, FRAME_LENGTH = 0x0340, LINE_LENGTH = 0x0342;
const BLACK_TARGET = 0x1003;
const READOUT_X = 0x0383, READOUT_Y = 0x0387, BINNING = 0x0390, QVGA_WINDOW = 0x3010, CLOCK_DIVIDER = 0x3060;
const EVERY_OTHER = 3, STREAMING = 1;
const CLOCKS_LEFT = 7;

// The oscillator of a module, and the columns and rows of the sensor.
const MASTER_CLOCK_HZ = 24e6, NANOS_PER_SECOND = 1e9;
const COLUMNS = 324, ROWS = 324, WINDOW_ROWS = 244;

const RESET_VALUES = {
  [INTEGRATION]: 0x01, [INTEGRATION + 1]: 0x08, [ANALOG_GAIN]: 0x00, [DIGITAL_GAIN]: 0x01, [DIGITAL_GAIN + 1]: 0x00,
  [FRAME_LENGTH]: 0x02, [FRAME_LENGTH + 1]: 0x32, [LINE_LENGTH]: 0x01, [LINE_LENGTH + 1]: 0x72,
  [BLACK_TARGET]: 0x20, [READOUT_X]: 0x01, [READOUT_Y]: 0x01, [BINNING]: 0x00, [QVGA_WINDOW]: 0x01, [CLOCK_DIVIDER]: 0x08,
};

export class Hm01b0 {
  // `report` receives events; the fault is one of
  //   none; missing: no acknowledge; wrong_id: another chip; deaf: data is not acknowledged; hanging: the clock line stays down;
  //   frozen: frames stop; misread: a register returns a wrong value; holding: it holds the data line when the processor starts
  constructor(report) {
    Object.assign(this, { report, fault: 'none', lostLines: [] });
    this.powerUp();
  }

  // Resets the registers to their values at power-up, and stops frames.
  powerUp() {
    this.registers = new Map(Object.entries(RESET_VALUES).map(([address, value]) => [Number(address), value]));
    this.taken = new Map(this.registers);
    this.pointer = 0;
    this.received = 0;
    this.frames = 0;
    this.dueNanos = Infinity;
    this.port?.stop();
  }

  // Connects to the pins of a processor that has just started: the camera keeps its registers and continues its frames.
  connect(board) {
    this.board = board;
    this.port?.stop();
    this.bus = new I2cBus(board.mcu, board.mcu.i2c[0], this);
    this.port = new PixelPort(board.mcu, this.report);
    this.fail(this.fault);
    if (this.fault === 'holding') this.bus.holdFor(CLOCKS_LEFT);
  }

  fail(fault) {
    this.fault = fault;
    this.bus.hang(fault === 'hanging');
  }

  answers(address) {
    return address === ADDRESS && this.fault !== 'missing';
  }

  started(writing) {
    if (writing) this.received = 0;
  }

  // Two bytes of address, then values for this register and the following ones.
  written(byte) {
    if (this.fault === 'deaf') return false;
    if (this.received < 2) this.pointer = ((this.pointer << 8) | byte) & 0xffff;
    else this.put(this.pointer++, byte);
    this.received += 1;
    return true;
  }

  read() {
    return this.get(this.pointer++);
  }

  get(address) {
    const id = this.fault === 'wrong_id' ? ANOTHER_ID : MODEL_ID;
    if (address === FRAME_COUNT) return this.frames & 0xff;
    const value = id[address - MODEL_ID_HIGH] ?? this.registers.get(address) ?? 0;
    return this.fault === 'misread' && address === LINE_LENGTH ? value ^ 1 : value;
  }

  put(address, value) {
    if (address === SOFTWARE_RESET) return this.powerUp();
    const streamed = this.registers.get(MODE_SELECT) & STREAMING;
    this.registers.set(address, value);
    // Drivers interpret the datasheet in two ways: a 1 or a 0 ends the changes. Either applies the changes before it.
    if (address === COMMAND_UPDATE) this.taken = new Map(this.registers);
    if (address === MODE_SELECT && (value & STREAMING) !== streamed) this.stream(value & STREAMING);
  }

  // The first frame comes after one frame time, in which it is exposed.
  stream(on) {
    this.taken = new Map(this.registers);
    const { frameNanos } = this.timing();
    this.dueNanos = on ? this.board.nanos + frameNanos : Infinity;
    this.report({ streaming: Boolean(on), frame_ms: frameNanos / 1e6 });
  }

  word(address) {
    return (this.taken.get(address) << 8) | this.taken.get(address + 1);
  }

  timing() {
    const pixelNanos = (NANOS_PER_SECOND * (8 >> (this.taken.get(CLOCK_DIVIDER) & 3))) / MASTER_CLOCK_HZ;
    const lineNanos = this.word(LINE_LENGTH) * pixelNanos;
    return { pixelNanos, lineNanos, frameNanos: this.word(FRAME_LENGTH) * lineNanos };
  }

  // Begins the frame that is due. Returns what its pixels are drawn from, or nothing if there is no frame.
  begin() {
    const { taken } = this;
    const { pixelNanos, lineNanos, frameNanos } = this.timing();
    const binned = taken.get(BINNING) !== 0 && taken.get(READOUT_X) === EVERY_OTHER && taken.get(READOUT_Y) === EVERY_OTHER;
    const rows = taken.get(QVGA_WINDOW) & 1 ? WINDOW_ROWS : ROWS;
    const frame = {
      number: this.frames,
      ns: this.dueNanos,
      width: binned ? COLUMNS / 2 : COLUMNS,
      height: binned ? rows / 2 : rows,
      binned,
      pixelNanos,
      lineNanos,
      frameNanos,
      exposureLines: Math.min(Math.max(this.word(INTEGRATION), 2), this.word(FRAME_LENGTH) - 2),
      black: taken.get(BLACK_TARGET),
      gain: 2 ** ((taken.get(ANALOG_GAIN) >> 4) & 7) * (this.word(DIGITAL_GAIN) / 256),
    };
    this.dueNanos += frameNanos;
    this.frames += 1;
    return this.fault === 'frozen' ? null : frame;
  }

  // Clocks the pixels of the frame out, except for lost lines.
  show(frame, pixels) {
    this.port.show(frame, pixels, new Set(this.lostLines));
  }
}
