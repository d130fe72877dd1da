// The receiver: a Pico with a camera and a lamp.

import { USBCDC } from 'rp2040js';
import { Board } from './board.mjs';
import { Hm01b0 } from './hm01b0.mjs';

const LAMP_PIN = 25, HIGH = 1;
const NEW_LINE = 10, OPENED_NANOS = 20e6;
// USB class definitions for communication devices, PSTN 6.3.12: set the control lines, DTR and RTS, of interface 0.
const PORT_IS_OPEN = Uint8Array.of(0x21, 0x22, 3, 0, 0, 0, 0, 0);

export class Receiver extends Board {
  constructor(flash, report, { stopwatch = null } = {}) {
    super(flash, report, { stopwatch });
    this.camera = new Hm01b0(this.report);
    this.powerUp();
  }

  attach() {
    this.camera.connect(this);
    this.plugIn();
    this.mcu.gpio[LAMP_PIN].addListener((level) => this.report({ lamp: level === HIGH }));
  }

  // A computer on the USB socket, which opens the port and says nothing: each line of text that it gets is reported.
  plugIn() {
    const { usbCtrl } = this.mcu;
    const computer = new USBCDC(usbCtrl);
    // An answer of no bytes would come again and again; a computer that has nothing to say does not answer.
    usbCtrl.onEndpointRead = () => {};
    // The emulator's computer tells the device that the port is open; computers tell the interface, and so it is told again.
    const open = this.clock.createAlarm(() => usbCtrl.sendSetupPacket(PORT_IS_OPEN));
    computer.onDeviceConnected = () => open.schedule(OPENED_NANOS);
    let line = '';
    computer.onSerialData = (bytes) => {
      for (const byte of bytes) {
        if (byte === NEW_LINE) {
          this.report({ usb: line.trimEnd() });
          line = '';
        } else line += String.fromCharCode(byte);
      }
    };
  }

  // The camera hangs on the same supply.
  brownOut() {
    this.camera.powerUp();
    super.brownOut();
  }
}
