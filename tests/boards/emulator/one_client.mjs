// A Unix socket for one client at a time: the last one that came.

import fs from 'node:fs';
import net from 'node:net';

export class OneClient {
  // `listening` is called once clients may come; `received` takes what they send, `left` is called when one has gone.
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

  // What nobody is there to get is lost.
  send(bytes) {
    this.client?.write(Buffer.from(bytes));
  }
}
