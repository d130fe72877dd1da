"""The rules for circuits. Each yields sentences that name the part, the pin and the fault."""

import re
from dataclasses import dataclass

from circuit import Fixed

# Outputs that drive both levels.
DRIVERS = ("output", "source")
# The firmware's outputs; its other lines are inputs or I2C.
FIRMWARE_OUTPUTS = ("data", "clock", "latch", "lit", "full_current", "transmit", "lamp")
# The line of the firmware that leads to a pin, and whether it arrives inverted.
LEADS = {"enable": ("lit", True)}
# The pins whose role is the part's own.
LOCAL_ROLES = ("column", "carry", "clear", "current", "reset", "address")
# The tolerance of a resistor, and the allowed deviation of an LED's current from the design.
TOLERANCE = 0.05
DESIGN_SPREAD = 0.1
# The longest period of the dimming, 20 kHz, and the allowed drop of the LEDs' supply in half of it.
DIMMING_S = 50e-6
DIP_V = 0.25
FACTORS = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "": 1.0}


def quantity(text):
    """The number of a value such as "4.7 kΩ" or "100 nF"."""
    match = re.match(r"([\d.]+) ([pnµmkM]?)[ΩFAV]", text)
    if not match:
        raise ValueError(f"{text!r} is not a value such as 4.7 kΩ or 100 nF")
    return float(match[1]) * FACTORS[match[2]]


def check(circuit, roles, pulled):
    """All faults. `roles` are the firmware's pins, `pulled` those that it pulls up."""
    found = list(connections(circuit, roles, pulled))
    # The other rules need pins and nets that exist, and a missing wire would break several of them.
    if not any("there is no" in problem or "has no pin" in problem for problem in found):
        found += [problem for rule in RULES for problem in rule(circuit, roles, pulled)]
    return found


def ends_of(circuit, *kinds):
    for component in circuit.components.values():
        for pin in component.part.pins:
            if pin.kind in kinds:
                yield (component.ref, pin.number)


def firmware_kind(circuit, end, roles):
    """Whether the firmware makes a GPIO an output, an input or a line of I2C, or does not use it."""
    name = circuit.pin(end).name
    role = next((role for role, pin in roles.items() if pin == name), None)
    if role is None:
        return None
    if role in ("scl", "sda"):
        return "bus"
    return "output" if role in FIRMWARE_OUTPUTS else "input"


def kind_of(circuit, end, roles):
    kind = circuit.pin(end).kind
    return firmware_kind(circuit, end, roles) if kind == "gpio" else kind


# --- Nets ------------------------------------------------------------------------------------------------------------------------------


def connections(circuit, _roles, _pulled):
    """Each pin is on one net, or open for a reason; each net has two pins or more."""
    nets_of = {}
    for net, ends in circuit.nets.items():
        for ref, number in ends:
            component = circuit.components.get(ref)
            if component is None:
                yield f"net {net}: there is no {ref}"
                continue
            if not any(pin.number == number for pin in component.part.pins):
                yield f"net {net}: {ref} ({component.part.name}) has no pin {number}"
                continue
            nets_of.setdefault((ref, number), []).append(net)
        if len(ends) == 1:
            yield f"net {net} has one pin only, {circuit.label(ends[0])}"
    for component in circuit.components.values():
        for pin in component.part.pins:
            end = (component.ref, pin.number)
            nets = nets_of.get(end, [])
            if len(nets) > 1:
                yield f"{circuit.label(end)} is on {len(nets)} nets: {', '.join(nets)}"
            if nets and end in circuit.open:
                yield f"{circuit.label(end)} is to stay open, and is on net {nets[0]}"
            if nets and pin.kind == "none":
                yield f"{circuit.label(end)} has no connection inside, and is on net {nets[0]}"
            must = pin.kind != "none" and (not component.part.may_be_open or pin.kind == "supply" and component is not board_of(circuit))
            if must and not nets and end not in circuit.open:
                yield f"{circuit.label(end)} of {component.part.name} is connected to nothing"


