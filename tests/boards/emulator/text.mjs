// Extracts lines of text from the bytes of a serial port; a frame of the binary protocol, which ends with a zero, is not text.

const NEW_LINE = 10, LONGEST = 512;

export class Text {
  // `told` receives each line.
  constructor(told) {
    Object.assign(this, { told, bytes: [] });
  }

  push(byte) {
    if (byte === 0) this.bytes = [];
    else if (byte !== NEW_LINE) this.bytes.push(byte);
    if (byte !== NEW_LINE && this.bytes.length < LONGEST) return;
    this.told(Buffer.from(this.bytes).toString('utf8').trimEnd());
    this.bytes = [];
  }
}
