// What rp2040js 1.4.1 models otherwise than the chip does, mended from outside. Each repair names the section of the RP2040
// datasheet that it follows.

const NANOS_PER_SECOND = 1e9;

export function repair(mcu) {
  mcu.uart.forEach((uart) => repairUart(mcu, uart));
  mcu.spi.forEach((spi) => giveShiftingTime(mcu, spi));
  repairInterrupts(mcu);
  repairPwmRequests(mcu);
  mcu.pwm.channels.forEach(repairPwmOutputs);
  addFlashController(mcu);
}

// 4.2: the level-select and DMA registers are missing, the transmit interrupt is stuck at 1 and bytes leave in no time. Here
// are both registers, a FIFO of 32 bytes that empties at the programmed rate, and an interrupt at half full and at empty.
function repairUart(mcu, uart) {
  const LEVEL_SELECT = 0x34, DMA_CONTROL = 0x48, DATA = 0, TRANSMIT = 1 << 5, DEPTH = 32;
  const registers = { [LEVEL_SELECT]: 0x12, [DMA_CONTROL]: 0 };
  const fifo = [];
  let shifting = false;
  const read = uart.readUint32.bind(uart), write = uart.writeUint32.bind(uart);
  const byteNanos = () => (10 * NANOS_PER_SECOND) / (uart.baudRate || 115200);

  const alarm = mcu.clock.createAlarm(() => {
    uart.onByte?.(fifo.shift());
    shifting = fifo.length > 0;
    if (shifting) alarm.schedule(byteNanos());
    if (fifo.length === DEPTH / 2 || fifo.length === 0) {
      uart.interruptStatus |= TRANSMIT;
      uart.checkInterrupts();
    }
  });
  uart.checkInterrupts = () => mcu.setInterrupt(uart.irq, (uart.interruptStatus & uart.interruptMask) !== 0);
  Object.defineProperty(uart, 'flags', {
    get: () =>
      (shifting ? 1 << 3 : 0) | (uart.rxFIFO.empty ? 1 << 4 : 0) | (fifo.length >= DEPTH ? 1 << 5 : 0) |
      (uart.rxFIFO.full ? 1 << 6 : 0) | (fifo.length === 0 ? 1 << 7 : 0),
  });
  uart.readUint32 = (offset) => registers[offset] ?? read(offset);
  uart.writeUint32 = (offset, value) => {
    if (offset in registers) registers[offset] = value;
    else if (offset === DATA) {
      if (fifo.length < DEPTH) fifo.push(value & 0xff);
      if (!shifting) {
        shifting = true;
        alarm.schedule(byteNanos());
      }
    } else write(offset, value);
  };
}

// 4.4: frames are shifted in no time. Here each takes its bits at the programmed clock.
function giveShiftingTime(mcu, spi) {
  let frame = 0;
  const alarm = mcu.clock.createAlarm(() => {
    spi.onFrame?.(frame, spi.dataBits);
    spi.completeTransmit(0);
  });
  spi.onTransmit = (value) => {
    frame = value;
    alarm.schedule((spi.dataBits * NANOS_PER_SECOND) / spi.clockFrequency);
  };
}

// 2.4.3 (NVIC): an interrupt that software pends is never cleared by its entry. Here the line's level and the pending bit
// are kept apart.
function repairInterrupts(mcu) {
  const SET_PENDING = 0x200, CLEAR_PENDING = 0x280, FIRST_IRQ = 16;
  const { core, ppb } = mcu;
  let pended = 0, lines = 0;
  const setInterrupt = core.setInterrupt.bind(core);
  const enter = core.exceptionEntry.bind(core);
  const write = ppb.writeUint32.bind(ppb);
  core.setInterrupt = (irq, level) => {
    const bit = 1 << irq;
    lines = level ? lines | bit : lines & ~bit;
    if (level || !(pended & bit)) setInterrupt(irq, level);
  };
  core.exceptionEntry = (exception) => {
    const bit = exception >= FIRST_IRQ ? 1 << (exception - FIRST_IRQ) : 0;
    if (pended & bit) {
      pended &= ~bit;
      if (!(lines & bit)) core.pendingInterrupts &= ~bit;
    }
    enter(exception);
  };
  ppb.writeUint32 = (offset, value) => {
    if (offset === SET_PENDING) pended |= value;
    if (offset === CLEAR_PENDING) {
      pended &= ~value;
      core.pendingInterrupts &= ~(value & ~lines);
    } else write(offset, value);
  };
}

// 2.5.3: a PWM's wrap requests one DMA transfer. The emulated request stays, so that a channel would run on for ever.
function repairPwmRequests(mcu) {
  const FIRST_WRAP_REQUEST = 24;
  const { pwm, dma } = mcu;
  const wrapped = pwm.channelInterrupt.bind(pwm);
  pwm.channelInterrupt = (slice) => {
    wrapped(slice);
    dma.clearDREQ(FIRST_WRAP_REQUEST + slice);
  };
}

// 4.5.2: an output is the comparison of the counter, inverted or not, at any moment. The emulated one stays low until the
// first period after it was switched on or inverted is over.
function repairPwmOutputs(slice) {
  const CONTROL = 0x00;
  const write = slice.writeRegister.bind(slice);
  slice.writeRegister = (offset, value) => {
    write(offset, value);
    if (offset !== CONTROL) return;
    slice.setA(slice.timer.counter < slice.alarmA.target);
    slice.setB(slice.timer.counter < slice.alarmB.target);
  };
}

// 2.6.3: the flash's cache and its streaming are missing. Here nothing streams, and there is no cache to flush.
function addFlashController(mcu) {
  const PAGE = 0x14000;
  mcu.peripherals[PAGE] = { readUint32: () => 0, writeUint32Atomic: () => {} };
}
