"""The desk kit: a Pico, a level shifter and a module. docs/hardware/desk-kit.md has its picture and its tables."""

from circuit import Circuit
from parts import CAPACITOR, MODULE_MAX7219, PICO, SENSOR, SHIFTER


def desk_kit():
    kit = Circuit("desk-kit", "Desk kit", "docs/hardware/desk-kit.md", "tx-firmware/boards/pico")
    breakout = "optional: breakout with BH1750, VEML7700, TSL2591 or OPT3001, and pull-ups"
    sensor = kit.add("U4", SENSOR, remarks=breakout, at=(0, 0), optional=True)
    pico = kit.add("U1", PICO, at=(1, 0))
    shifter = kit.add("U2", SHIFTER, remarks="fed with 5 V: the module asks for 3.5 V, a Pico gives 3.3 V", at=(2, 0))
    module = kit.add("U3", MODULE_MAX7219, remarks="32 mm wide (pitch 4 mm) or 60 mm (pitch 7.62 mm)", at=(3, 0))
    capacitor = kit.add("C1", CAPACITOR, "100 nF", beside="U2", at=(3, 7.5))

    # USB feeds all. The Pico passes it on at VBUS.
    kit.wire("5V", pico["VBUS"], shifter["VCC"], module["VCC"], capacitor["1"])
    kit.wire("3V3", pico["3V3"], sensor["VCC"])
    kit.wire("GND", pico["GND"], pico["GND8"], shifter["GND"], module["GND"], sensor["GND"], sensor["ADDR"], capacitor["2"])

    kit.wire("DATA", pico["GP19"], shifter["1A"])
    kit.wire("LATCH", pico["GP17"], shifter["2A"])
    kit.wire("CLOCK", pico["GP18"], shifter["3A"])
    kit.wire("DIN", shifter["1Y"], module["DIN"])
    kit.wire("CS", shifter["2Y"], module["CS"])
    kit.wire("CLK", shifter["3Y"], module["CLK"])
    # All four buffers are enabled, and the unused one has a level at its input.
    kit.wire("GND", *(shifter[f"{gate}OE"] for gate in range(1, 5)), shifter["4A"])
    kit.leave_open(shifter["4Y"], "unused")

    kit.wire("SDA", pico["GP4"], sensor["SDA"])
    kit.wire("SCL", pico["GP5"], sensor["SCL"])

    # A module has no output enable; it is dark from its own power-up until the program has started.
    for role in ("lit", "full_current"):
        kit.unused_roles[role] = "a MAX7219 dims by itself"
    for role in ("transmit", "receive"):
        kit.unused_roles[role] = "USB is the serial port"
    return kit


CIRCUITS = (desk_kit,)
