"""The road kit and the bench panel: a Pico, eight shift registers and 64 LEDs. docs/hardware/road-kit.md has its pictures and its tables.

U2 is the part that holds output enable. R1 pulls its input low while nothing drives GPIO 20, and it inverts that into a high output
enable, which is dark, as long as the registers' supply feeds it.
"""

from circuit import Circuit
from parts import (
    ADAPTER,
    CAPACITOR,
    ELECTROLYTIC,
    FUSE,
    GATE_3V3,
    GATE_5V,
    LED,
    NUCLEO,
    PICO,
    REGISTER_HC,
    REGISTER_STP,
    REGISTER_TLC,
    REGISTER_TPIC,
    RESISTOR,
    SCHOTTKY,
    SENSOR_ALONE,
    SHIFTER,
    SUPPLY_5V,
    TRANSISTOR,
)

# What each board calls its pins.
LINES = {
    PICO: {
        "data": "GP19", "clock": "GP18", "latch": "GP17", "lit": "GP20", "full_current": "GP21",
        "transmit": "GP0", "receive": "GP1", "sda": "GP4", "scl": "GP5",
    },
    NUCLEO: {
        "data": "PA7", "clock": "PA5", "latch": "PC1", "lit": "PA8", "full_current": "PB10", "sda": "PC9", "scl": "PC8",
    },
}  # fmt: skip
# Columns of the picture.
INPUTS, BOARD, STAGE, REGISTERS, LIMITERS = range(5)
# Rows that are drawn; the others are alike.
DRAWN = 2


