// The wires between a chain of shift registers and its 64 LEDs, with faults: each is the name and the numbers of `NAME=NUMBER,NUMBER`.
//
//   swap=LED,LED    the wires of two LEDs are exchanged; LED 8·row + column
//   dead-row=ROW    no LED of the row is lit
//   stuck=LED       an LED is always lit
//   late=BITS       the latch is late by BITS edges of the shift clock, 1 to 8

const ROW = 0xffn, ROW_BITS = 8n;

export class Wires {
  constructor(faults = []) {
    this.lateBits = 0;
    this.changes = faults.map((fault) => this.change(...fault.split('=')));
  }

  // Applies a fault to the registers' outputs.
  change(name, numbers) {
    const [one, other] = numbers.split(',').map(BigInt);
    switch (name) {
      case 'swap':
        return (outputs) => {
          const differs = ((outputs >> one) ^ (outputs >> other)) & 1n;
          return outputs ^ (differs << one) ^ (differs << other);
        };
      case 'dead-row': return (outputs) => outputs & ~(ROW << (ROW_BITS * one));
      case 'stuck': return (outputs) => outputs | (1n << one);
      case 'late':
        this.lateBits = Number(one);
        return (outputs) => outputs;
      default: throw new Error(`a wire's fault ${name}`);
    }
  }

  // The LEDs that these outputs light.
  lit(outputs) {
    return this.changes.reduce((lit, change) => change(lit), outputs);
  }
}
