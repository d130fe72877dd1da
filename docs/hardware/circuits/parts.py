"""The parts of the kits: pins, levels and limits. `source` names the data sheet of these numbers; assumptions are marked.

Pins are lines of number, name, kind and role; `circuit.py` has the kinds. Numbers are those of the package that `footprint` names. A dash
instead of a number means that the order on a module differs from maker to maker: wire by name.
"""

from dataclasses import replace

from circuit import Above, Fixed, Part, Share, pins

# --- Boards ----------------------------------------------------------------------------------------------------------------------------

# The Pico 2 has the same pins. Its chip takes 2.0 V for high, too, and gives at least 2.62 V.
PICO = Part(
    name="Raspberry Pi Pico or Pico 2",
    source="Raspberry Pi Pico datasheet, “Pinout” and “Powering Pico”; RP2040 datasheet 5.2.3, “Pin Specifications”, at 3.3 V",
    pins=pins(
        """
        1 GP0 gpio
        2 GP1 gpio
        3 GND3 ground
        4 GP2 gpio
        5 GP3 gpio
        6 GP4 gpio
        7 GP5 gpio
        8 GND8 ground
        9 GP6 gpio
        10 GP7 gpio
        11 GP8 gpio
        12 GP9 gpio
        13 GND13 ground
        14 GP10 gpio
        15 GP11 gpio
        16 GP12 gpio
        17 GP13 gpio
        18 GND18 ground
        19 GP14 gpio
        20 GP15 gpio
        21 GP16 gpio
        22 GP17 gpio
        23 GND23 ground
        24 GP18 gpio
        25 GP19 gpio
        26 GP20 gpio
        27 GP21 gpio
        28 GND28 ground
        29 GP22 gpio
        30 RUN passive reset
        31 GP26 gpio
        32 GP27 gpio
        33 AGND ground
        34 GP28 gpio
        35 ADC_VREF passive
        36 3V3 source
        37 3V3_EN passive reset
        38 GND ground
        39 VSYS supply
        40 VBUS source
        """
    ),
    left=tuple(f"{number}" for number in range(1, 21)),
    right=tuple(f"{number}" for number in range(40, 20, -1)),
    supply_v=(1.8, 5.5),
    source_v={"3V3": 3.3, "VBUS": 5.0},
    # A USB port gives 500 mA.
    source_ma={"3V3": 300, "VBUS": 500},
    # Assumed, for either board.
    supply_ma=100,
    powered_by=("VSYS", "VBUS"),
    makes=("3V3",),
    logic_supply="3V3",
    input_low=Fixed(0.8),
    input_high=Fixed(2.0),
    output_low=Fixed(0.5),
    output_high=Fixed(2.62),
    most=Above(0.3),
    pulls_down_in_reset=True,
    # RP2350 datasheet, erratum E9.
    gpio_leak_ma=0.12,
    may_be_open=True,
    footprint="Module:RaspberryPi_Pico_Common_THT",
)

NUCLEO = Part(
    name="STM32 Nucleo-G474RE",
    source="ST UM2505, “Extension connectors”; STM32G474 datasheet, “I/O port characteristics”, at 3.3 V",
    pins=pins(
        """
        - PA2 gpio
        - PA3 gpio
        - PA5 gpio
        - PA7 gpio
        - PA8 gpio
        - PB10 gpio
        - PC1 gpio
        - PC8 gpio
        - PC9 gpio
        - GND ground
        - 3V3 source
        - 5V source
        """
    ),
    left=("PC8", "PC9", "GND"),
    right=("5V", "3V3", "PA7", "PA5", "PC1", "PA8", "PB10"),
    source_v={"3V3": 3.3, "5V": 5.0},
    source_ma={"3V3": 500, "5V": 500},
    logic_supply="3V3",
    input_low=Share(0.3),
    input_high=Share(0.7),
    output_low=Fixed(0.4),
    output_high=Above(-0.4),
    most=Above(0.3),
    may_be_open=True,
)

# --- Logic -----------------------------------------------------------------------------------------------------------------------------

