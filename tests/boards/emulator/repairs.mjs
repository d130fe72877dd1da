// Repairs of rp2040js 1.4.1 where it differs from the chip, without changes to its code. Each names the section of the RP2040 datasheet
// that it follows.

const NANOS_PER_SECOND = 1e9;

// `lockUp` stops the processor.
export function repair(mcu, lockUp) {
  mcu.uart.forEach((uart) => repairUart(mcu, uart));
  mcu.spi.forEach((spi) => giveShiftingTime(mcu, spi));
  mcu.i2c.forEach(repairI2c);
  repairInterrupts(mcu);
  repairPwmRequests(mcu);
  mcu.pwm.channels.forEach(repairPwmOutputs);
  addFlashController(mcu);
  mcu.pio.forEach(repairPio);
  keepBuffersAvailable(mcu);
  quickenInputs(mcu);
  lockUpBelowRam(mcu, lockUp);
}

// 4.2: the level-select and DMA registers are missing, the transmit interrupt is stuck at 1, and bytes are sent in no time. The repair adds
// both registers, a FIFO of 32 bytes that empties at the programmed rate, and an interrupt at half full and at empty.
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

// 4.1.2.5: a buffer for data from the computer is returned at once as if it had been filled with nothing, so that the program asks
// endlessly. The repair returns it when the computer has filled it. Control transfers, of endpoint 0, are unchanged.
function keepBuffersAvailable({ usbCtrl: usb, usbDPRAMView: memory }) {
  const AVAILABLE = 1 << 10, CONTROL_OUT_1 = 0x8c, CONTROL_OUT_15 = 0xfc, OUT = 4;
  const updated = usb.DPRAMUpdated.bind(usb), finished = usb.finishRead.bind(usb);
  usb.DPRAMUpdated = (offset, value) => {
    updated(offset, value);
    if (offset >= CONTROL_OUT_1 && offset <= CONTROL_OUT_15 && offset & OUT) memory.setUint32(offset, value, true);
  };
  usb.finishRead = (endpoint, buffer) => {
    const control = CONTROL_OUT_1 + 8 * (endpoint - 1);
    memory.setUint32(control, memory.getUint32(control, true) & ~AVAILABLE, true);
    finished(endpoint, buffer);
  };
}

// 4.4: frames are shifted in no time. The repair gives each bit its programmed clock, and reports the beginning of a frame.
function giveShiftingTime(mcu, spi) {
  let frame = 0;
  const alarm = mcu.clock.createAlarm(() => {
    spi.onFrame?.(frame, spi.dataBits);
    spi.completeTransmit(0);
  });
  spi.onTransmit = (value) => {
    frame = value;
    const bitNanos = NANOS_PER_SECOND / spi.clockFrequency;
    spi.onStart?.(frame, spi.dataBits, bitNanos);
    alarm.schedule(spi.dataBits * bitNanos);
  };
}

// 4.3.17: interrupts cannot be enabled, and those of the FIFOs' levels come and go once instead of following the levels. The repair
// corrects both.
function repairI2c(i2c) {
  const INTERRUPT_MASK = 0x30, RECEIVE_FULL = 1 << 2, TRANSMIT_EMPTY = 1 << 4, ENABLED = 1;
  let events = 0;
  Object.defineProperty(i2c, 'intRaw', {
    get: () =>
      (events & ~(RECEIVE_FULL | TRANSMIT_EMPTY)) | (i2c.rxFIFO.itemCount > i2c.rxThreshold ? RECEIVE_FULL : 0) |
      (i2c.enable & ENABLED && i2c.txFIFO.itemCount <= i2c.txThreshold ? TRANSMIT_EMPTY : 0),
    set: (value) => (events = value),
  });
  i2c.setInterrupts = (mask) => {
    events |= mask;
    i2c.checkInterrupts();
  };
  const read = i2c.readUint32.bind(i2c), write = i2c.writeUint32.bind(i2c);
  i2c.readUint32 = (offset) => {
    const value = read(offset);
    i2c.checkInterrupts();
    return value;
  };
  i2c.writeUint32 = (offset, value) => {
    if (offset === INTERRUPT_MASK) i2c.intEnable = value & 0x1fff;
    else write(offset, value);
    i2c.checkInterrupts();
  };
}

// 2.4.3 (NVIC): an interrupt that software pends is never cleared by its entry. The repair separates the line's level from the pending bit.
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

// 2.5.3: a PWM's wrap requests one DMA transfer. The emulated request never ends, so that a channel would run on. The repair ends it.
function repairPwmRequests(mcu) {
  const FIRST_WRAP_REQUEST = 24;
  const { pwm, dma } = mcu;
  const wrapped = pwm.channelInterrupt.bind(pwm);
  pwm.channelInterrupt = (slice) => {
    wrapped(slice);
    dma.clearDREQ(FIRST_WRAP_REQUEST + slice);
  };
}