def drivers(circuit, roles, _pulled):
    """No two outputs drive a net against each other."""
    for net, ends in circuit.nets.items():
        kinds = {end: kind_of(circuit, end, roles) for end in ends}
        drive = [end for end, kind in kinds.items() if kind in DRIVERS]
        grounds = [end for end, kind in kinds.items() if kind == "ground"]
        if drive and grounds:
            yield f"net {net}: {circuit.label(drive[0])} drives ground, {circuit.label(grounds[0])}"
        if len(drive) > 1:
            yield f"net {net}: output against output, {' and '.join(circuit.label(end) for end in drive)}"
        drains = [end for end, kind in kinds.items() if kind in ("drain", "bus")]
        if drive and drains and any(kinds[end] == "output" for end in drive):
            yield f"net {net}: {circuit.label(drive[0])} drives against {circuit.label(drains[0])}"


def passives(circuit, net, symbols=("resistor",)):
    """The parts with two pins at a net: part, its pin here, and the net at its other pin."""
    for end in circuit.nets.get(net, []):
        component = circuit.components[end[0]]
        if component.part.symbol in symbols:
            yield component, end, circuit.net_of(circuit.other_end(end))


def floating(circuit, roles, pulled):
    """Each input is driven, or held by a resistor to a supply or to ground."""
    for component in circuit.components.values():
        for pin in component.part.pins:
            end = (component.ref, pin.number)
            if kind_of(circuit, end, roles) != "input":
                continue
            net = circuit.net_of(end)
            if net is None:
                # A GPIO may be held by its own pull, or on its board.
                on_board = {roles[role] for role in circuit.on_board}
                if pin.name not in pulled | on_board:
                    yield f"{circuit.label(end)} is an input that floats: nothing is connected, and the firmware does not pull it"
                continue
            others = [other for other in circuit.nets[net] if other != end]
            kinds = {kind_of(circuit, other, roles) for other in others}
            held = any(circuit.net_v(far) is not None for _, _, far in passives(circuit, net) if far)
            if not kinds & {"output", "source", "bus"} and circuit.net_v(net) is None and not held:
                yield f"{circuit.label(end)} is an input that floats: net {net} has no output, and no resistor to a supply"


def supplies(circuit, _roles, _pulled):
    """Each supply pin has an allowed voltage, and each ground pin is at ground. No source is overloaded."""
    for end in ends_of(circuit, "supply"):
        net = circuit.net_of(end)
        part = circuit.part(end)
        if net is None:
            continue
        volts = circuit.net_v(net)
        if not volts:
            yield f"{circuit.label(end)} of {part.name} is on net {net}, which no supply feeds"
        elif not part.supply_v[0] <= volts <= part.supply_v[1]:
            yield f"{circuit.label(end)} of {part.name} takes {part.supply_v[0]} to {part.supply_v[1]} V, and net {net} has {volts} V"
    for end in ends_of(circuit, "ground"):
        net = circuit.net_of(end)
        if net is not None and circuit.net_v(net) != 0.0:
            yield f"{circuit.label(end)} of {circuit.part(end).name} is a ground pin on net {net}, which is not ground"
    grounds = {circuit.net_of(end) for end in ends_of(circuit, "ground")} - {None}
    if len(grounds) > 1:
        yield f"{len(grounds)} grounds are not connected: {', '.join(sorted(grounds))}"
    for component in circuit.components.values():
        if component.part.may_be_open and not any(
            circuit.net_of((component.ref, pin.number)) for pin in component.part.pins if pin.kind == "ground"
        ):
            yield f"{component.ref} ({component.part.name}) has no ground"
    for end in ends_of(circuit, "source"):
        net = circuit.net_of(end)
        if net is None:
            continue
        limit = circuit.part(end).source_ma[circuit.pin(end).name]
        taken = load_ma(circuit, net)
        if taken > limit:
            yield f"{circuit.label(end)} feeds {limit} mA at most, and net {net} takes {taken:.0f} mA"


def leds_ma(circuit, net):
    """The LEDs' current from a supply, at full current."""
    return sum(led_ma(circuit, led) or circuit.design_ma for led in leds(circuit) if net and feed_of(circuit, led) == net)


def load_ma(circuit, net, seen=()):
    """The current of the parts on a supply, with the LEDs at full current, also behind a fuse, a diode or a board."""
    total = leds_ma(circuit, net)
    for end in circuit.nets.get(net, []):
        component = circuit.components[end[0]]
        if circuit.pin(end).name in component.part.powered_by or circuit.pin(end).kind == "supply":
            total += component.part.supply_ma
            if end[0] not in seen:
                # A linear regulator's input current equals its output current; a switching one's is lower.
                made = (circuit.net_of(component[name]) for name in component.part.makes)
                total += sum(load_ma(circuit, other, (*seen, end[0])) for other in made)
        passes = component.part.symbol == "fuse" or component.part.symbol == "diode" and circuit.pin(end).name == "A"
        if passes and end[0] not in seen:
            total += load_ma(circuit, circuit.net_of(circuit.other_end(end)), (*seen, end[0]))
    return total


