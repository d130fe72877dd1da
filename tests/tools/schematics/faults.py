"""Faults in the circuits, the firmware's pins and the pages. The rules have to report each of them."""

from dataclasses import replace

import desk_kit
import pages
import receiver
import road_kit
from circuit import Share
from parts import REGISTER_HC, RESISTOR


def move(circuit, end, net):
    """Moves a pin to another net, or to none."""
    for ends in circuit.nets.values():
        if end in ends:
            ends.remove(end)
    if net:
        circuit.nets.setdefault(net, []).append(end)


def swap(circuit, one, other):
    nets = circuit.net_of(one), circuit.net_of(other)
    move(circuit, one, nets[1])
    move(circuit, other, nets[0])


def remove(circuit, ref):
    for pin in circuit.components[ref].part.pins:
        move(circuit, (ref, pin.number), None)
    del circuit.components[ref]


def change(circuit, ref, **what):
    component = circuit.components[ref]
    component.part = replace(component.part, **what)


def end(circuit, ref, name):
    return circuit.components[ref][name]


# --- Faults of wiring ------------------------------------------------------------------------------------------------------------------


def swap_at_the_pico(c):
    swap(c, end(c, "U1", "GP18"), end(c, "U1", "GP19"))


def swap_behind_the_shifter(c):
    swap(c, end(c, "U2", "2Y"), end(c, "U2", "3Y"))


def no_capacitor(c):
    remove(c, "C5")


def capacitor_at_another_supply(c):
    move(c, end(c, "C1", "1"), "3V3")


def small_capacitor(c):
    c.components["C1"].value = "100 pF"


def output_against_output(c):
    c.open.clear()
    move(c, end(c, "U2", "4Y"), "CLK")


def sources_joined(c):
    move(c, end(c, "U1", "3V3"), "5V")


def output_enable_floats(c):
    """Two registers joined, but not with the gate."""
    for ref in ("U5", "U6"):
        move(c, end(c, ref, "OE"), "OE_OF_TWO")


def gate_without_output(c):
    move(c, end(c, "U2", "Y"), None)


def five_volts_into_a_gpio(c):
    c.open.clear()
    move(c, end(c, "U1", "GP1"), "FROM_5V")
    move(c, end(c, "U11", "4Y"), "FROM_5V")


def pull_up_to_5v(c):
    c.add("R99", RESISTOR, "4.7 kΩ")
    c.nets["LIT"].append(end(c, "R99", "1"))
    c.nets["5V"].append(end(c, "R99", "2"))


def without_shifter(c):
    """The latch of the registers at 5 V directly from the Pico."""
    move(c, end(c, "U11", "3Y"), None)
    c.open[end(c, "U11", "3Y")] = "unused"
    for row in range(3, 11):
        move(c, end(c, f"U{row}", "RCLK"), "LATCH")


def plain_buffer(c):
    change(c, "U2", gates=(("A", None, "Y", False),))


def all_without_shifter(c):
    """The latch, the clock and the serial in of the registers at 5 V directly from the Pico."""
    for net, pin in (("DATA", "1"), ("CLOCK", "2"), ("LATCH", "3")):
        move(c, end(c, "U11", f"{pin}Y"), None)
        c.nets[net] += [other for other in c.nets.pop(f"{net}_5V") if other[0] != "U11"]


def no_pull_down(c):
    remove(c, "R1")


def weak_pull_down(c):
    c.components["R1"].value = "10 kΩ"


def low_current_too_low(c):
    c.components["R13"].value = "9.1 kΩ"


def gate_fed_by_the_pico(c):
    """The gate at the Pico's supply, the registers at their own."""
    change(c, "U2", supply_v=(2.7, 3.6))
    move(c, end(c, "U2", "VCC"), "3V3")


def no_supply(c):
    move(c, end(c, "U6", "VDD"), None)


def too_little_supply(c):
    move(c, end(c, "U4", "VCC"), "3V3")


def ground_on_a_supply(c):
    move(c, end(c, "U3", "GND"), "5V")