# Levels of TTL on 5 V: it takes the Pico's 3.3 V for high.
SHIFTER = Part(
    name="74AHCT125",
    source="Texas Instruments SN74AHCT125 datasheet (SCLS264), “Pin Configuration and Functions”, “Recommended Operating Conditions”",
    pins=pins(
        """
        1 1OE input
        2 1A input
        3 1Y output
        4 2OE input
        5 2A input
        6 2Y output
        7 GND ground
        8 3Y output
        9 3A input
        10 3OE input
        11 4Y output
        12 4A input
        13 4OE input
        14 VCC supply
        """
    ),
    left=("1A", "2A", "3A", "4A", "1OE", "2OE", "3OE", "4OE"),
    right=("1Y", "2Y", "3Y", "4Y", "VCC", "GND"),
    supply_v=(4.5, 5.5),
    input_low=Fixed(0.8),
    input_high=Fixed(2.0),
    output_low=Fixed(0.1),
    output_high=Above(-0.1),
    most=Fixed(5.5),
    decoupling="100 nF",
    gates=tuple((f"{gate}A", f"{gate}OE", f"{gate}Y", False) for gate in range(1, 5)),
    footprint="Package_DIP:DIP-14_W7.62mm",
)

GATE_5V = Part(
    name="74AHCT1G04",
    source="Texas Instruments SN74AHCT1G04 datasheet (SCLS319), “Pin Configuration and Functions”, “Electrical Characteristics”",
    pins=pins(
        """
        1 NC none
        2 A input
        3 GND ground
        4 Y output
        5 VCC supply
        """
    ),
    left=("A",),
    right=("Y", "VCC", "GND"),
    supply_v=(4.5, 5.5),
    input_low=Fixed(0.8),
    input_high=Fixed(2.0),
    output_low=Fixed(0.1),
    output_high=Above(-0.1),
    most=Fixed(5.5),
    decoupling="100 nF",
    gates=(("A", None, "Y", True),),
    footprint="Package_TO_SOT_SMD:SOT-23-5",
)

GATE_3V3 = replace(
    GATE_5V,
    name="74LVC1G04",
    source="Texas Instruments SN74LVC1G04 datasheet (SCES214), “Pin Configuration and Functions”, levels of 2.7 to 3.6 V",
    supply_v=(2.7, 3.6),
)

# --- Shift registers with output latches -----------------------------------------------------------------------------------------------

# The clear keeps the latched outputs, so the supply holds it.
REGISTER_HC = Part(
    name="74HC595",
    source="Texas Instruments SN74HC595 datasheet (SCLS041), “Pin Configuration and Functions”, “Recommended Operating Conditions”",
    pins=pins(
        """
        1 Q1 output column
        2 Q2 output column
        3 Q3 output column
        4 Q4 output column
        5 Q5 output column
        6 Q6 output column
        7 Q7 output column
        8 GND ground
        9 Q7' output carry
        10 SRCLR input clear
        11 SRCLK input clock
        12 RCLK input latch
        13 OE input enable
        14 SER input data
        15 Q0 output column
        16 VCC supply
        """
    ),
    left=("SER", "SRCLK", "RCLK", "OE", "SRCLR", "VCC", "GND"),
    right=("Q0", "Q1", "Q2", "Q3", "Q4", "Q5", "Q6", "Q7", "Q7'"),
    supply_v=(2.0, 6.0),
    input_low=Share(0.3),
    input_high=Share(0.7),
    output_low=Fixed(0.1),
    output_high=Above(-0.1),
    most=Above(0.0),
    decoupling="100 nF",
    output_ma=(0, 8),
    all_outputs_ma=70,
    footprint="Package_DIP:DIP-16_W7.62mm",
)

REGISTER_TPIC = Part(
    name="TPIC6B595",
    source="Texas Instruments TPIC6B595 datasheet (SLIS032), “Pin Configuration and Functions”, “Recommended Operating Conditions”",
    pins=pins(
        """
        1 NC1 none
        2 VCC supply
        3 SER input data
        4 Q0 drain column
        5 Q1 drain column
        6 Q2 drain column
        7 Q3 drain column
        8 SRCLR input clear
        9 G input enable
        10 GND10 ground
        11 GND11 ground
        12 RCK input latch
        13 SRCK input clock
        14 Q4 drain column
        15 Q5 drain column
        16 Q6 drain column
        17 Q7 drain column
        18 SEROUT output carry
        19 GND19 ground
        20 NC20 none
        """
    ),
    left=("SER", "SRCK", "RCK", "G", "SRCLR", "VCC", "GND10", "GND11", "GND19"),
    right=("Q0", "Q1", "Q2", "Q3", "Q4", "Q5", "Q6", "Q7", "SEROUT"),
    supply_v=(4.5, 5.5),
    input_low=Share(0.15),
    input_high=Share(0.85),
    output_low=Fixed(0.1),
    output_high=Above(-0.1),
    most=Above(0.3),
    drain_most=Fixed(50),
    decoupling="100 nF",
    output_ma=(0, 150),
    all_outputs_ma=500,
    output_drop_v=0.1,
    footprint="Package_DIP:DIP-20_W7.62mm",
)