def polarity(circuit, _roles, _pulled):
    """The first pin of an electrolytic capacitor has the higher voltage."""
    for component in circuit.components.values():
        if component.part.is_polarised:
            first, second = (circuit.net_v(circuit.net_of((component.ref, number))) for number in ("1", "2"))
            if first is None or second is None or first <= second:
                yield f"{component.ref} ({component.part.name}): pin 1 is to have the higher voltage, and has {first} V, pin 2 {second} V"


def reservoir(circuit, _roles, _pulled):
    """All LEDs switch at once: an electrolytic capacitor keeps their supply for half of a period, because wires are too slow."""
    for net in {feed_of(circuit, led) for led in leds(circuit)} - {None}:
        dips = [
            leds_ma(circuit, net) * 1e-3 * (component.part.series_ohm + DIMMING_S / 2 / quantity(component.value))
            for component, _, _ in passives(circuit, net, ("capacitor",))
            if component.part.is_polarised
        ]
        if not dips:
            yield f"net {net}, which feeds LEDs, has no electrolytic capacitor"
        elif min(dips) > DIP_V:
            yield f"net {net}, which feeds LEDs, dips by {min(dips):.2f} V, more than {DIP_V} V, whenever they are lit"


def fuses(circuit, _roles, _pulled):
    """All LEDs are fed through a fuse, which carries their current, and opens before its source limits the current."""
    fed = {}
    for led in leds(circuit):
        fed.setdefault(feed_of(circuit, led), []).append(led.ref)
    for net, refs in fed.items():
        if net and circuit.net_v(net, with_fuses=False):
            yield f"net {net}, which is before the fuse, feeds {len(refs)} LEDs, such as {refs[0]}"
    for component in circuit.components.values():
        if component.part.symbol != "fuse":
            continue
        taken = given = 0.0
        for pin in component.part.pins:
            net = circuit.net_of((component.ref, pin.number))
            if not circuit.net_v(net, with_fuses=False):
                taken = load_ma(circuit, net, (component.ref,))
            given += sum(circuit.part(end).source_ma.get(circuit.pin(end).name, 0) for end in circuit.nets.get(net, []))
        if not 0 < taken < 1e3 * quantity(component.value) <= given:
            yield f"{component.ref}, {component.value}, does not suit LEDs that take {taken:.0f} mA, and a source that gives {given:.0f} mA"


def decoupling(circuit, _roles, _pulled):
    """Each chip has its capacitor, from its supply to its ground."""
    for component in circuit.components.values():
        needed = component.part.decoupling
        if not needed:
            continue
        supply = circuit.net_of(circuit.supply_end(component))
        has = False
        for other in circuit.components.values():
            if other.part.symbol != "capacitor" or other.beside != component.ref:
                continue
            nets = {circuit.net_of((other.ref, pin.number)) for pin in other.part.pins}
            has |= supply in nets and any(net and circuit.net_v(net) == 0.0 for net in nets) and quantity(other.value) >= quantity(needed)
        if not has:
            yield f"{component.ref} ({component.part.name}) has no {needed} beside it, from net {supply} to ground"


# --- Levels ----------------------------------------------------------------------------------------------------------------------------


def level(circuit, end, what):
    """One of a part's voltages. None if it has none, or depends on a supply that is not connected."""
    bound = getattr(circuit.part(end), what)
    if bound is None or isinstance(bound, Fixed):
        return bound and bound.fixed_v
    volts = circuit.logic_v(end)
    return None if volts is None else bound.volts(volts)


