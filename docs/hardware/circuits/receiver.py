"""The receiver: a Pico and a camera. docs/hardware/receiver.md has its picture and its tables."""

from circuit import Circuit
from parts import ADAPTER, CAMERA, PICO


def receiver():
    kit = Circuit("receiver", "Receiver", "docs/hardware/receiver.md", "rx-pipeline/boards/pico")
    camera = kit.add("U2", CAMERA, remarks="D0 to D7 led out, an oscillator of 24 MHz, pads at 2.8 V", at=(0, 6.5))
    adapter = kit.add("J1", ADAPTER, remarks="optional, 115 200 baud: USB is a serial port, too", at=(0, 0), optional=True)
    pico = kit.add("U1", PICO, at=(1, 0))

    kit.wire("3V3", pico["3V3"], camera["VCC"])
    kit.wire("GND", pico["GND"], pico["GND3"], camera["GND"], adapter["GND"])

    kit.wire("TX", pico["GP0"], adapter["RX"])
    kit.wire("RX", pico["GP1"], adapter["TX"])
    # The module has the pull-ups.
    kit.wire("SDA", pico["GP4"], camera["SDA"])
    kit.wire("SCL", pico["GP5"], camera["SCL"])
    for bit in range(8):
        kit.wire(f"D{bit}", pico[f"GP{6 + bit}"], camera[f"D{bit}"])
    kit.wire("PCLK", pico["GP14"], camera["PCLK"])
    kit.wire("HREF", pico["GP15"], camera["HREF"])
    kit.wire("VSYNC", pico["GP16"], camera["VSYNC"])

    kit.on_board["lamp"] = "the lamp"
    return kit


CIRCUITS = (receiver,)
