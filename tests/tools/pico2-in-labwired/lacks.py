"""What labwired lacks of an RP2350, each shown by a few registers or instructions: a function that is true while it does.

Registers and their addresses are those of the RP2350's data sheet, chapter by chapter.
"""

from chip import CONFIGS, TIMER, Chip
from dma import CHANNEL_BYTES, DMA, PWM_SLICE_0
from programs import PREPARE, RAN, SCRATCH, TELL, elf

SOURCE, TARGET = 0x20000200, 0x20000204
RESETS = 0x40020000
A_WHILE_US = 100
CYCLES_PER_US = 150

TIMERAWL, TIMER_INTE = TIMER + 0x28, TIMER + 0x40
UART0_IMSC = 0x40070038
CHANNEL_3 = DMA + 3 * CHANNEL_BYTES
PWM_SLICE_2 = PWM_SLICE_0 + 0x28
GPIO20_STATUS, GPIO20_CTRL, PAD_20 = 0x400280A0, 0x400280A4, 0x40038054
TICKS_WATCHDOG = 0x40108030
WATCHDOG_CTRL, WATCHDOG_LOAD = 0x400D8000, 0x400D8004
I2C0 = 0x40090000


def chip(code=b""):
    """A chip whose peripherals are out of reset, after the start of a program."""
    with elf(code) as program:
        started = Chip(program.name)
    started.run(1)
    started.write(RESETS, 0)
    return started


def fails(instructions):
    """Whether the processor does not come to the end of these instructions, with the floating-point unit enabled."""
    tried = chip(PREPARE + bytes.fromhex(instructions) + TELL)
    tried.run(A_WHILE_US)
    return tried.read(RAN) == 0


def unmapped(address):
    with elf(b"") as program:
        bare = Chip(program.name, board=False)
    try:
        bare.read(address)
    except RuntimeError:
        return True
    return False


def copied(control):
    """Whether a DMA channel with this CTRL_TRIG copies a word."""
    tried = chip()
    tried.write(SOURCE, 0x600DC0DE)
    for register, value in enumerate([SOURCE, TARGET, 1, control]):
        tried.write(CHANNEL_3 + 4 * register, value)
    # A slice that wraps each 10 cycles, for a channel that it paces.
    tried.write(PWM_SLICE_0 + 0x10, 9)
    tried.write(PWM_SLICE_0, 1)
    tried.run(A_WHILE_US)
    return tried.read(TARGET) == 0x600DC0DE


def counts_cycles():
    tried = chip()
    before = tried.read(TIMERAWL)
    tried.run(A_WHILE_US)
    return tried.read(TIMERAWL) - before > 2 * A_WHILE_US


def forgets(address, value):
    """Whether a register does not keep what is written."""
    tried = chip()
    tried.write(address, value)
    return tried.read(address) != value


def pwm_without_pin():
    tried = chip()
    tried.write(PWM_SLICE_2 + 0x10, 99)
    tried.write(PWM_SLICE_2 + 0x0C, 100)
    tried.write(GPIO20_CTRL, 4)
    tried.write(PWM_SLICE_2, 1)
    tried.run(A_WHILE_US)
    return not tried.read(GPIO20_STATUS) >> 9 & 1


def watchdog_stands():
    tried = chip()
    tried.write(TICKS_WATCHDOG + 4, 12)
    tried.write(TICKS_WATCHDOG, 1)
    tried.write(WATCHDOG_LOAD, 1000)
    tried.write(WATCHDOG_CTRL, 1 << 30)
    tried.run(A_WHILE_US)
    return tried.read(WATCHDOG_CTRL) & 0xFFFFFF == 1000


def watchdog_does_not_restart():
    tried = chip(TELL)
    tried.write(WATCHDOG_CTRL, 1 << 31)
    tried.run(A_WHILE_US)
    return tried.read(RAN) == 1


def sensor_answers_one_byte():
    """Three commands: select the manufacturer's number, read its first byte, read its second and stop."""
    tried = chip()
    tried.write(I2C0 + 0x04, 0x44)
    tried.write(I2C0 + 0x6C, 1)
    for command in (0x7E, 0x500, 0x300):
        tried.write(I2C0 + 0x10, command)
    tried.run(A_WHILE_US)
    received, first = tried.read(I2C0 + 0x78), tried.read(I2C0 + 0x10)
    return (received, first) != (2, 0x54)


