// UART 0 of a board as a Unix socket, for one client at a time.

import { OneClient } from './one_client.mjs';

export class SerialSocket {
  // `listening` is called once clients may connect; `heard` takes each byte that the board sends.
  constructor(board, path, listening, heard = () => {}) {
    Object.assign(this, { board, received: [], sent: [], nextByteNanos: 0 });
    board.onSerial = (byte) => {
      this.sent.push(byte);
      heard(byte);
    };
    this.socket = new OneClient(path, { listening, received: (bytes) => this.received.push(...bytes) });
  }

  // Runs the board for this time. A byte arrives when the line has had time for it.
  run(nanos) {
    const { board } = this;
    const end = board.nanos + nanos;
    while (board.nanos < end) {
      this.deliver();
      const step = this.received.length ? Math.min(end, this.nextByteNanos) - board.nanos : end - board.nanos;
      board.run(Math.max(step, 1));
    }
    if (this.sent.length) this.socket.send(this.sent);
    this.sent.length = 0;
  }

  deliver() {
    const { board } = this;
    while (this.received.length && board.nanos >= this.nextByteNanos) {
      board.feed(this.received.shift());
      this.nextByteNanos = Math.max(this.nextByteNanos, board.nanos) + board.byteNanos();
    }
  }
}
