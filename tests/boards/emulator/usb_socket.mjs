// A board's serial port over USB as a Unix socket, for one client at a time, with the actions of a computer's driver.

import { USBCDC } from 'rp2040js';
import { OneClient } from './one_client.mjs';

const PACKET = 64, OPENED_NANOS = 20e6;
// USB class definitions for communication devices, PSTN 6.3.12: set the control lines, DTR and RTS, of interface 0.
const PORT_IS_OPEN = Uint8Array.of(0x21, 0x22, 3, 0, 0, 0, 0, 0);

export class UsbSocket {
  // `listening` is called once clients may connect; `heard` takes the bytes of each packet that the board sends.
  constructor(path, listening, heard) {
    Object.assign(this, { heard, queue: [], room: 0 });
    const received = (bytes) => {
      this.queue.push(...bytes);
      this.say();
    };
    this.socket = new OneClient(path, { listening, received, left: () => (this.queue = []) });
  }

  // Connects to a chip that has just started: queries its descriptors and opens its port.
  plugInto({ usbCtrl }, clock) {
    const computer = new USBCDC(usbCtrl);
    Object.assign(this, { usbCtrl, computer, queue: [], room: 0 });
    usbCtrl.onEndpointRead = (endpoint, size) => {
      if (endpoint !== computer.outEndpoint) return;
      this.room = Math.min(size, PACKET);
      this.say();
    };
    // The emulator's computer sends this request to the device; computers send it to the interface, so it is sent again.
    const open = clock.createAlarm(() => usbCtrl.sendSetupPacket(PORT_IS_OPEN));
    computer.onDeviceConnected = () => open.schedule(OPENED_NANOS);
    computer.onSerialData = (bytes) => {
      this.heard(bytes);
      this.socket.send(bytes);
    };
  }

  // Sends a packet once the chip has room for one. An empty packet would return again and again, so without data nothing is sent.
  say() {
    if (!this.room || !this.queue.length) return;
    const packet = this.queue.splice(0, this.room);
    this.room = 0;
    this.usbCtrl.endpointReadDone(this.computer.outEndpoint, Uint8Array.from(packet));
  }
}