def levels(circuit, roles, _pulled):
    """Each output reaches the low and the high level of each input on its net."""
    for net, ends in circuit.nets.items():
        kinds = {end: kind_of(circuit, end, roles) for end in ends}
        for driver in (end for end, kind in kinds.items() if kind == "output"):
            for receiver in (end for end, kind in kinds.items() if kind == "input"):
                high, needed = level(circuit, driver, "output_high"), level(circuit, receiver, "input_high")
                if high is not None and needed is not None and high < needed:
                    yield (
                        f"net {net}: {circuit.label(receiver)} of {circuit.part(receiver).name} takes {needed:.2f} V for high, "
                        f"and {circuit.label(driver)} gives {high:.2f} V"
                    )
                low, most = level(circuit, driver, "output_low"), level(circuit, receiver, "input_low")
                if low is not None and most is not None and low > most:
                    yield (
                        f"net {net}: {circuit.label(receiver)} of {circuit.part(receiver).name} takes {most:.2f} V for low, "
                        f"and {circuit.label(driver)} gives {low:.2f} V"
                    )
        # A line of I2C is as high as its pull-ups.
        for receiver in (end for end, kind in kinds.items() if kind == "bus"):
            high, needed = pull_up_v(circuit, net), level(circuit, receiver, "input_high")
            if high and needed and high < needed:
                yield f"net {net}: {circuit.label(receiver)} takes {needed:.2f} V for high, and its pull-ups give {high:.2f} V"


def fixed_levels(circuit, _roles, _pulled):
    """Pins at a supply or at ground let the part work: clear, reset, the address, and the enables of outputs that are used."""
    for component in circuit.components.values():
        for pin in component.part.pins:
            end = (component.ref, pin.number)
            net = circuit.net_of(end)
            if pin.role == "clear" and net and circuit.net_v(net) != circuit.logic_v(end):
                yield f"{circuit.label(end)} is on net {net}, not at its supply: the register may stay empty"
            if pin.role == "address" and net and circuit.net_v(net) != 0.0:
                yield f"{circuit.label(end)} is on net {net}, not at ground: the firmware does not find {component.part.name}"
            if pin.role == "reset" and net and circuit.net_v(net) == 0.0:
                yield f"{circuit.label(end)} is at ground: {component.part.name} does not start"
        for _, enable, output, _ in component.part.gates:
            net = enable and circuit.net_of(component[enable])
            if net and circuit.net_of(component[output]) and circuit.net_v(net):
                yield f"{circuit.label(component[enable])} is on net {net}, {circuit.net_v(net)} V: {output} drives nothing"


def leakage(circuit, _roles, _pulled):
    """The leakage of a GPIO that no program drives does not lift a line that a resistor pulls down."""
    for net, ends in circuit.nets.items():
        leak_ma = max((circuit.part(end).gpio_leak_ma for end in ends if circuit.pin(end).kind == "gpio"), default=0)
        inputs = [end for end in ends if circuit.pin(end).kind == "input"]
        for resistor, _, far in passives(circuit, net):
            if not leak_ma or not far or circuit.net_v(far) != 0.0:
                continue
            volts = leak_ma * 1e-3 * quantity(resistor.value)
            for end in inputs:
                most = level(circuit, end, "input_low")
                if most is not None and volts > most:
                    yield (
                        f"net {net}: the board's pin leaks {leak_ma} mA, which lifts {circuit.label(end)} to {volts:.2f} V "
                        f"at {resistor.ref}, {resistor.value}: low is {most:.2f} V at most"
                    )


def pull_up_v(circuit, net):
    """The highest voltage that pulls a line up."""
    found = [circuit.net_v(far) for _, _, far in passives(circuit, net) if far and circuit.net_v(far)]
    found += [circuit.logic_v(end) for end in circuit.nets[net] if circuit.part(end).has_pull_ups and circuit.pin(end).kind == "bus"]
    return max(found, default=None)


def pull_ups(circuit, roles, _pulled):
    """Each line of I2C has a pull-up."""
    for net, ends in circuit.nets.items():
        if any(kind_of(circuit, end, roles) == "bus" for end in ends) and pull_up_v(circuit, net) is None:
            yield f"net {net}: a line of I2C without a pull-up"


def voltages(circuit, roles, _pulled):
    """No pin exceeds its maximum voltage, from outputs, or from supplies through resistors and LEDs."""
    for net in circuit.nets:
        volts, why = highest_v(circuit, net, roles)
        for end in circuit.nets[net]:
            pin, part = circuit.pin(end), circuit.part(end)
            most = level(circuit, end, "drain_most" if pin.kind == "drain" else "most")
            if most is None or pin.kind in ("supply", "source", "ground", "passive"):
                continue
            if volts > most + 1e-9:
                yield f"net {net}: {circuit.label(end)} of {part.name} bears {most:.1f} V, and gets {volts:.1f} V from {why}"


