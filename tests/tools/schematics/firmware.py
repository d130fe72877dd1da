"""The pins that the firmware uses, read from its Rust sources."""

import re

# For each board: its sources, the name of a pin in them and on the board, and the place of each line's pin. A pattern has one group for
# each of its roles.
PIN = r"(?:board|chip)\.(\w+)"
PICO = {
    "files": ("main.rs",),
    "pin": (r"PIN_(\d+)", "GP{}"),
    "roles": (
        (("lit", "full_current"), rf"Dimmer::dark\(board\.PWM_SLICE2, {PIN}, {PIN},"),
        (("latch",), rf"latch: {PIN}"),
        (("clock",), rf"clock: {PIN}"),
        (("data",), rf"data: {PIN}"),
        (("transmit", "receive"), rf"BufferedUart::new\(\s*board\.UART0,\s*{PIN},\s*{PIN},"),
        (("scl", "sda"), rf"Bus::new\(board\.I2C0, {PIN}, {PIN},"),
    ),
}
RECEIVER = {
    "files": ("main.rs",),
    "pin": PICO["pin"],
    "roles": (
        (("transmit", "receive"), rf"BufferedUart::new\(\s*chip\.UART0,\s*{PIN},\s*{PIN},"),
        (("scl", "sda"), rf"Bus::new\(chip\.I2C0, {PIN}, {PIN},"),
        (("lamp",), rf"lamp: Output::new\({PIN}"),
        (tuple(f"data{bit}" for bit in range(8)), r"data: \(" + rf"\s*{PIN}," * 8),
        (("pixel_clock",), rf"pixel_clock: {PIN}"),
        (("line_valid",), rf"line_valid: {PIN}"),
        (("frame_valid",), rf"frame_valid: {PIN}"),
    ),
}
NUCLEO = {
    "files": ("main.rs",),
    "pin": (r"(P[A-G]\d+)", "{}"),
    "roles": (
        (("lit", "full_current"), rf"leds::dark\(board\.TIM1, {PIN}, {PIN},"),
        (("latch",), rf"latch: {PIN}"),
        (("clock",), rf"clock: {PIN}"),
        (("data",), rf"data: {PIN}"),
        (("receive", "transmit"), rf"BufferedUart::new\(\s*board\.LPUART1,\s*{PIN},\s*{PIN},"),
        (("scl", "sda"), rf"I2c::new_blocking\(board\.I2C3, {PIN}, {PIN},"),
    ),
}
BOARDS = {
    "tx-firmware/boards/pico": PICO,
    "rx-pipeline/boards/pico": RECEIVER,
    "tx-firmware/boards/nucleo-g474": NUCLEO,
}


class Unreadable(Exception):
    """A pattern has no match in the sources."""


def read(root, board):
    """The pin of each role, and the pins that the program pulls up."""
    rules = BOARDS[board]
    text = "\n".join((root / board / "src" / name).read_text() for name in rules["files"])
    code = re.sub(r"//.*", "", text)
    pattern, name = rules["pin"]
    roles = {}
    for names, where in rules["roles"]:
        found = re.findall(where, code)
        if len(found) != 1:
            raise Unreadable(f"{board}: {len(found)} places are like {where!r}, not one: adapt tests/tools/schematics/firmware.py")
        pins = found[0] if isinstance(found[0], tuple) else (found[0],)
        for role, pin in zip(names, pins):
            match = re.fullmatch(pattern, pin)
            if not match:
                raise Unreadable(f"{board}: {role} is on {pin}, which is not a pin")
            roles[role] = name.format(match[1])
    used = {name.format(pin) for pin in re.findall(rf"(?:board|chip)\.{pattern}\b", code)}
    unknown = used - set(roles.values())
    if unknown:
        raise Unreadable(f"{board} uses {', '.join(sorted(unknown))}, which no role names: adapt tests/tools/schematics/firmware.py")
    pulled = {f"GP{pin}" for pin in re.findall(r"PADS_BANK0\.gpio\((\d+)\)\.modify\(\|pad\| pad\.set_pue\(true\)\)", code)}
    return roles, pulled
