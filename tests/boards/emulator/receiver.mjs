// The receiver: a Pico with a camera, a lamp, and a computer on its USB socket.

import { Board } from './board.mjs';
import { Hm01b0 } from './hm01b0.mjs';

const LAMP_PIN = 25, HIGH = 1;

export class Receiver extends Board {
  constructor(flash, report, { usb, stopwatch = null }) {
    super(flash, report, { stopwatch });
    this.usb = usb;
    this.camera = new Hm01b0(this.report);
    this.powerUp();
  }

  attach() {
    this.camera.connect(this);
    this.usb.plugInto(this.mcu, this.clock);
    this.mcu.gpio[LAMP_PIN].addListener((level) => this.report({ lamp: level === HIGH }));
  }

  // The camera has the same supply.
  brownOut() {
    this.camera.powerUp();
    super.brownOut();
  }
}