def highest_v(circuit, net, roles, seen=frozenset()):
    """The highest voltage of a net, and its cause."""
    found = [(0.0, "nothing")]
    if (volts := circuit.net_v(net)) is not None:
        return volts, f"net {net}"
    for end in circuit.nets[net]:
        kind = kind_of(circuit, end, roles)
        if kind == "output" or kind == "bus" and circuit.part(end).has_pull_ups:
            if volts := circuit.logic_v(end):
                found.append((volts, circuit.label(end)))
    for component, _, far in passives(circuit, net, ("resistor", "led", "diode")):
        if far and component.ref not in seen:
            found.append(highest_v(circuit, far, roles, seen | {component.ref}))
    return max(found)


# --- The LEDs --------------------------------------------------------------------------------------------------------------------------


def series(circuit, net, wanted, seen=()):
    """The parts on the path from a net through resistors to the requested part."""
    for component, end, far in passives(circuit, net, ("resistor", "led")):
        if component.ref in seen:
            continue
        if wanted(component):
            return [component]
        if component.part.symbol == "resistor" and far:
            further = series(circuit, far, wanted, (*seen, component.ref))
            if further:
                return [component, *further]
    return []


def registers(circuit):
    return [component for component in circuit.components.values() if any(pin.role == "carry" for pin in component.part.pins)]


def leds(circuit):
    return [component for component in circuit.components.values() if component.part.symbol == "led"]


def output_of(circuit, led):
    """The output that an LED leads to, and the resistance in series."""
    for pin in led.part.pins:
        ohms, net, previous = 0.0, circuit.net_of((led.ref, pin.number)), led.ref
        while net:
            ends = [end for end in circuit.nets[net] if end[0] != previous]
            net = None
            for end in ends:
                component = circuit.components[end[0]]
                if circuit.pin(end).role == "column":
                    return end, ohms
                if component.part.symbol == "resistor":
                    ohms += quantity(component.value)
                    net, previous = circuit.net_of(circuit.other_end(end)), component.ref
    return None, 0.0


def feed_of(circuit, led):
    """The supply of an LED's current: the one at its anode, or that of the output which feeds it."""
    anode = circuit.net_of(led["A"])
    if anode and circuit.net_v(anode):
        return anode
    output, _ = output_of(circuit, led)
    feeds = output and circuit.pin(output).kind == "output"
    return circuit.net_of(circuit.supply_end(circuit.components[output[0]])) if feeds else None


def led_ma(circuit, led):
    """The current of a lit LED, by the resistor in series or by its current sink. None if it is unknown."""
    output, ohms = output_of(circuit, led)
    return output_ma(circuit, led, output, ohms) if output else None


def output_ma(circuit, led, end, ohms):
    """The current of an LED at an output, through resistors in series."""
    register = circuit.components[end[0]]
    if register.part.sink_volts:
        return register.part.sink_volts * sum(1.0 / quantity(resistor.value) for resistor in current_resistors(circuit, register)) * 1e3
    if not ohms:
        return None
    nets = [circuit.net_of((led.ref, pin.number)) for pin in led.part.pins]
    supply = next((circuit.net_v(net) for net in nets if net and circuit.net_v(net)), None) or circuit.logic_v(end)
    return (supply - circuit.led_v - register.part.output_drop_v) / ohms * 1e3


def current_resistors(circuit, register):
    """The resistors at a current sink's pin: to ground, or to a transistor that switches one on."""
    pin = next(pin for pin in register.part.pins if pin.role == "current")
    for component, _, far in passives(circuit, circuit.net_of((register.ref, pin.number))):
        if far and (circuit.net_v(far) == 0.0 or any(circuit.pin(end).kind == "drain" for end in circuit.nets[far])):
            yield component


def direction(circuit, end, led):
    """An LED is lit by the bit that the firmware is built for: its anode is at a supply, or its cathode at ground."""
    rails = {pin.name: circuit.net_v(circuit.net_of((led.ref, pin.number))) for pin in led.part.pins}
    is_sink = circuit.pin(end).kind == "drain"
    lit_by_low = is_sink or circuit.lit_by == 0
    if lit_by_low and not rails["A"]:
        yield f"{led.ref} is never lit: {circuit.label(end)} sinks its current, and its anode is at no supply"
    if not lit_by_low and rails["K"] != 0.0:
        yield f"{led.ref} is never lit: {circuit.label(end)} feeds it, and its cathode is not at ground"