def leds_swapped(c):
    swap(c, end(c, "D12", "K"), end(c, "D13", "K"))


def led_reversed(c):
    swap(c, end(c, "D20", "A"), end(c, "D20", "K"))


def built_for_the_other_bit(c):
    c.lit_by = 1


def rows_swapped(c):
    swap(c, end(c, "U6", "SDI"), end(c, "U7", "SDI"))


def small_resistor(c):
    c.components["R117"].value = "15 Ω"


def large_resistor_at_a_sink(c):
    c.components["R14"].value = "62 kΩ"
    remove(c, "R24")


def no_pull_up(c):
    remove(c, "R3")


def pull_up_of_i2c_to_5v(c):
    move(c, end(c, "R4", "1"), "5V")


def pads_at_1v8(c):
    change(c, "U2", logic_own_v=1.8, output_high=Share(1.0))


def address_open(c):
    move(c, end(c, "U12", "ADDR"), None)


def address_at_the_supply(c):
    move(c, end(c, "U4", "ADDR"), "3V3")


def no_capacitor_at_the_sensor(c):
    remove(c, "C12")


def clear_open(c):
    move(c, end(c, "U8", "SRCLR"), None)


def no_such_pin(c):
    c.nets["CLOCK"].append(("U2", "15"))


def at_a_pin_without_connection(c):
    move(c, end(c, "U2", "NC"), "OE")


def another_gpio(c):
    move(c, end(c, "U1", "GP17"), None)
    move(c, end(c, "U1", "GP22"), "LATCH")


def leds_from_3v3(c):
    move(c, end(c, "F1", "1"), "3V3")


def clock_at_a_carry(c):
    move(c, end(c, "U5", "CLK"), "ROW5")


def latch_at_a_carry(c):
    """At the line that is the register's own serial in."""
    move(c, end(c, "U5", "RCLK"), "ROW2")


def clear_at_ground(c):
    move(c, end(c, "U5", "SRCLR"), "GND")


def all_clear_at_ground(c):
    for row in range(3, 11):
        move(c, end(c, f"U{row}", "SRCLR"), "GND")


def latch_not_enabled(c):
    move(c, end(c, "U2", "2OE"), "5V")


def data_not_enabled(c):
    move(c, end(c, "U11", "1OE"), "5V")


def run_at_ground(c):
    move(c, end(c, "U1", "RUN"), "GND")


def resistor_of_20_ohm(c):
    c.components["R117"].value = "20 Ω"


def resistor_of_150_kilohm(c):
    c.components["R117"].value = "150 kΩ"


def low_current_at_the_edge(c):
    """3.02 mA with exact resistors."""
    for row in range(8):
        c.components[f"R{row + 11}"].value = "6.2 kΩ"


def switch_of_one_row_missing(c):
    remove(c, "R21")
    remove(c, "Q1")


def low_current_of_one_row(c):
    """The full current is still within its range."""
    c.components["R13"].value = "4.7 kΩ"


def current_pins_joined(c):
    move(c, end(c, "U4", "R-EXT"), "REXT0")


def no_pull_down_at_the_switch(c):
    remove(c, "R2")


def pull_up_at_the_switch(c):
    move(c, end(c, "R2", "2"), "3V3")


def on_3v3_to_ground():
    """74HC595 at the Pico's 3.3 V, and LEDs to ground."""
    return road_kit.road_kit("on-3v3-to-ground", REGISTER_HC, "3V3", limiter="180 Ω")


def on_3v3_from_leds():
    """74HC595 at the Pico's 3.3 V, and LEDs from 5 V."""
    return road_kit.road_kit("on-3v3-from-leds", REGISTER_HC, "3V3", limiter="430 Ω", lit_by=0)


def nothing(_c):
    """The circuit itself is the fault."""


def registers_before_the_fuse(c):
    for row in range(3, 11):
        move(c, end(c, f"U{row}", "VCC"), "5V")


def leds_before_the_fuse(c):
    for number in range(1, 65):
        move(c, end(c, f"D{number}", "A"), "5V")