REGISTER_TLC = Part(
    name="TLC5916",
    source="Texas Instruments TLC5916 datasheet (SLVS695), “Pin Configuration and Functions”, “Recommended Operating Conditions”, "
    "“Adjusting Output Current”",
    pins=pins(
        """
        1 GND ground
        2 SDI input data
        3 CLK input clock
        4 LE input latch
        5 Q0 drain column
        6 Q1 drain column
        7 Q2 drain column
        8 Q3 drain column
        9 Q4 drain column
        10 Q5 drain column
        11 Q6 drain column
        12 Q7 drain column
        13 OE input enable
        14 SDO output carry
        15 R-EXT passive current
        16 VDD supply
        """
    ),
    left=("SDI", "CLK", "LE", "OE", "R-EXT", "VDD", "GND"),
    right=("Q0", "Q1", "Q2", "Q3", "Q4", "Q5", "Q6", "Q7", "SDO"),
    supply_v=(3.0, 5.5),
    # At most 52 mA an output.
    supply_ma=18,
    input_low=Share(0.3),
    input_high=Share(0.7),
    output_low=Fixed(0.4),
    output_high=Above(-0.4),
    most=Above(0.0),
    drain_most=Fixed(20),
    decoupling="100 nF",
    output_ma=(3, 120),
    sink_volts=15 * 1.25,
    footprint="Package_DIP:DIP-16_W7.62mm",
)

# The same pins. Its resistor is by the curve of its own datasheet, so the current is not computed.
REGISTER_STP = replace(
    REGISTER_TLC,
    name="STP08DP05",
    source="STMicroelectronics STP08DP05 datasheet (DocID13405), “Pin description”, “Recommended operating conditions”",
    output_ma=(5, 100),
    sink_volts=0,
)

# --- Modules ---------------------------------------------------------------------------------------------------------------------------

# Its capacitors, 100 nF and 10 µF, and the resistor at ISET are on it.
MODULE_MAX7219 = Part(
    name="8×8 module with MAX7219",
    source="Maxim MAX7219 datasheet (19-4452), “DC Electrical Characteristics”, “Absolute Maximum Ratings”",
    pins=pins(
        """
        - VCC supply
        - GND ground
        - DIN input data
        - CS input latch
        - CLK input clock
        """
    ),
    left=("DIN", "CS", "CLK", "VCC", "GND"),
    supply_v=(4.0, 5.5),
    # 8 · 40 mA · 31/32 at ISET's 10 kΩ.
    supply_ma=320,
    input_low=Fixed(0.8),
    input_high=Fixed(3.5),
    most=Above(0.3),
)

# What the four have in common. Only OPT3001 and BH1750 have ADDR, which sets the address. INT, if there is one, stays open.
SENSOR = Part(
    name="light sensor on I2C",
    source="supply and levels of I2C that Texas Instruments OPT3001 (SBOS681), ROHM BH1750FVI, Vishay VEML7700 and ams TSL2591 share",
    pins=pins(
        """
        - VCC supply
        - GND ground
        - SCL bus scl
        - SDA bus sda
        - ADDR input address
        """
    ),
    right=("SDA", "SCL", "VCC", "GND", "ADDR"),
    supply_v=(2.7, 3.6),
    supply_ma=1,
    input_low=Fixed(0.54),
    input_high=Share(0.7),
    output_low=Fixed(0.4),
    most=Above(0.3),
    has_pull_ups=True,
)

# The chip without a breakout needs pull-ups and a capacitor; so do breakouts that have none.
SENSOR_ALONE = replace(SENSOR, has_pull_ups=False, decoupling="100 nF")

