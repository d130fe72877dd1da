// The stage between a Pico's pin and the output enable of the registers, which lights the LEDs when low: docs/hardware/road-kit.md, "Dark
// without a program". The registers and the stage have a separate supply, which stays on.

// The states of a pin (rp2040js, `GPIOPinState`), and that of a chip without power, whose protection diodes hold it near 0 V.
const LOW = 0, HIGH = 1, FLOATING = 2, PULLED_UP = 3, PULLED_DOWN = 4;
export const UNPOWERED = -1;

const SUPPLY_V = 3.3, DIODE_V = 0.6;
// RP2040 datasheet, "Pin Specifications": the pads' own resistors, 50 to 80 kΩ.
const PAD_KOHM = 50;
// 74AHCT1G04 and 74AHCT125: the input levels, V.
const LOW_MOST_V = 0.8, HIGH_LEAST_V = 2.0;

// `gate`: the inverter with its pull-down of 4.7 kΩ. `buffer`: a 74AHCT125 that is always enabled, without its own resistor.
const STAGES = {
  gate: { inverts: true, downKohm: 4.7 },
  buffer: { inverts: false, downKohm: Infinity },
};

export class OutputEnable {
  constructor(stage) {
    Object.assign(this, STAGES[stage]);
  }

  // Whether the LEDs are lit while the pin is in this state.
  lights(pin) {
    const volts = this.inputVolts(pin);
    if (volts > LOW_MOST_V && volts < HIGH_LEAST_V) throw new Error(`output enable is undefined: ${volts} V at its stage`);
    const isHigh = volts >= HIGH_LEAST_V;
    return this.inverts ? isHigh : !isHigh;
  }

  inputVolts(pin) {
    switch (pin) {
      case HIGH: return SUPPLY_V;
      case LOW: case PULLED_DOWN: return 0;
      case UNPOWERED: return Number.isFinite(this.downKohm) ? 0 : DIODE_V;
      case PULLED_UP: return Number.isFinite(this.downKohm) ? (SUPPLY_V * this.downKohm) / (this.downKohm + PAD_KOHM) : SUPPLY_V;
      case FLOATING: return Number.isFinite(this.downKohm) ? 0 : SUPPLY_V / 2;
      default: throw new Error(`a pin in state ${pin}`);
    }
  }
}
