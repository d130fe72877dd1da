"""A circuit as a netlist for KiCad."""

# KiCad's names for the functions of pins.
TYPES = {
    "gpio": "bidirectional",
    "input": "input",
    "output": "output",
    "drain": "open_collector",
    "bus": "bidirectional",
    "supply": "power_in",
    "source": "power_out",
    "ground": "power_in",
    "passive": "passive",
    "none": "no_connect",
}


def quoted(text):
    return '"' + str(text).replace("\\", "\\\\").replace('"', '\\"') + '"'


def kicad(circuit):
    """The netlist in KiCad's S-expressions, version E, which KiCad's board editor imports."""
    lines = [
        '(export (version "E")',
        f"  (design (source {quoted(circuit.name)}) (tool {quoted('tests/tools/schematics/run')}))",
        "  (components",
    ]
    for component in circuit.components.values():
        part = component.part
        lines.append(
            f"    (comp (ref {quoted(component.ref)}) (value {quoted(component.value or part.name)})"
            f" (footprint {quoted(part.footprint)}) (description {quoted(component.remarks)})"
            f" (libsource (lib {quoted('vocc')}) (part {quoted(part.name)}) (description {quoted('')})))"
        )
    lines += ["  )", "  (libparts"]
    parts = {component.part.name: component.part for component in circuit.components.values()}
    for part in parts.values():
        lines.append(f"    (libpart (lib {quoted('vocc')}) (part {quoted(part.name)}) (description {quoted(part.source)}) (pins")
        for pin in part.pins:
            lines.append(f"      (pin (num {quoted(pin.number)}) (name {quoted(pin.name)}) (type {quoted(TYPES[pin.kind])}))")
        lines.append("    ))")
    lines += ["  )", "  (nets"]
    for code, (net, ends) in enumerate(circuit.nets.items(), 1):
        lines.append(f"    (net (code {quoted(code)}) (name {quoted(net)})")
        for end in ends:
            pin = circuit.pin(end)
            lines.append(
                f"      (node (ref {quoted(end[0])}) (pin {quoted(pin.number)}) (pinfunction {quoted(pin.name)})"
                f" (pintype {quoted(TYPES[pin.kind])}))"
            )
        lines.append("    )")
    lines += ["  )", ")", ""]
    return "\n".join(lines)