def large_fuse(c):
    c.components["F1"].value = "20 A"


def small_fuse(c):
    c.components["F1"].value = "1 A"


def diode_reversed(c):
    swap(c, end(c, "D65", "A"), end(c, "D65", "K"))


def too_much_for_usb(c):
    """Each load alone is allowed: board, module, and sensor at the board's 3.3 V."""
    change(c, "U4", supply_ma=150)


def too_much_for_the_supply(c):
    """At the board, which the supply feeds through a diode."""
    change(c, "U1", supply_ma=600)


def no_electrolytic(c):
    remove(c, "C1")


def ordinary_electrolytic(c):
    change(c, "C1", series_ohm=0.56)


def small_electrolytic(c):
    c.components["C1"].value = "100 µF"


def electrolytic_reversed(c):
    swap(c, end(c, "C1", "1"), end(c, "C1", "2"))


def two_nets(c):
    c.nets["OE"].append(end(c, "R1", "1"))


def data_lines_swapped(c):
    swap(c, end(c, "U2", "D3"), end(c, "U2", "D4"))


TLC, TPIC, HC = road_kit.CIRCUITS
TO_GROUND, ON_NUCLEO = road_kit.with_74hc595_to_ground, road_kit.with_nucleo
DESK, CAMERA_KIT = desk_kit.desk_kit, receiver.receiver
WIRING = (
    ("two wires swapped at the Pico", DESK, swap_at_the_pico, ("U3 pin DIN", "GPIO 18", "data")),
    ("two wires swapped behind the shifter", DESK, swap_behind_the_shifter, ("U3 pin CS", "latch", "GPIO 18")),
    ("a capacitor is missing", TLC, no_capacitor, ("U5", "100 nF")),
    ("a capacitor at another supply", DESK, capacitor_at_another_supply, ("U2", "100 nF")),
    ("a capacitor that is too small", DESK, small_capacitor, ("U2", "100 nF")),
    ("output against output", DESK, output_against_output, ("output against output", "3Y", "4Y")),
    ("two supplies joined", DESK, sources_joined, ("output against output", "VBUS", "3V3")),
    ("output enable of one register floats", TLC, output_enable_floats, ("U5 pin 13 (OE)", "floats")),
    ("the gate's output is not connected", HC, gate_without_output, ("U3 pin 13 (OE)", "floats")),
    ("output of 5 V into a GPIO", TPIC, five_volts_into_a_gpio, ("GPIO 1 ", "bears 3.6 V", "5.0 V", "4Y")),
    ("pull-up to 5 V at GPIO 20", TPIC, pull_up_to_5v, ("GPIO 20", "bears 3.6 V", "5.0 V")),
    ("3.3 V into CMOS at 5 V", HC, without_shifter, ("RCLK", "3.50 V for high", "GPIO 17", "2.62 V")),
    ("a plain buffer in place of the gate", TPIC, plain_buffer, ("reset or boot loader", "is low")),
    ("no pull-down at the gate, and a pin that leaks", TLC, no_pull_down, ("reset or boot loader", "output enable", "nothing holds")),
    ("no pull-down at the gate", TPIC, no_pull_down, ("wire from the board broken", "neither low nor high", "nothing holds")),
    ("a weak pull-down at the gate", HC, weak_pull_down, ("leaks 0.12 mA", "1.20 V at R1", "0.80 V at most")),
    ("the gate fed by the Pico", TPIC, gate_fed_by_the_pico, ("board without power", "U2 has no supply")),
    ("registers that the Pico's lines feed", HC, all_without_shifter, ("registers' supply off", "U3 pin 11 (SRCLK), which the board")),
    ("registers at 3.3 V that LEDs at 5 V feed", on_3v3_from_leds, nothing, ("board without power", "U3 pin 1 (Q1), at D2")),
    ("a register without supply", TLC, no_supply, ("U6 pin 16 (VDD)", "connected to nothing")),
    ("a TPIC6B595 at 3.3 V", TPIC, too_little_supply, ("U4 pin 2 (VCC)", "4.5 to 5.5 V", "3.3 V")),
    ("a ground pin at a supply", DESK, ground_on_a_supply, ("U3 pin GND", "not ground")),
    ("two LEDs swapped", TLC, leds_swapped, ("U4 pin 8 (Q3)", "D13 instead of D12")),
    ("an LED the wrong way round", TLC, led_reversed, ("D20 is never lit", "U5 pin 8 (Q3)")),
    ("firmware built for the other bit", HC, built_for_the_other_bit, ("D1 is never lit", "cathode")),
    ("two rows swapped", TLC, rows_swapped, ("U6 pin 2 (SDI), row 3", "U5 pin 14 (SDO)")),
    ("a resistor of an LED that is too small", HC, small_resistor, ("U5 pin 15 (Q0)", "mA, not 0 to 8 mA")),
    ("a current that is too low", TLC, large_resistor_at_a_sink, ("U6 pin 5 (Q0)", "0.3 mA, not 3 to 120 mA")),
    ("a low current that is too low", TLC, low_current_too_low, ("U5 pin 5 (Q0)", "2.1 mA, not 3 to 120 mA")),
    ("a low current that a resistor of 5 % may lower", TLC, low_current_at_the_edge, ("U5 pin 5 (Q0)", "3.0 mA, not 3 to", "±5 %")),
    ("an LED with more current than it bears", TPIC, resistor_of_20_ohm, ("D17 has 145.0 mA", "20.0 mA")),
    ("an LED with too little current", TPIC, resistor_of_150_kilohm, ("D17 has 0.0 mA", "20.0 mA")),
    ("a row without its current switch", TLC, switch_of_one_row_missing, ("D1 has 3.3 mA", "20.0 mA")),
    ("a row with another low current", TLC, low_current_of_one_row, ("U5 has 3.99 and", "U3 3.35 and")),
    ("two current pins joined", TLC, current_pins_joined, ("U3 pin 15 (R-EXT)", "U4 pin 15 (R-EXT)", "share")),
    ("no pull-down at the current switch", TLC, no_pull_down_at_the_switch, ("reset or", "Q1 pin 1 (G)", "neither low nor high")),
    ("no pull-down at the Nucleo's switch", ON_NUCLEO, no_pull_down_at_the_switch, ("without power", "Q8", "neither low nor high")),
    ("a pull-up at the current switch", TLC, pull_up_at_the_switch, ("reset or boot loader", "Q1 pin 1 (G)", "is high")),
    ("a clock at a serial out", TLC, clock_at_a_carry, ("U5 pin 3 (CLK)", "clock", "leads to no pin of the board")),
    ("a latch at a serial out", HC, latch_at_a_carry, ("U5 pin 12 (RCLK)", "latch", "leads to no pin of the board")),
    ("clear of one register at ground", HC, clear_at_ground, ("U5 pin 10 (SRCLR)", "GND", "empty")),
    ("clear of all registers at ground", TPIC, all_clear_at_ground, ("U10 pin 8 (SRCLR)", "GND", "empty")),
    ("the shifter's latch is not enabled", DESK, latch_not_enabled, ("U2 pin 4 (2OE)", "5.0 V", "2Y drives nothing")),
    ("the shifter's data is not enabled", TPIC, data_not_enabled, ("U11 pin 1 (1OE)", "5.0 V", "1Y drives nothing")),
    ("the board's RUN at ground", TLC, run_at_ground, ("U1 pin 30 (RUN)", "does not start")),
    ("no pull-up at SDA", TPIC, no_pull_up, ("SDA", "without a pull-up")),
    ("pull-up of I2C to 5 V", TPIC, pull_up_of_i2c_to_5v, ("SCL", "GPIO 5", "bears 3.6 V", "5.0 V")),
    ("a camera with pads at 1.8 V", CAMERA_KIT, pads_at_1v8, ("GPIO 14", "2.00 V for high", "1.80 V")),
    ("the sensor's address left open", TLC, address_open, ("U12 pin ADDR", "floats")),
    ("the sensor's address at its supply", DESK, address_at_the_supply, ("U4 pin ADDR", "3V3", "not at ground")),
    ("no capacitor at the sensor", HC, no_capacitor_at_the_sensor, ("U12", "100 nF", "3V3")),
    ("clear left open", HC, clear_open, ("U8 pin 10 (SRCLR)", "floats")),
    ("a pin that does not exist", DESK, no_such_pin, ("U2 (74AHCT125) has no pin 15",)),
    ("a wire at a pin without connection", TLC, at_a_pin_without_connection, ("U2 pin 1 (NC)", "no connection inside")),
    ("the latch at a GPIO that the firmware does not use", TLC, another_gpio, ("GPIO 22", "does not use it")),
    ("LEDs fed by the Pico's 3.3 V", TLC, leds_from_3v3, ("3V3", "300 mA at most")),
    ("LEDs to ground, fed by the Pico's 3.3 V", on_3v3_to_ground, nothing, ("3V3", "300 mA at most", "463 mA")),
    ("LEDs to ground, and the registers before the fuse", TO_GROUND, registers_before_the_fuse, ("5V, ", "before the fuse", "64 LEDs")),
    ("all LEDs before the fuse", TLC, leds_before_the_fuse, ("5V, ", "before the fuse", "64 LEDs")),
    ("a fuse that is too large", TLC, large_fuse, ("F1, 20 A", "gives 2000 mA")),
    ("a fuse that is too small", TLC, small_fuse, ("F1, 1 A", "does not suit")),
    ("the board's diode the wrong way round", TLC, diode_reversed, ("U1 pin 39 (VSYS)", "no supply feeds")),
    ("no electrolytic capacitor", TLC, no_electrolytic, ("LED+", "no electrolytic capacitor")),
    ("an electrolytic capacitor without low ESR", TLC, ordinary_electrolytic, ("LED+", "dips by 0.80 V")),
    ("a small electrolytic capacitor", TPIC, small_electrolytic, ("LED+", "dips by 0.43 V")),
    ("an electrolytic capacitor the wrong way round", TPIC, electrolytic_reversed, ("C1 ", "pin 1", "higher voltage")),
    ("USB feeds too much, partly through the board", DESK, too_much_for_usb, ("U1 pin 40 (VBUS)", "500 mA at most", "570 mA")),
    ("the supply feeds too much, partly through a diode", TLC, too_much_for_the_supply, ("J1 pin +", "2000 mA at most", "2050 mA")),
    ("a pin on two nets", TLC, two_nets, ("R1 pin 1", "2 nets")),
    ("two data lines of the camera swapped", CAMERA_KIT, data_lines_swapped, ("U2 pin D3", "data3", "GPIO 10")),
)