# Its outputs are at the supply of the chip's pads, which is the module's choice. At 1.8 V a Pico does not see them.
CAMERA = Part(
    name="module with HM01B0",
    source="names of the pins: ArmDeveloperEcosystem/hm01b0-library-for-pico; the pads' supply is a choice of the module's maker, and "
    "0.8 of it for high is assumed",
    pins=pins(
        """
        - VCC supply
        - GND ground
        - SCL bus scl
        - SDA bus sda
        - D0 output data0
        - D1 output data1
        - D2 output data2
        - D3 output data3
        - D4 output data4
        - D5 output data5
        - D6 output data6
        - D7 output data7
        - PCLK output pixel_clock
        - HREF output line_valid
        - VSYNC output frame_valid
        """
    ),
    right=("SDA", "SCL", "D0", "D1", "D2", "D3", "D4", "D5", "D6", "D7", "PCLK", "HREF", "VSYNC", "VCC", "GND"),
    supply_v=(3.0, 3.6),
    supply_ma=20,
    logic_own_v=2.8,
    input_low=Share(0.3),
    input_high=Share(0.7),
    output_low=Fixed(0.4),
    output_high=Share(0.8),
    most=Above(0.3),
    has_pull_ups=True,
    may_be_open=True,
)

# It has its supply from its own USB.
ADAPTER = Part(
    name="serial adapter, 3.3 V",
    source="levels of JEDEC JESD8C at 3.3 V",
    pins=pins(
        """
        - RX input transmit
        - TX output receive
        - GND ground
        """
    ),
    prefix="J",
    right=("RX", "TX", "GND"),
    logic_own_v=3.3,
    input_low=Fixed(0.8),
    input_high=Fixed(2.0),
    output_low=Fixed(0.4),
    output_high=Fixed(2.4),
    most=Above(0.3),
)

SUPPLY_5V = Part(
    name="supply, 5 V, 2 A",
    source="light-safety.md, “Supply and fuse”",
    pins=pins(
        """
        - + source
        - - ground
        """
    ),
    prefix="J",
    right=("+", "-"),
    source_v={"+": 5.0},
    source_ma={"+": 2000},
)

# --- Parts with two or three pins ------------------------------------------------------------------------------------------------------

RESISTOR = Part(
    name="resistor",
    source="",
    pins=pins("1 1 passive\n2 2 passive"),
    prefix="R",
    symbol="resistor",
    left=("1",),
    right=("2",),
    footprint="Resistor_THT:R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal",
)

CAPACITOR = replace(
    RESISTOR, name="ceramic capacitor", prefix="C", symbol="capacitor", footprint="Capacitor_THT:C_Disc_D5.0mm_W2.5mm_P5.00mm"
)

# Its first pin is the positive one. An ordinary one has about 0.56 Ω at 470 µF and 10 V, by tan δ = 0.2 at 120 Hz.
ELECTROLYTIC = replace(
    CAPACITOR,
    name="electrolytic capacitor",
    is_polarised=True,
    series_ohm=0.1,
    footprint="Capacitor_THT:CP_Radial_D8.0mm_P3.50mm",
)

FUSE = replace(RESISTOR, name="fuse", prefix="F", symbol="fuse", footprint="")

LED = Part(
    name="LED",
    source="",
    pins=pins("1 K passive\n2 A passive"),
    prefix="D",
    symbol="led",
    left=("K",),
    right=("A",),
    footprint="LED_THT:LED_D5.0mm",
)

SCHOTTKY = replace(LED, name="Schottky diode", symbol="diode", footprint="Diode_THT:D_DO-41_SOD81_P10.16mm_Horizontal")

# Low is below the least threshold, high 1 V above the greatest, 1.5 V. A few ohms in series with a resistor of 1 kΩ do not matter.
TRANSISTOR = Part(
    name="BSS138",
    source="onsemi BSS138 datasheet, “Electrical Characteristics”, package SOT-23",
    pins=pins(
        """
        1 G input full_current
        2 S ground
        3 D drain
        """
    ),
    prefix="Q",
    left=("G",),
    right=("D", "S"),
    input_low=Fixed(0.8),
    input_high=Fixed(2.5),
    most=Fixed(20),
    drain_most=Fixed(50),
    footprint="Package_TO_SOT_SMD:SOT-23",
)