def low_ma(circuit, register):
    """A current sink's current while its switch is off."""
    if not register.part.sink_volts:
        return None
    total = 0.0
    for resistor in current_resistors(circuit, register):
        if any(circuit.net_v(circuit.net_of((resistor.ref, pin.number))) == 0.0 for pin in resistor.part.pins):
            total += register.part.sink_volts / quantity(resistor.value) * 1e3
    return total


def currents(circuit, _roles, _pulled):
    """No output's current is out of its range, each LED has that of the design, and all registers have the same."""
    by_sink = {}
    for register in registers(circuit):
        least, most = register.part.output_ma
        total = 0.0
        low = low_ma(circuit, register)
        for pin in (pin for pin in register.part.pins if pin.role == "column"):
            net = circuit.net_of((register.ref, pin.number))
            way = series(circuit, net, lambda component: component.part.symbol == "led") if net else []
            if not way:
                yield f"{circuit.label((register.ref, pin.number))} leads to no LED"
                continue
            yield from direction(circuit, (register.ref, pin.number), way[-1])
            milliamperes = led_ma(circuit, way[-1])
            if milliamperes is None:
                # A current sink whose curve is not known here limits it, too.
                if not any(other.role == "current" for other in register.part.pins):
                    yield f"{way[-1].ref} has no resistor in series, and {register.part.name} does not limit its current"
                continue
            total += milliamperes
            if abs(milliamperes / circuit.design_ma - 1.0) > DESIGN_SPREAD:
                yield f"{way[-1].ref} has {milliamperes:.1f} mA, and is made for {circuit.design_ma:.1f} mA"
            for each in {milliamperes, milliamperes if low is None else low}:
                if each / (1.0 + TOLERANCE) < least or each / (1.0 - TOLERANCE) > most:
                    name = circuit.label((register.ref, pin.number))
                    yield f"{name} has {each:.1f} mA, not {least} to {most} mA with resistors of ±{100 * TOLERANCE:.0f} %"
            if low is not None:
                by_sink[register.ref] = (f"{low:.2f}", f"{milliamperes:.2f}")
        if register.part.all_outputs_ma and total > register.part.all_outputs_ma:
            yield f"{register.ref} ({register.part.name}) has {total:.0f} mA, and may have {register.part.all_outputs_ma} mA"
    first, *others = by_sink or [None]
    for ref in others:
        if by_sink[ref] != by_sink[first]:
            yield f"{ref} has {' and '.join(by_sink[ref])} mA, low and full, and {first} {' and '.join(by_sink[first])} mA"
    for net, ends in circuit.nets.items():
        pins = [end for end in ends if circuit.pin(end).role == "current"]
        if len(pins) > 1:
            yield f"net {net}: {' and '.join(circuit.label(end) for end in pins)} share their resistor"


def source_of(circuit, net):
    """Follows a net back through buffers and inverters: the outputs that drive it, and whether it is inverted."""
    inverted = False
    seen = set()
    while net and net not in seen:
        seen.add(net)
        for end in circuit.nets[net]:
            gate = next((gate for gate in circuit.part(end).gates if gate[2] == circuit.pin(end).name), None)
            if gate:
                inverted ^= gate[3]
                net = circuit.net_of(circuit.components[end[0]][gate[0]])
                break
    return net, inverted


def chain(circuit, _roles, _pulled):
    """The registers are chained by rows, and LED 8·row + column, counted from D1, is at output `column` of register `row`."""
    rows = registers(circuit)
    for row, register in enumerate(rows):
        data = next(pin for pin in register.part.pins if pin.role == "data")
        net = circuit.net_of((register.ref, data.number))
        if row > 0:
            before = rows[row - 1]
            carry = next(pin for pin in before.part.pins if pin.role == "carry")
            if net is None or (before.ref, carry.number) not in circuit.nets[net]:
                yield f"{circuit.label((register.ref, data.number))}, row {row}, is not at {circuit.label((before.ref, carry.number))}"
        for column in range(8):
            end = register[f"Q{column}"]
            way = series(circuit, circuit.net_of(end), lambda component: component.part.symbol == "led")
            expected = f"D{8 * row + column + 1}"
            if way and way[-1].ref != expected:
                yield f"{circuit.label(end)}, row {row} and column {column}, lights {way[-1].ref} instead of {expected}"


def board_of(circuit):
    """The board with the microcontroller: it has GPIO."""
    return next(component for component in circuit.components.values() if any(pin.kind == "gpio" for pin in component.part.pins))


