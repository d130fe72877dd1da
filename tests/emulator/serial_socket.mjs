// UART 0 of a board as a Unix socket, for one client at a time.

import fs from 'node:fs';
import net from 'node:net';

export class SerialSocket {
  // `listening` is called once clients may come; `heard` takes each byte that the board sends.
  constructor(board, path, listening, heard = () => {}) {
    Object.assign(this, { board, client: null, received: [], sent: [], nextByteNanos: 0 });
    board.onSerial = (byte) => {
      this.sent.push(byte);
      heard(byte);
    };
    fs.rmSync(path, { force: true });
    net.createServer((socket) => {
      this.client = socket;
      socket.on('data', (bytes) => this.received.push(...bytes));
      socket.on('error', () => {});
      socket.on('close', () => { if (this.client === socket) this.client = null; });
    }).listen(path, listening);
  }

  // Runs the board for so long. A byte arrives when the line has had time for it.
  run(nanos) {
    const { board } = this;
    const end = board.nanos + nanos;
    while (board.nanos < end) {
      this.deliver();
      const step = this.received.length ? Math.min(end, this.nextByteNanos) - board.nanos : end - board.nanos;
      board.run(Math.max(step, 1));
    }
    if (this.sent.length && this.client) this.client.write(Buffer.from(this.sent));
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
