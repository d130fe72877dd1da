// The parts of an ELF file that flashing and timing need.

const LOADED = 1, SYMBOL_TABLE = 2, FUNCTION = 2, TYPE = 0xf;

// The contents of the flash: [{ address, bytes }].
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
  return symbols(elf).filter(({ type }) => type === FUNCTION).map(({ name, address }) => ({ name, address: address & ~1 }));
}

// The address of a symbol.
export function address(elf, wanted) {
  return symbols(elf).find(({ name }) => name === wanted).address;
}

function symbols(elf) {
  const table = { start: elf.readUInt32LE(32), size: elf.readUInt16LE(46), count: elf.readUInt16LE(48) };
  const sections = rows(table).map((at) => ({
    type: elf.readUInt32LE(at + 4), offset: elf.readUInt32LE(at + 16),
    size: elf.readUInt32LE(at + 20), link: elf.readUInt32LE(at + 24),
  }));
  const all = sections.find((section) => section.type === SYMBOL_TABLE);
  if (!all) return [];
  const names = sections[all.link].offset;
  return rows({ start: all.offset, size: 16, count: all.size / 16 }).map((at) => {
    const from = names + elf.readUInt32LE(at);
    return { type: elf[at + 12] & TYPE, name: elf.toString('latin1', from, elf.indexOf(0, from)), address: elf.readUInt32LE(at + 4) };
  });
}

function rows({ start, size, count }) {
  return Array.from({ length: count }, (_, index) => start + index * size);
}