def firmware(circuit, roles, _pulled):
    """Each line of the firmware leads to the pins of its role, and no other."""
    reached = set()
    board = board_of(circuit)
    carries = {circuit.net_of(register[pin.name]) for register in registers(circuit) for pin in register.part.pins if pin.role == "carry"}
    for component in circuit.components.values():
        for pin in component.part.pins:
            if not pin.role or pin.role in LOCAL_ROLES:
                continue
            end = (component.ref, pin.number)
            role, should_invert = LEADS.get(pin.role, (pin.role, False))
            net = circuit.net_of(end)
            if net is None or net in carries and pin.role == "data":
                continue
            net, inverted = source_of(circuit, net)
            gpio = next((other for other in circuit.nets.get(net, []) if other[0] == board.ref and circuit.pin(other).kind == "gpio"), None)
            if gpio is None:
                yield f"{circuit.label(end)} of {component.part.name} ({role}) leads to no pin of the board"
                continue
            if circuit.pin(gpio).name != roles.get(role):
                there = circuit.label(board[roles[role]]) if role in roles else "no pin"
                yield (
                    f"{circuit.label(end)} of {component.part.name} ({role}) leads to {circuit.label(gpio)}, "
                    f"and the firmware in {circuit.board} has {role} on {there}"
                )
            if inverted != should_invert:
                yield f"{circuit.label(end)} of {component.part.name} ({role}) is {'' if inverted else 'not '}inverted on its way"
            reached.add(role)
    for role in roles:
        if role not in reached | set(circuit.unused_roles) | set(circuit.on_board):
            yield f"the firmware in {circuit.board} has {role} on {circuit.label(board[roles[role]])}, which leads nowhere"
        if role in reached and role in circuit.unused_roles:
            yield f"{role} is to lead nowhere ({circuit.unused_roles[role]}), and is connected"
    for pin in board.part.pins:
        end = (board.ref, pin.number)
        if pin.kind == "gpio" and circuit.net_of(end) and pin.name not in roles.values():
            yield f"{circuit.label(end)} is connected to net {circuit.net_of(end)}, and the firmware in {circuit.board} does not use it"


# --- Dark without a program ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class State:
    """A state in which no program lights the LEDs."""

    name: str
    # What the board's pin does.
    does: str
    # Whether the board has power, and the other supplies have voltage.
    board_on: bool = True
    others_on: bool = True
    # Whether the board's pin is connected.
    wired: bool = True


DARK_STATES = (
    State("board without power", "held low by its protection diodes, weakly", board_on=False),
    State("reset or boot loader", "input"),
    State("start or panic", "low"),
    State("wire from the board broken", "nothing", wired=False),
    State("registers' supply off, board on USB", "anything", others_on=False),
)


def enable_pins(circuit):
    return [(c.ref, pin.number) for c in circuit.components.values() for pin in c.part.pins if pin.role == "enable"]


def dark_states(circuit, roles):
    """For each state and output enable: the state, the register, whether its LEDs are dark, and what makes it so."""
    board = board_of(circuit)
    for state in DARK_STATES:
        for end in enable_pins(circuit):
            is_dark, why = without_supply(circuit, circuit.components[end[0]], board, roles, state)
            if is_dark is None:
                is_dark, why = logic(circuit, circuit.net_of(end), board, roles, state)
                if is_dark is not True:
                    level = "low" if is_dark is False else "neither low nor high"
                    why = f"output enable, {circuit.label(end)}, is {level}: {why}"
            yield state.name, end[0], is_dark is True, why


def without_supply(circuit, register, board, roles, state):
    """Whether a register's LEDs are dark because they or the register have no supply, and why. None if both have one."""
    column = next(pin for pin in register.part.pins if pin.role == "column")
    led = series(circuit, circuit.net_of((register.ref, column.number)), lambda component: component.part.symbol == "led")
    supplies = [("the register has", circuit.net_of(circuit.supply_end(register)))]
    if led:
        supplies.insert(0, ("the LEDs have", feed_of(circuit, led[-1])))
    for whose, net in supplies:
        if net is None or is_fed(circuit, net, board, state):
            continue
        if by := diode_to(circuit, net, board, roles, state):
            return False, f"net {net} has no supply, and a diode of {by} feeds it"
        return True, f"{whose} no supply"
    return None, ""