# --- Faults elsewhere ------------------------------------------------------------------------------------------------------------------


def firmware_moved(root, firmware, rules):
    """The firmware's latch on another pin."""
    roles, pulled = firmware.read(root, "tx-firmware/boards/pico")
    return rules.check(TLC(), roles | {"latch": "GP16"}, pulled)


def firmware_without_pull(root, firmware, rules):
    """The firmware without its pull-up at the serial port."""
    roles, pulled = firmware.read(root, "rx-pipeline/boards/pico")
    return rules.check(CAMERA_KIT().without_options(), roles, pulled - {"GP1"})


def changed(root, page, old, new):
    text = (root / page).read_text()
    if old not in text:
        return None
    return text.replace(old, new, 1)


def page_names_another_pin(root, _firmware, _rules):
    text = changed(root, pages.ROAD, "18 (24), 19 (25)", "18 (25), 19 (24)")
    return pages.check_pico_pins(pages.ROAD, text, ()) if text else ()


def page_swaps_lines(root, firmware, _rules):
    roles, _ = firmware.read(root, "tx-firmware/boards/pico")
    text = changed(root, pages.ROAD, "18 (24), 19 (25)", "19 (25), 18 (24)")
    return pages.check_rows(pages.ROAD, text, r"(\d+) \(\d+\)", "GP{}", pages.ROAD_ROWS, roles) if text else ()


