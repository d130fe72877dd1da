// The parts of an ELF file that a flashing tool and a stop-watch need.

const LOADED = 1, SYMBOL_TABLE = 2, FUNCTION = 2;

// What goes into the flash: [{ address, bytes }].
export function segments(elf) {
  const table = { start: elf.readUInt32LE(28), size: elf.readUInt16LE(42), count: elf.readUInt16LE(44) };
  return rows(table)
    .filter((at) => elf.readUInt32LE(at) === LOADED && elf.readUInt32LE(at + 16) > 0)
    .map((at) => {
      const offset = elf.readUInt32LE(at + 4), size = elf.readUInt32LE(at + 16);
      return { address: elf.readUInt32LE(at + 12), bytes: elf.subarray(offset, offset + size) };
    });
}

// Functions by name: [{ name, address }].
export function functions(elf) {
  const table = { start: elf.readUInt32LE(32), size: elf.readUInt16LE(46), count: elf.readUInt16LE(48) };
  const sections = rows(table).map((at) => ({
    type: elf.readUInt32LE(at + 4), offset: elf.readUInt32LE(at + 16),
    size: elf.readUInt32LE(at + 20), link: elf.readUInt32LE(at + 24),
  }));
  const symbols = sections.find((section) => section.type === SYMBOL_TABLE);
  if (!symbols) return [];
  const names = sections[symbols.link].offset;
  return rows({ start: symbols.offset, size: 16, count: symbols.size / 16 })
    .filter((at) => (elf[at + 12] & 0xf) === FUNCTION)
    .map((at) => {
      const from = names + elf.readUInt32LE(at);
      return { name: elf.toString('latin1', from, elf.indexOf(0, from)), address: elf.readUInt32LE(at + 4) & ~1 };
    });
}

function rows({ start, size, count }) {
  return Array.from({ length: count }, (_, index) => start + index * size);
}
