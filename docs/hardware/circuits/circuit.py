"""A circuit as parts, pins and nets."""

from dataclasses import dataclass, field, replace

# The function of a pin. `gpio` is set by the firmware, `bus` is a line of I2C, `drain` sinks current and never drives
# high, `source` feeds others, `none` has no connection inside.
KINDS = ("gpio", "input", "output", "drain", "bus", "supply", "source", "ground", "passive", "none")


@dataclass(frozen=True)
class Share:
    """A voltage as a share of the supply."""

    share: float

    def volts(self, supply_v):
        return self.share * supply_v


@dataclass(frozen=True)
class Above:
    """A voltage above the supply, or below it."""

    volts_above: float

    def volts(self, supply_v):
        return supply_v + self.volts_above


@dataclass(frozen=True)
class Fixed:
    """A voltage that no supply changes."""

    fixed_v: float

    def volts(self, _supply_v):
        return self.fixed_v


@dataclass(frozen=True)
class Pin:
    number: str
    name: str
    kind: str
    # The firmware's name of the line to this pin.
    role: str = ""


@dataclass(frozen=True, eq=False)
class Part:
    """A kind of part. Its numbers are from `source`, if that names a data sheet."""

    name: str
    source: str
    pins: tuple
    # The first letters of its designators.
    prefix: str = "U"
    # Its symbol: chip, resistor, capacitor, led, diode, fuse.
    symbol: str = "chip"
    left: tuple = ()
    right: tuple = ()
    # The range of its supply.
    supply_v: tuple = ()
    # The voltages of its sources, by the pins' names, and their maximum currents.
    source_v: dict = field(default_factory=dict)
    source_ma: dict = field(default_factory=dict)
    # Its maximum supply current.
    supply_ma: float = 0
    # A board: the pins that power it, either of which feeds it alone, and the sources that it makes of them.
    powered_by: tuple = ()
    makes: tuple = ()
    # The supply pin that its levels refer to, if not the only one, or a voltage of its own.
    logic_supply: str = ""
    logic_own_v: float = None
    # An input is low up to the first level, and high from the second on; an output reaches these.
    input_low: object = None
    input_high: object = None
    output_low: object = None
    output_high: object = None
    # The maximum voltage of a pin: of inputs and outputs, and of drains.
    most: object = None
    drain_most: object = None
    # The required capacitance beside it, from its supply to ground.
    decoupling: str = ""
    # (input, output enable that is active low or None, output, whether it inverts).
    gates: tuple = ()
    # Whether its lines of I2C have pull-ups.
    has_pull_ups: bool = False
    # Whether its GPIO are pulled down while no program runs, and their maximum leakage.
    pulls_down_in_reset: bool = False
    gpio_leak_ma: float = 0
    # An electrolytic capacitor: its first pin has the higher voltage. Its maximum series resistance.
    is_polarised: bool = False
    series_ohm: float = 0
    # A board or module: pins may stay open.
    may_be_open: bool = False
    # The current of one output, least and most, and of all together, mA.
    output_ma: tuple = ()
    all_outputs_ma: float = 0
    # A current sink: the output's current times the resistance of its resistor.
    sink_volts: float = 0
    # The voltage across an output while it sinks or feeds.
    output_drop_v: float = 0
    footprint: str = ""

    def is_active_low(self, pin):
        return pin.role in ("enable", "clear") or any(gate[1] == pin.name for gate in self.gates)

    def pin(self, name):
        """The pin of this name or number."""
        for pin in self.pins:
            if name in (pin.name, pin.number):
                return pin
        raise ValueError(f"{self.name} has no pin {name}")


def pins(text):
    """Pins from lines of number, name, kind and, if there is one, role. Without a number the pin has its name only."""
    found = []
    for line in text.strip().splitlines():
        number, name, kind, *role = line.split()
        if kind not in KINDS:
            raise ValueError(f"{name} is a {kind}, which is none of {', '.join(KINDS)}")
        found.append(Pin(name if number == "-" else number, name, kind, *role))
    numbers = [pin.number for pin in found]
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"a pin stands twice among {', '.join(numbers)}")
    return tuple(found)


@dataclass
class Component:
    """A part of a circuit, with its designator."""

    ref: str
    part: Part
    value: str = ""
    remarks: str = ""
    # Its place in the picture: column and line. Without a place it is not drawn.
    at: tuple = None
    # The component beside it.
    beside: str = ""
    # Whether the kit works without it.
    optional: bool = False

    def __getitem__(self, name):
        return (self.ref, self.part.pin(name).number)