def receives_without_interrupt():
    tried = chip()
    tried.write(I2C0 + 0x04, 0x44)
    tried.write(I2C0 + 0x6C, 1)
    tried.write(I2C0 + 0x10, 0x300)
    tried.run(A_WHILE_US)
    return not tried.read(I2C0 + 0x34) >> 2 & 1


def divides_in_a_cycle():
    # r1 = 0; 1: r1 += 1; udiv r2, r0, r1; str r1, [r0]; b 1b
    tried = chip(PREPARE + bytes.fromhex("0021 0131 b0fbf1f2 0160 fae7"))
    before = tried.read(SCRATCH)
    tried.run(A_WHILE_US)
    return 4 * (tried.read(SCRATCH) - before) > 0.99 * A_WHILE_US * CYCLES_PER_US


def no_boot_rom():
    return chip().memory(0x10, 3) != b"Mu\x02"


def without_output_enable():
    return "oe_pin" not in (CONFIGS / "devices/hc595.yaml").read_text()


# Described: board.yaml puts these in. Mended: chip.py does.
DESCRIBED = [
    ("the second PLL", lambda: unmapped(0x40058000)),
    ("ACTLR, which the first instructions of a program set", lambda: unmapped(0xE000E008)),
    ("STIR, by which the executors of interrupts are woken", lambda: unmapped(0xE000EF00)),
    ("the USB controller", lambda: unmapped(0x50110000)),
]
MENDED = [
    ("LDAEXB is exclusive", lambda: fails("d0e8cf2f c0e8431f 002b f9d1")),
    ("the timer counts microseconds, not cycles", counts_cycles),
    ("the timer's alarms interrupt: INTE is the RP2040's", lambda: forgets(TIMER_INTE, 1)),
    ("the UART interrupts: it has no IMSC", lambda: forgets(UART0_IMSC, 0x50)),
    ("DMA: the control register's bits are the RP2040's", lambda: not copied(1 | 2 << 2 | 1 << 4 | 1 << 6 | 3 << 13 | 0x3F << 17)),
    ("DMA: channels that a peripheral paces, even with the RP2040's bits", lambda: not copied(1 | 2 << 2 | 1 << 4 | 3 << 11 | 24 << 15)),
]
INSTRUCTIONS = {
    "SSAT": "01f30701",
    "VABS": "b0eec11a",
    "VCMP": "f4ee69da",
    "VMAXNM": "80fe040a",
    "VMINNM": "80fe4e0a",
    "VMLA": "0aee2d7a",
    "VMLS": "02ee465a",
    "VMRS": "f1ee10fa",
    "VNEG": "b1ee601a",
    "VNMLS": "10ee012a",
    "VNMUL": "20ee410a",
    "VSEL": "0dfe000a",
}
LACKING = [(f"the instruction {name}", lambda code=code: fails(code)) for name, code in INSTRUCTIONS.items()] + [
    ("PWM on a pin", pwm_without_pin),
    ("pads: the pull-down after reset", lambda: not chip().read(PAD_20) >> 2 & 1),
    ("the watchdog counts down", watchdog_stands),
    ("the watchdog restarts the chip", watchdog_does_not_restart),
    ("I2C: a second received byte", sensor_answers_one_byte),
    ("I2C: the interrupt RX_FULL", receives_without_interrupt),
    ("the boot ROM, whose functions erase and write the flash", no_boot_rom),
    ("cycles: a division takes one, as all instructions do", divides_in_a_cycle),
    ("74HC595: output enable and clear", without_output_enable),
]
# What the tries above rest on: with these nothing fails.
WORKING = [
    ("LDREXB is exclusive", lambda: not fails("d0e84f2f c0e8431f 002b f9d1")),
    ("VADD, VMUL, VDIV and VFMA", lambda: not fails("30ee010a 20ee010a 80ee010a a0ee010a")),
    ("DMA without pace, with the RP2040's bits", lambda: copied(1 | 2 << 2 | 1 << 4 | 1 << 5 | 3 << 11 | 0x3F << 15)),
]
