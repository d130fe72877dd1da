"""Both programs of a Pico 2 in labwired, and what labwired lacks: see `run` beside it."""

import sys
import time

import lacks
from chip import Chip, MendedChip
from frames import answers, request

HELLO, STATUS, READ_CALIBRATION = bytes([0]), bytes([1]), bytes([7])
SEND = bytes([9, 0, 2]) + b"hi"
# What `vocc transmit --message hi` prints. A bit of the headers changes from message to message: the second one's is that of `vocc`.
PANELS = """
    9936c96cb24d6693 717e7cbdae1dcdee ad0def143aa4f392 06c45d1880092c27 7696227592564fec
    66c936934db2996c 8e81834251e23211 52f210ebc55b0c6d f93ba2e77ff6d3d8 8969dd8a6da9b013
"""
# Bytes of a panel, and the panels and complements that are shifted in a symbol of a new board: four in each cycle of its carrier.
PANEL_BYTES, SHIFTED = 8, 64
DONE = bytes([7])
ANSWER_MS = 2
# Longer than the first search through the store.
START_MS = 10
# Longer than the panels that wait, and those of the message, at 90.2 symbols a second.
SHOWN_MS = 200
# The note that the receiver leaves about its end: halt.rs. It begins with this word.
NOTE = bytes.fromhex("ed1fce7e")
RAM, RAM_BYTES = 0x20000000, 520 * 1024
FAULT = "HardFault at "
# The first half of VCMP in both of its forms, whose register bit does not matter.
VCMP, VCMP_MASK = 0xEEB4, 0xFFBE


def ask(chip, sequence, body, milliseconds=ANSWER_MS):
    chip.send(request(sequence, body))
    chip.run(1000 * milliseconds)
    return answers(chip.received()).get(sequence)


def is_shown(panels, shifted):
    """Whether these panels are in the symbols that were shifted, at the same place of each."""
    at = range(0, len(shifted) - PANEL_BYTES + 1, PANEL_BYTES)
    states = [bytes(shifted[place : place + PANEL_BYTES]) for place in at]
    return any(panels in b"".join(states[first::SHIFTED]) for first in range(SHIFTED))


def transmitter_as_described(program):
    """Without board.yaml the program faults at once, and no request is answered."""
    chip = Chip(program, board=False)
    chip.run(1000 * START_MS)
    chip.sim.send_bytes(request(1, HELLO))
    chip.run(1000 * ANSWER_MS)
    return chip.sim.read_uart_bytes() == b""


def transmitter(program):
    chip = MendedChip(program)
    chip.run(1000 * START_MS)
    hello = ask(chip, 1, HELLO)
    yield "the transmitter starts and answers hello as a Pico 2", hello is not None and hello[0] == 1 and b"\x05pico2" in hello
    calibration = ask(chip, 2, READ_CALIBRATION)
    yield "it says its calibration", calibration is not None and calibration[0] == 6
    yield "it accepts a message, and another", [ask(chip, sequence, SEND) for sequence in (3, 4)] == [DONE, DONE]
    chip.run(1000 * SHOWN_MS)
    yield "the second message's panels are shifted to the LEDs, all bits right", is_shown(bytes.fromhex(PANELS), chip.dma.shifted)
    status = ask(chip, 5, STATUS)
    sending, *counters = status[-8:] if status else bytes(8)
    yield "it says that it sends, and counts symbols without a loss", sending == 1 and counters[3] > 0 and counters[4] == 0
    yield "it tries the sensor by its timer's alarms, in vain", counters[5] == 0 and counters[6] > 0


def receiver(program):
    chip = MendedChip(program)
    chip.run(1000 * START_MS)
    memory = chip.memory(RAM, RAM_BYTES)
    place = memory.find(NOTE)
    note = memory[place + 8 : place + 8 + int.from_bytes(memory[place + 4 : place + 8], "little")].decode() if place >= 0 else ""
    yield "the receiver's memory is prepared, its reader begins", note.startswith(FAULT)
    address = int(note[len(FAULT) :].split(",")[0], 16) if note.startswith(FAULT) else 0
    instruction = int.from_bytes(chip.memory(address, 2), "little") if address else 0
    yield "it ends at the first VCMP, which labwired lacks, and notes the address", instruction & VCMP_MASK == VCMP


def main(programs):
    start = time.process_time()
    wrong, tried = 0, 0
    works = [(name, test()) for name, test in lacks.WORKING]
    works.append(("as labwired describes the chip, the transmitter answers nothing", transmitter_as_described(programs[0])))
    works += [*transmitter(programs[0]), *receiver(programs[1])]
    for name, right in works:
        print(f"{'so it is' if right else 'NOT SO':10}{name}")
        wrong += not right
        tried += 1
    for kind, tries in [("described", lacks.DESCRIBED), ("mended", lacks.MENDED), ("lacks", lacks.LACKING)]:
        for name, lacking in tries:
            still = lacking()
            print(f"{kind if still else 'HAS NOW':10}{name}")
            wrong += not still
            tried += 1
    outcome = f"{wrong} failed" if wrong else f"{tried} passed"
    print(f"{outcome} in {time.process_time() - start:.0f}s of processor time: {wrong} of {tried} are not as stated")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
