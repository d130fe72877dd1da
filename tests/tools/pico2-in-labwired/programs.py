"""Programs of a few instructions for an RP2350."""

import struct
import tempfile

FLASH = 0x10000000
STACK_TOP = 0x20080000
VECTORS = 68
# After the vectors, a handler for all of them that does not return; then the program.
HANDLER, CODE, CODE_END = 0x200, 0x400, 0x600
FILE_OFFSET = 0x1000
FOREVER = bytes.fromhex("fee7")

# R0 to R7 are the address of a scratch word; coprocessors 10 and 11, the floating-point unit, are enabled.
SCRATCH = 0x20000100
PREPARE = bytes.fromhex(
    "4ef68850 cef20000"  # movw, movt r0, CPACR
    "0168 41f47001 0160"  # ldr r1, [r0]; orr r1, r1, #0xf00000; str r1, [r0]
    "bff34f8f bff36f8f"  # dsb; isb
    "40f20010 c2f20000"  # r0 = SCRATCH
    "0146 0246 0346 0446 0546 0646 0746"  # r1 to r7 = r0
)
# The words of RAM into which a program tells that it ran.
RAN = 0x20000300
TELL = bytes.fromhex("40f20030 c2f20000 0168 0131 0160")  # r0 = RAN; ldr r1, [r0]; adds r1, #1; str r1, [r0]


def elf(code):
    """An ELF file of the program, which then loops."""
    vectors = struct.pack(f"<{VECTORS}I", STACK_TOP, FLASH + CODE | 1, *[FLASH + HANDLER | 1] * (VECTORS - 2))
    image = vectors.ljust(HANDLER, b"\0") + FOREVER.ljust(CODE - HANDLER, b"\0") + (code + FOREVER).ljust(CODE_END - CODE, b"\0")
    header = b"\x7fELF\x01\x01\x01".ljust(16, b"\0")
    header += struct.pack("<HHIIIIIHHHHHH", 2, 40, 1, FLASH + CODE | 1, 52, 0, 0x5000400, 52, 32, 1, 0, 0, 0)
    header += struct.pack("<8I", 1, FILE_OFFSET, FLASH, FLASH, len(image), len(image), 7, 4)
    file = tempfile.NamedTemporaryFile(suffix=".elf")
    file.write(header.ljust(FILE_OFFSET, b"\0") + image)
    file.flush()
    return file