def road_kit(name, register, supply, board=PICO, limiter=None, switch=False, lit_by=1):
    """A panel with registers at this supply, "3V3" or "5V". `limiter` is the resistor in series with each LED, or at each current sink."""
    sources = {PICO: "tx-firmware/boards/pico", NUCLEO: "tx-firmware/boards/nucleo-g474"}
    kit = Circuit(name, f"Road kit with {register.name}", "docs/hardware/road-kit.md", sources[board])
    kit.lit_by = lit_by
    kit.design_ma = 7.0 if register is REGISTER_HC else 20.0
    kit.notes = (
        "Rows 2 to 7 (U5 to U10 and their parts) are wired as row 1: serial in from the row before, LED 8·row + column + 1 at output Q of "
        "its column.",
    )
    lines = LINES[board]
    is_sink = any(pin.role == "current" for pin in register.pins)
    has_shifter = supply == "5V"
    # LEDs to ground have their current from the registers' supply, which is then behind the fuse, and so is all that drives the registers.
    to_ground = lit_by == 1 and not is_sink and not register.output_drop_v
    rail = "LED+" if to_ground and supply == "5V" else supply

    kit.add("U1", board, at=(BOARD, 0))
    gate = kit.add("U2", GATE_5V if supply == "5V" else GATE_3V3, remarks="SOT-23-5, keeps the LEDs dark without a program", at=(STAGE, 0))
    rows = [
        kit.add(f"U{row + 3}", register, remarks="row 0 is U3, row 7 U10", at=(REGISTERS, 13 * row) if row < DRAWN else None)
        for row in range(8)
    ]
    sensor = kit.add("U12", SENSOR_ALONE, remarks="OPT3001, BH1750, VEML7700 or TSL2591, beside the panel, facing its way", at=(INPUTS, 0))
    power = kit.add("J1", SUPPLY_5V, remarks="limits its current", at=(INPUTS, 11))

    # --- Supplies ---

    pico = kit.components["U1"]
    kit.wire("GND", pico["GND"], power["-"], gate["GND"], sensor["GND"], sensor["ADDR"])
    kit.wire("3V3", pico["3V3"], sensor["VCC"])
    kit.wire("5V", power["+"])
    if board is PICO:
        diode = kit.add("D65", SCHOTTKY, "1N5817", remarks="leave it out if USB alone feeds the Pico", at=(INPUTS, 17))
        kit.wire("5V", diode["A"])
        kit.wire("VSYS", diode["K"], pico["VSYS"])
    fuse = kit.add("F1", FUSE, "2 A", remarks="a wire if the supply limits its current", at=(INPUTS, 15.5))
    kit.wire("5V", fuse["1"])
    kit.wire("LED+", fuse["2"])
    remarks = "low ESR: at most 0.1 Ω, ripple 0.7 A or more at 20 kHz; 10 V or more; beside the LEDs"
    reservoir = kit.add("C1", ELECTROLYTIC, "470 µF", remarks=remarks, at=(INPUTS, 18.5))
    kit.wire("LED+", reservoir["1"])
    kit.wire("GND", reservoir["2"])
    kit.wire(rail, gate["VCC"])
    decouple(kit, "C2", "U2", rail, at=(BOARD, 13))

    # --- Lines to the registers ---

    if has_shifter:
        shifter = kit.add("U11", SHIFTER, remarks="the registers ask for more than a Pico gives", at=(STAGE, 9))
        kit.wire(rail, shifter["VCC"])
        kit.wire("GND", shifter["GND"], *(shifter[f"{number}OE"] for number in range(1, 5)), shifter["4A"])
        kit.leave_open(shifter["4Y"], "unused")
        decouple(kit, "C11", "U11", rail, at=(BOARD, 17.5))
        outputs = {}
        for number, line in enumerate(("data", "clock", "latch"), 1):
            kit.wire(line.upper(), pico[lines[line]], shifter[f"{number}A"])
            outputs[line] = (f"{line.upper()}_5V", shifter[f"{number}Y"])
    else:
        outputs = {line: (line.upper(), pico[lines[line]]) for line in ("data", "clock", "latch")}
    for line, (net, end) in outputs.items():
        kit.wire(net, end)
        targets = rows[:1] if line == "data" else rows
        kit.wire(net, *(each[pin_of(register, line)] for each in targets))

    # --- Dark without a program ---

    pull_down = kit.add("R1", RESISTOR, "4.7 kΩ", remarks="beside U2: keeps the LEDs dark without a program", at=(STAGE, 5))
    kit.wire("LIT", pico[lines["lit"]], gate["A"], pull_down["1"])
    kit.wire("GND", pull_down["2"])
    kit.wire("OE", gate["Y"], *(each[pin_of(register, "enable")] for each in rows))

    # --- Rows ---

    for row, each in enumerate(rows):
        for pin in register.pins:
            if pin.kind == "supply" or pin.role == "clear":
                kit.wire(rail, each[pin.number])
            elif pin.kind == "ground":
                kit.wire("GND", each[pin.number])
        carry = each[pin_of(register, "carry")]
        if row < 7:
            kit.wire(f"ROW{row + 1}", carry, rows[row + 1][pin_of(register, "data")])
        else:
            kit.leave_open(carry, "the end of the chain")
        decouple(kit, f"C{row + 3}", each.ref, rail, at=(BOARD, 14.5 + 1.5 * row) if row < DRAWN else None)
        if is_sink:
            at = place(row, STAGE, 9 if switch else 7)
            resistor = kit.add(f"R{row + 11}", RESISTOR, limiter, remarks="the low current" if switch else "", at=at)
            kit.wire("GND", resistor["1"])
            kit.wire(f"REXT{row}", resistor["2"], each["R-EXT"])
            if switch:
                remarks = "with R11 to R18 the full current"
                second = kit.add(f"R{row + 21}", RESISTOR, "1.1 kΩ", remarks=remarks, at=place(row, STAGE, 10.5))
                transistor = kit.add(f"Q{row + 1}", TRANSISTOR, remarks="SOT-23, the current switch", at=place(row, STAGE, 14))
                kit.wire(f"REXT{row}", second["2"])
                kit.wire(f"SWITCH{row}", second["1"], transistor["D"])
                kit.wire("GND", transistor["S"])
                kit.wire("CURRENT", transistor["G"])
        for column in range(8):
            add_led(kit, row, column, each, None if is_sink else limiter, to_ground)
    if switch:
        low = kit.add("R2", RESISTOR, "4.7 kΩ", remarks="the low current without a program", at=(STAGE, 7))
        kit.wire("CURRENT", pico[lines["full_current"]], low["1"])
        kit.wire("GND", low["2"])
    else:
        kit.unused_roles["full_current"] = "no current switch"

    # --- Sensor and serial port ---

    decouple(kit, "C12", "U12", "3V3", at=(BOARD, 19), remarks="leave it out if the sensor's module has it")
    for number, line in ((3, "sda"), (4, "scl")):
        at = (INPUTS, 1.5 * number + 1.5)
        resistor = kit.add(f"R{number}", RESISTOR, "4.7 kΩ", remarks="leave it out if the sensor's module has it", at=at)
        kit.wire("3V3", resistor["1"])
        kit.wire(line.upper(), pico[lines[line]], sensor[line.upper()], resistor["2"])
    if board is PICO:
        adapter = kit.add("J2", ADAPTER, remarks="optional, 115 200 baud: USB is a serial port, too", at=(INPUTS, 22.5), optional=True)
        kit.wire("TX", pico[lines["transmit"]], adapter["RX"])
        kit.wire("RX", pico[lines["receive"]], adapter["TX"])
        kit.wire("GND", adapter["GND"], pico["GND3"])
    else:
        for role in ("transmit", "receive"):
            kit.on_board[role] = "the ST-LINK"
    return kit