def page_swaps_register_pins(root, _firmware, _rules):
    text = changed(root, pages.ROAD, "| 15, 1 to 7 |", "| 15, 1 to 6, 9 |")
    return pages.check_registers(pages.ROAD, text) if text else ()


def page_has_an_old_wire(root, _firmware, _rules):
    text = changed(root, pages.ROAD, "U3 to U9 SDO (pin 14)", "U3 to U9 SDO (pin 9)")
    return pages.check_table(pages.ROAD, text, "wires of road-kit-tlc5916", pages.wires_table(TLC())) if text else ()


def table_of_swapped_rows(_root, _firmware, _rules):
    """One row of the table must not stand for rows that are not wired alike."""
    circuit = TLC()
    rows_swapped(circuit)
    return pages.wires_table(circuit)


def page_of_the_nucleo(root, firmware, _rules):
    roles, _ = firmware.read(root, "tx-firmware/boards/nucleo-g474")
    text = changed(root, pages.PORTING, "| PA5, PA7 |", "| PA5, PA6 |")
    return pages.check_rows(pages.PORTING, text, r"\b(P[A-G]\d+)\b", "{}", pages.NUCLEO_ROWS, roles) if text else ()


def page_demands_another_fuse(root, _firmware, _rules):
    text = changed(root, pages.SAFETY, "put a 2 A", "put a 5 A")
    return pages.check_fuse(text, [TLC()]) if text else ()


