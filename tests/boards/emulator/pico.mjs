// The transmitter: a Pico with a light sensor and a panel.

import { Board } from './board.mjs';
import { Max7219 } from './max7219.mjs';
import { Opt3001 } from './opt3001.mjs';
import { OutputEnable } from './output_enable.mjs';
import { Panel } from './panel.mjs';

export class Pico extends Board {
  // `kit` has the options of `OutputEnable`.
  constructor(flash, report, { max7219 = false, edges = false, kit = {}, faults = [], stopwatch = null } = {}) {
    super(flash, report, { stopwatch });
    Object.assign(this, { edges, faults, outputEnable: new OutputEnable(kit) });
    this.module = max7219 ? new Max7219(this.report) : null;
    this.powerUp();
  }

  attach() {
    const { mcu } = this;
    const light = this.sensor ?? { lux: 0, fault: 'none' };
    this.sensor = Object.assign(new Opt3001(mcu, mcu.i2c[0]), { lux: light.lux });
    this.sensor.fail(light.fault);
    this.module?.connect(mcu);
    this.panel = this.module ?? new Panel(mcu, this.report, this.edges, this.outputEnable, this.faults);
  }

  reset() {
    const litNanos = this.panel.takeLitNanos();
    super.reset();
    this.panel.litNanos += litNanos;
  }

  // Restarts in the boot loader that loads programs over USB, and stays there: it leaves the pins as after a reset.
  enterBootLoader() {
    this.brownOut();
    this.hang();
  }

  // Loses its power. What it does not feed keeps its own supply.
  losePower() {
    this.enterBootLoader();
    this.outputEnable.hasPower = false;
    this.panel.update();
  }

  // The wire from the dimming's pin to the gate breaks.
  breakWire() {
    this.outputEnable.hasWire = false;
    this.panel.update();
  }

  // The LEDs lose their supply, and all else that the Pico does not feed.
  cutSupply() {
    this.outputEnable.hasSupply = false;
    this.panel.update();
  }
}