def place(row, column, first):
    """Where a part of a row that is drawn stands."""
    return (column, first + 13 * row) if row < DRAWN else None


def pin_of(register, role):
    return next(pin.name for pin in register.pins if pin.role == role)


def decouple(kit, ref, beside, supply, at, remarks="from the supply to ground: C2 at U2, C3 to C10 at U3 to U10, C11 at U11"):
    capacitor = kit.add(ref, CAPACITOR, "100 nF", remarks=remarks, at=at, beside=beside)
    kit.wire(supply, capacitor["1"])
    kit.wire("GND", capacitor["2"])


def add_led(kit, row, column, register, limiter, to_ground):
    """An LED at its output, with a resistor in series if `limiter` has one."""
    number = 8 * row + column + 1
    line = 13 * row + column
    is_drawn = row < DRAWN
    remarks = "red, about 2 V: as drawn for the bench; for daylight see LEDs and optics; other colours need other R101 to R164"
    led = kit.add(f"D{number}", LED, remarks=remarks, at=(LIMITERS + bool(limiter), line) if is_drawn else None)
    # Lit by a 0 or by a sink: from the supply to the output. Lit by a 1: from the output to ground.
    to_output, to_rail = ("A", "K") if to_ground else ("K", "A")
    kit.wire("GND" if to_ground else "LED+", led[to_rail])
    net = f"OUT{number}"
    kit.wire(net, register[f"Q{column}"])
    if limiter:
        at = (LIMITERS, line) if is_drawn else None
        resistor = kit.add(f"R{100 + number}", RESISTOR, limiter, remarks="in series with its LED", at=at)
        kit.wire(net, resistor["1"])
        kit.wire(f"LED{number}", resistor["2"], led[to_output])
    else:
        kit.wire(net, led[to_output])


def with_tlc5916():
    return road_kit("road-kit-tlc5916", REGISTER_TLC, "3V3", limiter="5.6 kΩ", switch=True)


def with_tpic6b595():
    return road_kit("road-kit-tpic6b595", REGISTER_TPIC, "5V", limiter="150 Ω")


def with_74hc595():
    return road_kit("road-kit-74hc595", REGISTER_HC, "5V", limiter="430 Ω", lit_by=0)


# Without pictures, but by the same rules.


def with_tlc5916_without_switch():
    return road_kit("road-kit-tlc5916-no-switch", REGISTER_TLC, "3V3", limiter="910 Ω")


def with_tlc5916_at_5v():
    return road_kit("road-kit-tlc5916-5v", REGISTER_TLC, "5V", limiter="910 Ω")


def with_stp08dp05():
    return road_kit("road-kit-stp08dp05", REGISTER_STP, "3V3", limiter="by its datasheet")


def with_74hc595_to_ground():
    return road_kit("road-kit-74hc595-to-ground", REGISTER_HC, "5V", limiter="430 Ω")


def with_nucleo():
    return road_kit("road-kit-nucleo", REGISTER_TLC, "3V3", board=NUCLEO, limiter="5.6 kΩ", switch=True)


CIRCUITS = (with_tlc5916, with_tpic6b595, with_74hc595)
VARIANTS = (with_tlc5916_without_switch, with_tlc5916_at_5v, with_stp08dp05, with_74hc595_to_ground, with_nucleo)
