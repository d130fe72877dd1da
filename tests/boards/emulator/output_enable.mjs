// The stage between a Pico's pin and the output enable of the registers, which lights the LEDs when low, and the supplies of registers,
// stage and LEDs: docs/hardware/road-kit.md, "Dark without a program". A state in which the LEDs may shine counts as lit, because the
// registers may hold anything.

// The states of a pin (rp2040js, `GPIOPinState`), and that of a chip without power, whose protection diodes hold it near 0 V.
const LOW = 0, HIGH = 1, FLOATING = 2, PULLED_UP = 3, PULLED_DOWN = 4, UNPOWERED = -1;

const PICO_V = 3.3, OWN_V = 5, DIODE_V = 0.6;
// RP2040 datasheet, "Pin Specifications": the pads' own resistors, 50 to 80 kΩ.
const PAD_KOHM = 50;
// 74AHCT1G04, 74LVC1G04 and 74AHCT125: the input levels, V.
const LOW_MOST_V = 0.8, HIGH_LEAST_V = 2.0;
// The least supplies: of a 74HC595, of the stage at the Pico's 3.3 V and at 5 V, and of a red LED.
const REGISTER_LEAST_V = 2.0, STAGE_LEAST_AT_3V3_V = 2.7, STAGE_LEAST_V = 4.5, LED_LEAST_V = 2.0;

// `gate`: the inverter with its pull-down of 4.7 kΩ. `no-resistor`: without that. `buffer`: a 74AHCT125 that is always enabled.
const STAGES = {
  gate: { inverts: true, downKohm: 4.7 },
  'no-resistor': { inverts: true, downKohm: Infinity },
  buffer: { inverts: false, downKohm: Infinity },
};

export class OutputEnable {
  // The Pico feeds those of 'gate' and 'registers' that `at3v3` names. A supply of their own feeds the others and the LEDs. With
  // `isDirect`, no shifter is between the Pico's lines and the registers, whose inputs have diodes to their supply, as those of a 74HC595.
  constructor({ stage = 'gate', at3v3 = [], isDirect = false } = {}) {
    Object.assign(this, STAGES[stage], { at3v3, isDirect });
    // The Pico's power, the wire from its pin to the stage, and the supply of their own.
    Object.assign(this, { hasPower: true, hasWire: true, hasSupply: true });
  }

  // Whether the LEDs may be lit while the pin and the latch's are in these states.
  lights(pin, latch) {
    const own = this.hasSupply ? OWN_V : this.fedByLinesVolts(latch);
    const at = (part) => (this.at3v3.includes(part) ? this.hasPower * PICO_V : own);
    if (own <= LED_LEAST_V || at('registers') < REGISTER_LEAST_V) return false;
    // Without enough supply, the output of the stage is undefined.
    if (at('gate') < (this.at3v3.includes('gate') ? STAGE_LEAST_AT_3V3_V : STAGE_LEAST_V)) return true;
    const volts = this.inputVolts(this.statePresent(pin));
    return this.inverts ? volts > LOW_MOST_V : volts < HIGH_LEAST_V;
  }

  // A program that drives the lines drives them high at times.
  fedByLinesVolts(latch) {
    const isDriven = this.hasPower && (latch === LOW || latch === HIGH);
    return this.isDirect && isDriven && !this.at3v3.includes('registers') ? PICO_V - DIODE_V : 0;
  }

  // What the stage's input sees of the pin.
  statePresent(pin) {
    if (!this.hasWire) return FLOATING;
    return this.hasPower ? pin : UNPOWERED;
  }

  inputVolts(state) {
    const isHeld = Number.isFinite(this.downKohm);
    switch (state) {
      case HIGH: return PICO_V;
      case LOW: case PULLED_DOWN: return 0;
      case UNPOWERED: return isHeld ? 0 : DIODE_V;
      case PULLED_UP: return isHeld ? (PICO_V * this.downKohm) / (this.downKohm + PAD_KOHM) : PICO_V;
      case FLOATING: return isHeld ? 0 : PICO_V / 2;
      default: throw new Error(`a pin in state ${state}`);
    }
  }
}