def page_has_another_low_current(root, _firmware, _rules):
    text = changed(root, pages.ROAD, "= 0.164 of", "= 0.125 of")
    return pages.check_low_current(text, (root / pages.CALIBRATION).read_text(), [TLC()]) if text else ()


def firmware_has_other_resistors(root, _firmware, _rules):
    text = changed(root, pages.CALIBRATION, "(1_100 + 5_600)", "(1_100 + 8_200)")
    return pages.check_low_current((root / pages.ROAD).read_text(), text, [TLC()]) if text else ()


ELSEWHERE = (
    ("the firmware's latch moved", firmware_moved, ("latch", "GPIO 17", "GPIO 16")),
    ("the firmware does not pull the serial port", firmware_without_pull, ("GPIO 1 ", "floats")),
    ("a page with the wrong pin", page_names_another_pin, ("GPIO 18 is pin 24", "not 25")),
    ("a page with two lines swapped", page_swaps_lines, ("SPI 0 SCK, TX", "GP19, GP18")),
    ("a page with the wrong pin of a register", page_swaps_register_pins, ("columns 0 to 7 of 74HC595",)),
    ("a page with an old wire", page_has_an_old_wire, ("road-kit.md", "wires of road-kit-tlc5916", "--write")),
    ("a table of two rows swapped", table_of_swapped_rows, ("| ROW3 |", "U7 SDI (pin 2)")),
    ("a page with the wrong pin of the Nucleo", page_of_the_nucleo, ("shift clock", "PA6")),
    ("a page with another fuse", page_demands_another_fuse, ("light-safety.md", "5 A", "2 A")),
    ("a page with another low current", page_has_another_low_current, ("road-kit.md", "0.164")),
    ("other resistors of the low current in the firmware", firmware_has_other_resistors, ("calibration.rs", "5600")),
)
FAULTS = (*WIRING, *ELSEWHERE)


def check(root, firmware, rules):
    """The faults that no rule reports."""
    for name, make, plant, words in WIRING:
        circuit = make()
        plant(circuit)
        yield from missed(name, rules.check(circuit, *firmware.read(root, circuit.board)), words)
    for name, find, words in ELSEWHERE:
        yield from missed(name, find(root, firmware, rules), words)


def missed(name, problems, words):
    problems = list(problems)
    if not any(all(word in problem for word in words) for problem in problems):
        yield f"planted fault: {name}: no rule names {', '.join(words)}; they say: {'; '.join(problems) or 'nothing'}"