class Circuit:
    def __init__(self, name, title, page, board, notes=()):
        self.name = name
        self.title = title
        # The page that has its picture.
        self.page = page
        # The Rust sources that name the pins.
        self.board = board
        self.notes = notes
        self.components = {}
        # Nets by name, each a list of (designator, pin's number).
        self.nets = {}
        # Pins that stay open, with the reason.
        self.open = {}
        # The roles of the firmware that are not connected, and those that the board itself connects, with the reason.
        self.unused_roles = {}
        self.on_board = {}
        # The LEDs' forward voltage, V, and their design current, mA.
        self.led_v = 2.0
        self.design_ma = 20.0
        # The bit that lights an LED, as the firmware is built. A sink's 1 pulls its output low.
        self.lit_by = 1

    def add(self, ref, part, value="", remarks="", at=None, beside="", optional=False):
        if ref in self.components:
            raise ValueError(f"{ref} stands twice")
        self.components[ref] = Component(ref, part, value, remarks, at, beside, optional)
        return self.components[ref]

    def wire(self, net, *ends):
        """Connects pins to a net."""
        self.nets.setdefault(net, []).extend(ends)

    def leave_open(self, end, reason):
        self.open[end] = reason

    def without_options(self):
        """The circuit without its optional parts, and without the nets that led only to them."""
        other = self.copy()
        for ref in [ref for ref, component in self.components.items() if component.optional]:
            del other.components[ref]
        other.nets = {name: [end for end in ends if end[0] in other.components] for name, ends in self.nets.items()}
        other.nets = {name: ends for name, ends in other.nets.items() if len(ends) > 1}
        for component in self.components.values():
            if component.optional:
                other.unused_roles |= {pin.role: f"without {component.ref}" for pin in component.part.pins if pin.role}
        return other

    # --- For the rules -------------------------------------------------------------------------------------------------------------------

    def pin(self, end):
        ref, number = end
        return self.components[ref].part.pin(number)

    def part(self, end):
        return self.components[end[0]].part

    def label(self, end):
        """A pin in words, such as "U2 pin 13 (OE)"."""
        pin = self.pin(end)
        if pin.kind == "gpio" and pin.name.startswith("GP"):
            return f"{end[0]} GPIO {pin.name[2:]} (pin {pin.number})"
        return f"{end[0]} pin {pin.number}" + (f" ({pin.name})" if pin.name != pin.number else "")

    def net_of(self, end):
        return next((name for name, ends in self.nets.items() if end in ends), None)

    def other_end(self, end):
        """The other pin of a part that has two."""
        ref, number = end
        return next((ref, pin.number) for pin in self.components[ref].part.pins if pin.number != number)

    def net_v(self, net, with_fuses=True):
        """A supply's voltage: that of its source, also through a fuse or a diode; 0 for ground; none for signals."""
        return self._net_v(net, {net}, with_fuses)

    def _net_v(self, net, seen, with_fuses):
        kinds = {self.pin(end).kind for end in self.nets.get(net, [])}
        if "ground" in kinds and "source" not in kinds:
            return 0.0
        for end in self.nets.get(net, []):
            if self.pin(end).kind == "source":
                return self.part(end).source_v[self.pin(end).name]
            # A diode passes a voltage from its anode to its cathode only.
            symbol = self.part(end).symbol
            if symbol == "fuse" and with_fuses or symbol == "diode" and self.pin(end).name == "K":
                other = self.net_of(self.other_end(end))
                if other and other not in seen:
                    volts = self._net_v(other, seen | {other}, with_fuses)
                    if volts:
                        return volts
        return None

    def supply_end(self, component):
        part = component.part
        names = [pin for pin in part.pins if pin.kind in ("supply", "source")]
        if part.logic_supply:
            names = [pin for pin in names if pin.name == part.logic_supply]
        return (component.ref, names[0].number) if names else None

    def logic_v(self, end):
        """The supply that a pin's levels refer to."""
        if self.part(end).logic_own_v is not None:
            return self.part(end).logic_own_v
        supply = self.supply_end(self.components[end[0]])
        if supply is None:
            return None
        if self.pin(supply).kind == "source":
            return self.part(supply).source_v[self.pin(supply).name]
        net = self.net_of(supply)
        return self.net_v(net) if net else None

    def copy(self):
        """A copy to modify."""
        other = Circuit(self.name, self.title, self.page, self.board, self.notes)
        other.components = {ref: replace(component) for ref, component in self.components.items()}
        other.nets = {name: list(ends) for name, ends in self.nets.items()}
        other.open = dict(self.open)
        other.unused_roles = dict(self.unused_roles)
        other.on_board = dict(self.on_board)
        other.led_v, other.design_ma, other.lit_by = self.led_v, self.design_ma, self.lit_by
        return other