def diode_to(circuit, net, board, roles, state):
    """The pin that feeds a supply which is off: it has a diode to that supply, and the board or an LED drives it."""
    rails = joined(circuit, net)
    for component in circuit.components.values():
        supply = circuit.supply_end(component)
        if component is board or supply is None or circuit.pin(supply).kind != "supply" or circuit.net_of(supply) not in rails:
            continue
        for pin in component.part.pins:
            # A pin that bears the same voltage at any supply has no diode to it.
            bears = component.part.drain_most if pin.kind == "drain" else component.part.most
            line = circuit.net_of((component.ref, pin.number))
            if line is None or isinstance(bears, Fixed) or pin.kind not in ("input", "output", "drain"):
                continue
            label = circuit.label((component.ref, pin.number))
            if pin.kind == "input" and state.board_on:
                if any(end[0] == board.ref and kind_of(circuit, end, roles) == "output" for end in circuit.nets[line]):
                    return f"{label}, which the board drives,"
            if pin.role == "column":
                led = series(circuit, line, lambda part: part.part.symbol == "led")
                anode = led and circuit.net_of(led[-1]["A"])
                if anode and is_fed(circuit, anode, board, state):
                    return f"{label}, at {led[-1].ref},"
    return None


def joined(circuit, net):
    """A net, and those behind its fuses."""
    return {net} | {circuit.net_of(circuit.other_end(end)) for end in circuit.nets.get(net, []) if circuit.part(end).symbol == "fuse"}


def is_fed(circuit, net, board, state):
    """Whether a supply has voltage in a state, also through a fuse."""
    for each in joined(circuit, net):
        sources = [end for end in circuit.nets.get(each, []) if circuit.pin(end).kind == "source"]
        # VBUS is USB's.
        if any(state.board_on if end[0] == board.ref else state.others_on for end in sources):
            return True
    return False


def logic(circuit, net, board, roles, state):
    """Whether a net is high, low or neither (None), and the parts that make it so."""
    volts = circuit.net_v(net)
    if volts is not None:
        fed = volts > 0 and is_fed(circuit, net, board, state)
        return fed, f"net {net}"
    for end in circuit.nets[net]:
        component = circuit.components[end[0]]
        gate = next((gate for gate in component.part.gates if gate[2] == circuit.pin(end).name), None)
        if not gate:
            continue
        if not is_fed(circuit, circuit.net_of(circuit.supply_end(component)), board, state):
            return None, f"{component.ref} has no supply"
        if gate[1]:
            enable, why = logic(circuit, circuit.net_of(component[gate[1]]), board, roles, state)
            if enable is not False:
                return None, f"{component.ref} is not enabled: {why}"
        value, why = logic(circuit, circuit.net_of(component[gate[0]]), board, roles, state)
        if value is None:
            return None, why
        return value != gate[3], f"{component.ref} ({component.part.name}), with {why}"
    at_board = [end for end in circuit.nets[net] if end[0] == board.ref]
    if at_board and state.does == "low":
        return False, "the program"
    held = [(component, circuit.net_v(far)) for component, _, far in passives(circuit, net) if far and circuit.net_v(far) is not None]
    directions = {volts > 0 for _, volts in held}
    if len(directions) == 1:
        return directions.pop(), f"{held[0][0].ref} ({held[0][0].value})"
    # A pin that leaks may overcome its own pull-down.
    if at_board and state.wired and state.board_on and board.part.pulls_down_in_reset and not board.part.gpio_leak_ma:
        return False, f"the pull-down in {board.ref}"
    return None, f"nothing holds net {net}"


def dark(circuit, roles, _pulled):
    """In each state in which no program lights the LEDs they are dark, and the current is the low one."""
    for name, register, is_dark, why in dark_states(circuit, roles):
        if not is_dark:
            yield f"{name}: the LEDs of {register} may shine: {why}"
    board = board_of(circuit)
    # With the LEDs' supply off, their current does not matter.
    for state in (state for state in DARK_STATES if state.others_on):
        for end in ends_of(circuit, "input"):
            if circuit.pin(end).role != "full_current" or not circuit.net_of(end):
                continue
            high, why = logic(circuit, circuit.net_of(end), board, roles, state)
            if high is not False:
                yield f"{state.name}: the current switch, {circuit.label(end)}, is {'high' if high else 'neither low nor high'}: {why}"


RULES = (
    drivers, floating, supplies, decoupling, polarity, reservoir, fuses, levels, fixed_levels, leakage, voltages, pull_ups, currents, chain,
    firmware, dark,
)  # fmt: skip
