// A Unix socket for one client at a time: the most recent one.

import fs from 'node:fs';
import net from 'node:net';

export class OneClient {
  // `listening` is called once clients may connect; `received` takes their bytes, and `left` is called when a client has gone.
  constructor(path, { listening, received, left = () => {} }) {
    this.client = null;
    fs.rmSync(path, { force: true });
    net.createServer((socket) => {
      this.client = socket;
      socket.on('data', received);
      socket.on('error', () => {});
      socket.on('close', () => {
        if (this.client !== socket) return;
        this.client = null;
        left();
      });
    }).listen(path, listening);
  }

  // Without a client, the bytes are lost.
  send(bytes) {
    this.client?.write(Buffer.from(bytes));
  }
}
