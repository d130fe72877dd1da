// The functions of the RP2040's boot ROM that the firmware calls (datasheet, 2.8.3): they erase and program the flash. The emulator does
// not include the ROM itself; here, its table leads to addresses at which the run loop calls `enter`.

const FUNCTION_TABLE_POINTER = 0x14, DATA_TABLE_POINTER = 0x16, LOOKUP_POINTER = 0x18;
const TABLE = 0x40, LOOKUP = 0x100, FUNCTIONS = 0x200, SIZE = 0x4000;
const NANOS_PER_MS = 1e6;

// W25Q16JV datasheet, 9.6: typical and maximum times.
const TYPICAL_MS = { sector: 45, page: 0.4 }, LONGEST_MS = { sector: 400, page: 3 };
const SECTOR = 4096, PAGE = 256;

export class BootRom {
  constructor(mcu, flash) {
    this.mcu = mcu;
    const takes = () => (flash.isSlow ? LONGEST_MS : TYPICAL_MS);
    const codes = {
      IF: () => {}, EX: () => {}, FC: () => {}, CX: () => {},
      RE: (offset, count) => this.inSteps(offset, count, SECTOR, takes().sector, (at) => flash.erase(at, SECTOR)),
      RP: (offset, data, count) =>
        this.inSteps(offset, count, PAGE, takes().page, (at) => flash.program(at, this.bytes(data + at - offset, PAGE))),
      C4: (to, from, count) => {
        for (let at = 0; at < count; at += 4) mcu.writeUint32(to + at, mcu.readUint32(from + at));
        return to;
      },
    };
    this.calls = Object.entries(codes);
    const rom = new DataView(mcu.bootrom.buffer);
    rom.setUint16(FUNCTION_TABLE_POINTER, TABLE, true);
    rom.setUint16(DATA_TABLE_POINTER, TABLE, true);
    rom.setUint16(LOOKUP_POINTER, LOOKUP | 1, true);
  }

  holds(address) {
    return address < SIZE;
  }

  // Executes the function at the program counter and returns to its caller.
  enter() {
    const { core } = this.mcu;
    const [first, second, third] = core.registers;
    const result = core.PC === LOOKUP ? this.lookUp(second) : this.call(core.PC, first, second, third);
    if (result !== undefined) core.registers[0] = result;
    core.PC = core.LR & ~1;
  }

  lookUp(code) {
    const name = String.fromCharCode(code & 0xff, code >> 8);
    const index = this.calls.findIndex(([known]) => known === name);
    if (index < 0) throw new Error(`the firmware asks the boot ROM for ${name}, which is not emulated`);
    return (FUNCTIONS + 4 * index) | 1;
  }

  call(address, ...operands) {
    const known = this.calls[(address - FUNCTIONS) / 4];
    if (!known) throw new Error(`the firmware runs at ${address.toString(16)}, where nothing is`);
    return known[1](...operands.map((operand) => operand >>> 0));
  }

  // The processor is stopped while everything else continues.
  inSteps(offset, count, step, milliseconds, work) {
    for (let at = offset; at < offset + count; at += step) {
      work(at);
      this.mcu.clock.tick(milliseconds * NANOS_PER_MS);
    }
  }

  bytes(address, count) {
    return Uint8Array.from({ length: count }, (_, at) => this.mcu.readUint8(address + at));
  }
}
