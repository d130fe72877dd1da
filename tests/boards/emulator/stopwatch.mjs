// Counts the cycles of functions and interrupts from entry to return, including everything that interrupts them, and the functions' stack.

import { functions } from './elf.mjs';

const THREAD = 0, FIRST_IRQ = 16;

export class Stopwatch {
  // `names`: parts of the (mangled) names of functions; an interrupt is `irq` and its number, and `interrupts off` is the time without
  // interrupts.
  constructor(elf, names) {
    this.names = names;
    this.forget();
    this.entries = new Map();
    for (const { name, address } of functions(elf)) {
      const known = names.find((part) => name.includes(part));
      if (known) this.entries.set(address, known);
    }
    this.running = [];
    this.isLocked = false;
  }

  // Resets the counts.
  forget() {
    this.tallies = new Map(this.names.map((name) => [name, { count: 0, least: Infinity, most: 0, sum: 0, stack: 0 }]));
  }

  attach(mcu) {
    const { core } = mcu;
    this.running = [];
    const enter = core.exceptionEntry.bind(core), leave = core.exceptionReturn.bind(core);
    const entered = [];
    core.exceptionEntry = (exception) => {
      entered.push([core.IPSR, core.cycles]);
      enter(exception);
    };
    core.exceptionReturn = (value) => {
      const exception = core.IPSR;
      const [, since] = entered.pop() ?? [THREAD, core.cycles];
      leave(value);
      this.tally(`irq${exception - FIRST_IRQ}`, core.cycles - since);
    };
  }

  step(core) {
    if (core.PM !== this.isLocked) {
      this.isLocked = core.PM;
      if (core.PM) this.lockedSince = core.cycles;
      else this.tally('interrupts off', core.cycles - this.lockedSince);
    }
    const name = this.entries.get(core.PC);
    if (name) this.running.push({ name, returnsTo: core.LR & ~1, stack: core.SP, deepest: core.SP, since: core.cycles });
    const last = this.running.at(-1);
    if (last && core.SP < last.deepest) last.deepest = core.SP;
    if (last && core.PC === last.returnsTo && core.SP >= last.stack) {
      this.running.pop();
      this.tally(last.name, core.cycles - last.since, last.stack - last.deepest);
    }
  }

  tally(name, cycles, stack = 0) {
    const tally = this.tallies.get(name);
    if (!tally) return;
    tally.count += 1;
    tally.sum += cycles;
    tally.least = Math.min(tally.least, cycles);
    tally.most = Math.max(tally.most, cycles);
    tally.stack = Math.max(tally.stack, stack);
  }

  // { name: { count, least, mean, most, stack } } of the functions that ran; stack in bytes.
  results() {
    return Object.fromEntries(
      [...this.tallies].filter(([, { count }]) => count > 0)
        .map(([name, { sum, ...tally }]) => [name, { ...tally, mean: Math.round(sum / tally.count) }]),
    );
  }
}