// 4.5.2: an output is the comparison of the counter at any time, inverted or not. The emulated output stays low until the end of the first
// period after it was switched on or inverted. Also, a stopped counter keeps its value, and a value written to it applies at once; the
// emulated counter runs from the time at which its divider is written.
function repairPwmOutputs(slice) {
  const CONTROL = 0x00, DIVIDER = 0x04, ENABLED = 1;
  const write = slice.writeRegister.bind(slice);
  slice.writeRegister = (offset, value) => {
    write(offset, value);
    if (offset === DIVIDER) slice.updateEnable();
    const isOff = !(slice.csr & ENABLED);
    if (isOff) slice.updateDoubleBuffered();
    if (offset !== CONTROL && !isOff) return;
    slice.setA(slice.timer.counter < slice.alarmA.target);
    slice.setB(slice.timer.counter < slice.alarmB.target);
  };
}

// 2.6.3: the flash's cache and its streaming are missing. The repair streams nothing and has no cache to flush.
function addFlashController(mcu) {
  const PAGE = 0x14000;
  mcu.peripherals[PAGE] = { readUint32: () => 0, writeUint32Atomic: () => {} };
}

// 3.2: state machines run in the computer's time, not the chip's. With the repair, a machine runs in no time after every event that it may
// have waited for: an access to its registers, or a change of pins that `settle` reports. It stops when it waits, or when it is in a loop
// that changes nothing. The chip behaves the same if it gets there before its pins change again: `settle` returns the maximum of the system
// clock's cycles that any machine took, including the whole loop of a machine in one.
function repairPio(pio) {
  const STEPS_MAX = 4096, SYNCHRONISER_CYCLES = 2;
  const state = (machine) => [
    machine.pc, machine.x, machine.y, machine.inputShiftReg, machine.inputShiftCount, machine.outputShiftReg, machine.outputShiftCount,
    machine.rxFIFO.itemCount, machine.txFIFO.itemCount, pio.irq, pio.pinValues, pio.pinDirections,
  ];
  // Brent's search for a loop: the state at steps 1, 2, 4, 8, … is compared with the following ones.
  const finish = (machine) => {
    const before = machine.cycles;
    let known = null, knownCycles = 0, next = 1, loop = 0;
    for (let step = 1; machine.enabled && !machine.waiting; step++) {
      if (step === STEPS_MAX) throw new Error('a PIO program that goes on by itself is not emulated');
      machine.step();
      const reached = state(machine);
      if (known && reached.every((value, index) => value === known[index])) {
        loop = machine.cycles - knownCycles;
        break;
      }
      if (step === next) {
        known = reached;
        knownCycles = machine.cycles;
        next *= 2;
      }
    }
    const divider = (machine.clockDivInt || 65536) + machine.clockDivFrac / 256;
    const cycles = ((loop ? knownCycles : machine.cycles) - before + (machine.loop ?? 0)) * divider + SYNCHRONISER_CYCLES;
    machine.loop = loop;
    return cycles;
  };
  pio.settle = () => {
    if (pio.stopped) return 0;
    let most = 0;
    for (const machine of pio.machines) {
      if (!machine.enabled) continue;
      if (machine.waiting) machine.checkWait();
      if (!machine.waiting) most = Math.max(most, finish(machine));
    }
    if (most > 0) pio.checkChangedPins();
    return most;
  };
  pio.run = () => pio.settle();
  const read = pio.readUint32.bind(pio), write = pio.writeUint32.bind(pio);
  pio.readUint32 = (offset) => {
    const value = read(offset);
    pio.settle();
    return value;
  };
  pio.writeUint32 = (offset, value) => {
    write(offset, value);
    pio.settle();
  };
}

// All pins' levels at once, instead of a dozen calls for each.
function quickenInputs(mcu) {
  const INPUT_ENABLE = 1 << 6, INPUT_OVERRIDE = 3 << 16;
  Object.defineProperty(mcu, 'gpioValues', {
    get: () => {
      let levels = 0;
      for (const pin of mcu.gpio) {
        const plain = pin.rawInputValue && (pin.padValue & INPUT_ENABLE) !== 0;
        if (pin.ctrl & INPUT_OVERRIDE ? pin.inputValue : plain) levels |= 1 << pin.index;
      }
      return levels;
    },
  });
}

// 2.2: nothing is mapped just below the RAM. A write there by an overflowing stack is a fault, and a write by the fault itself locks the
// processor up. The emulator would continue.
function lockUpBelowRam(mcu, lockUp) {
  const RAM = 0x20000000, NEAR = 0x10000;
  const write = mcu.writeUint32.bind(mcu);
  mcu.writeUint32 = (address, value) => {
    if (address < RAM && address >= RAM - NEAR) lockUp();
    else write(address, value);
  };
}
