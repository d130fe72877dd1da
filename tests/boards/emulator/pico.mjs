// The transmitter: a Pico with a light sensor and a panel.

import { Board } from './board.mjs';
import { Max7219 } from './max7219.mjs';
import { Opt3001 } from './opt3001.mjs';
import { Panel } from './panel.mjs';

export class Pico extends Board {
  constructor(flash, report, { max7219 = false, edges = false, stage = 'gate', faults = [], stopwatch = null } = {}) {
    super(flash, report, { stopwatch });
    Object.assign(this, { edges, stage, faults });
    this.module = max7219 ? new Max7219(this.report) : null;
    this.powerUp();
  }

  attach() {
    const { mcu } = this;
    const light = this.sensor ?? { lux: 0, fault: 'none' };
    this.sensor = Object.assign(new Opt3001(mcu, mcu.i2c[0]), { lux: light.lux });
    this.sensor.fail(light.fault);
    this.module?.connect(mcu);
    this.panel = this.module ?? new Panel(mcu, this.report, this.edges, this.stage, this.faults);
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

  // Loses its supply while the registers keep theirs.
  losePower() {
    this.enterBootLoader();
    this.panel.unpower();
  }
}
