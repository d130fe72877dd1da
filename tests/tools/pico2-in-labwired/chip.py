"""An emulated RP2350: labwired's chip on the board of board.yaml, and with the mends that both programs need."""

import pathlib
import re
import tempfile

import labwired

from dma import Dma

HERE = pathlib.Path(__file__).resolve().parent
CONFIGS = pathlib.Path(labwired.__file__).resolve().parent / "configs"

FLASH, FLASH_BYTES = 0x10000000, 0x100000
TIMER = 0x400B0000
TIME_HIGH, TIME_LOW, ALARM, ARMED, PAUSE = TIMER, TIMER + 4, TIMER + 0x10, TIMER + 0x20, TIMER + 0x30
SET_PENDING = 0xE000E200
TIMER_IRQ, UART_IRQ = 0, 33
# The time that passes between two looks at the timer's alarm.
STEP_US = 50
# LDAEXB, which labwired takes for a plain load: the store after it then fails for ever. LDREXB is the same without the ordering, which one
# core does not need.
LOAD_ACQUIRE_EXCLUSIVE_BYTE = re.compile(rb"(?s)[\xd0-\xde]\xe8\xcf[\x0f\x1f\x2f\x3f\x4f\x5f\x6f\x7f\x8f\x9f\xaf\xbf\xcf\xef]")
LOAD_EXCLUSIVE_BYTE = 0x4F


class Chip:
    """The chip as described by labwired, or with the board and what its description leaves out."""

    def __init__(self, program, board=True):
        if not board:
            self.sim = labwired.Sim(program, chip="rp2350", uart="uart0")
            return
        with tempfile.TemporaryDirectory() as folder:
            system = pathlib.Path(folder) / "board.yaml"
            text = (HERE / "board.yaml").read_text()
            system.write_text(text.replace("CHIPS", str(CONFIGS / "chips")).replace("HERE", str(HERE)))
            self.sim = labwired.Sim(program, system=system, uart="uart0")

    def read(self, address):
        return self.sim.read_u32(address)

    def write(self, address, value):
        self.sim.write_u32(address, value)

    def memory(self, address, length):
        return self.sim.read_memory(address, length)

    def run(self, microseconds):
        self.sim.run_for(f"{microseconds}us")


class MendedChip(Chip):
    """A chip with exclusive loads of bytes, a timer that counts microseconds and has alarms, a UART that interrupts, and DMA."""

    def __init__(self, program):
        super().__init__(program)
        self.now_us = 0
        self.dma = Dma(self)
        self.write(PAUSE, 1)
        flash = bytearray(self.memory(FLASH, FLASH_BYTES))
        for found in LOAD_ACQUIRE_EXCLUSIVE_BYTE.finditer(bytes(flash)):
            flash[found.start() + 2] = LOAD_EXCLUSIVE_BYTE
            word = (found.start() + 2) & ~3
            self.write(FLASH + word, int.from_bytes(flash[word : word + 4], "little"))

    def run(self, microseconds):
        end = self.now_us + microseconds
        while self.now_us < end:
            super().run(STEP_US)
            self.now_us += STEP_US
            self.write(TIME_LOW, self.now_us & 0xFFFFFFFF)
            self.write(TIME_HIGH, self.now_us >> 32)
            if self.read(ARMED) & 1 and self.read(ALARM) <= self.now_us:
                self.write(ARMED, 1)
                self.interrupt(TIMER_IRQ)
            self.dma.step()

    def send(self, data):
        self.sim.send_bytes(data)
        self.interrupt(UART_IRQ)

    def received(self):
        return self.sim.read_uart_bytes()

    def interrupt(self, number):
        self.write(SET_PENDING + number // 32 * 4, 1 << number % 32)
