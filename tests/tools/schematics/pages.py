"""Pictures and tables of the circuits in docs/hardware, and the comparison of the pages with parts and firmware."""

import csv
import io
import re

from parts import PICO, REGISTER_HC, REGISTER_STP, REGISTER_TLC, REGISTER_TPIC
from rules import quantity

FOLDER = "docs/hardware"
ROAD = "docs/hardware/road-kit.md"
SAFETY = "docs/hardware/light-safety.md"
PORTING = "docs/porting.md"
CALIBRATION = "tx-firmware/src/calibration.rs"
# The emulator's stage before output enable.
EMULATOR = "tests/boards/emulator/output_enable.mjs"
# The pages that name pins of the Pico.
PICO_PAGES = ("docs/hardware.md", "docs/hardware/desk-kit.md", "docs/hardware/receiver.md", ROAD, "docs/hardware/bring-up.md")
# A row of the pages' tables of pins, by words in it, and the firmware's lines in the row's order.
ROAD_ROWS = {
    "UART 0 TX, RX": ("transmit", "receive"),
    "I2C 0 SDA, SCL": ("sda", "scl"),
    "the symbol clock": ("latch",),
    "SPI 0 SCK, TX": ("clock", "data"),
    "the dimming": ("lit",),
    "current switch": ("full_current",),
}
NUCLEO_ROWS = {
    "shift clock": ("clock", "data"),
    "latch": ("latch",),
    "inverting gate": ("lit",),
    "current switch": ("full_current",),
    "SCL, SDA": ("scl", "sda"),
    "ST-LINK": ("transmit", "receive"),
}
# A row of the table of the registers' pins, and the pins that it lists.
REGISTER_ROWS = {
    "serial in": "data",
    "shift clock": "clock",
    "latch": "latch",
    "output enable": "enable",
    "serial out": "carry",
    "columns 0 to 7": "column",
    "clear": "clear",
    "current resistor": "current",
}
REGISTERS = {part.name: part for part in (REGISTER_HC, REGISTER_TPIC, REGISTER_TLC, REGISTER_STP)}


# --- Tables ----------------------------------------------------------------------------------------------------------------------------


def number_of(ref):
    return re.match(r"([A-Z]+)(\d+)", ref).groups()


def runs(numbered):
    """Pairs of letters and number, such as (R, 1), (R, 2), (R, 3), (R, 5), as "R1 to R3, R5"."""
    found = []
    for letters, number in numbered:
        if found and found[-1][0] == letters and found[-1][2] == int(number) - 1:
            found[-1][2] = int(number)
        else:
            found.append([letters, int(number), int(number)])
    between = {0: None, 1: ", "}
    shown = []
    for letters, first, last in found:
        joint = between.get(last - first, " to ")
        shown.append(f"{letters}{first}" + (f"{joint}{letters}{last}" if joint else ""))
    return ", ".join(shown)


def in_number(ref):
    letters, number = number_of(ref)
    return letters, int(number)


def compress(refs):
    """R1, R2, R3, R5 as "R1 to R3, R5"."""
    return runs(sorted(map(in_number, refs)))


def lines_of_parts(circuit):
    """Part, value and remarks, with the designators of equal parts."""
    found = {}
    for component in circuit.components.values():
        found.setdefault((component.part.name, component.value, component.remarks), []).append(component.ref)
    return found


def parts_table(circuits):
    """The parts of one circuit, or of several side by side."""
    names = [circuit.title.rsplit(" ", 1)[-1] for circuit in circuits] if len(circuits) > 1 else ["reference"]
    keys = list(dict.fromkeys(key for circuit in circuits for key in lines_of_parts(circuit)))
    # Chips first, then boards' companions, then the small parts, each in the order of the designators.
    order = "UQDJFRC"
    first = {}
    for circuit in circuits:
        for key, refs in lines_of_parts(circuit).items():
            letters, number = number_of(refs[0])
            first.setdefault(key, (order.index(letters), int(number)))
    rows = [f"| part | {' | '.join(names)} | remarks |", f"|---|{'---|' * len(names)}---|"]
    for key in sorted(keys, key=first.get):
        part, value, remarks = key
        cells = [compress(lines_of_parts(circuit).get(key, [])) for circuit in circuits]
        rows.append(f"| {part}{', ' + value if value else ''} | {' | '.join(cells)} | {remarks} |")
    return rows


def wires_table(circuit):
    """Each net, and the pins on it. Nets of several parts that differ in their number only are one row."""
    families = {}
    for net in circuit.nets:
        families.setdefault(re.sub(r"(?<=[A-Z])\d+$", "", net), []).append(net)
    rows = ["| net | pins |", "|---|---|"]
    for nets in families.values():
        folded = pins_in_order(circuit, nets) if len(nets) > 1 else None
        if folded:
            rows.append(f"| {nets[0]} to {nets[-1]} | {', '.join(folded)} |")
        else:
            rows += [f"| {net} | {', '.join(pins_of(circuit, circuit.nets[net]))} |" for net in nets]
    return rows


def pin_name(circuit, end):
    """The name of a pin in a table; none if the part may be turned round."""
    pin, part = circuit.pin(end), circuit.part(end)
    if part.symbol in ("led", "diode"):
        return {"A": "anode", "K": "cathode"}[pin.name]
    if part.is_polarised:
        return {"1": "+", "2": "−"}[pin.number]
    if part.symbol != "chip":
        return ""
    return re.sub(r"^-$", "−", re.sub(r"^GND\d+$", "GND", re.sub(r"^GP(\d+)$", r"GPIO \1", pin.name)))


def entry(circuit, refs, pins):
    """Pins of the same part or of parts that are alike, such as "U3 to U9 SER (pin 3)"."""
    names = [pin_name(circuit, (refs[0], pin.number)) for pin in pins]
    name = names[0] if names[0] == names[-1] else f"{names[0]} to {names[-1]}"
    text = f"{compress(refs)} {name}".strip()
    # A pin of a module has its name only.
    if circuit.part((refs[0], "")).symbol != "chip" or any(pin.number == pin.name for pin in pins):
        return text
    return f"{text} (pin{'s' if len(pins) > 1 else ''} {runs(('', pin.number) for pin in pins)})"


def pins_of(circuit, ends):
    """The pins on a net. One entry has the same pin of parts that are alike, and the pins of the same name of a part."""
    by_pin = {}
    for end in ends:
        by_pin.setdefault((circuit.part(end).name, circuit.pin(end)), []).append(end[0])
    by_name = {}
    for (_, pin), refs in by_pin.items():
        by_name.setdefault((*refs, pin_name(circuit, (refs[0], pin.number))), []).append((refs, pin))
    return [entry(circuit, same[0][0], [pin for _, pin in same]) for same in by_name.values()]


def pins_in_order(circuit, nets):
    """The pins on nets that are alike, in the order of the nets: all columns of a register before those of the next one. None if a net
    differs, or if no entry has several parts."""
    if len({len(circuit.nets[net]) for net in nets}) > 1:
        return None
    entries, parts = [], 0
    for ends in zip(*(circuit.nets[net] for net in nets)):
        refs = sorted({end[0] for end in ends}, key=in_number)
        pins = list(dict.fromkeys(circuit.pin(end) for end in ends))
        if list(ends) != [(ref, pin.number) for ref in refs for pin in pins] or len({circuit.part(end).name for end in ends}) > 1:
            return None
        entries.append(entry(circuit, refs, pins))
        parts = max(parts, len(refs))
    return entries if parts > 1 else None


def parts_csv(circuit):
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["references", "quantity", "part", "value", "remarks", "footprint"])
    for (part, value, remarks), refs in lines_of_parts(circuit).items():
        writer.writerow([compress(refs), len(refs), part, value, remarks, circuit.components[refs[0]].part.footprint])
    return text.getvalue()


def tables(drawn):
    """The generated tables: the page, the subject, and the rows."""
    by_page = {}
    for circuit in drawn:
        by_page.setdefault(circuit.page, []).append(circuit)
    for page, circuits in by_page.items():
        yield page, "parts", parts_table(circuits)
        for circuit in circuits:
            yield page, "wires" if len(circuits) == 1 else f"wires of {circuit.name}", wires_table(circuit)


WRITTEN = ", written by tests/tools/schematics/run --write -->\n"
ROWS = r"((?:\|.*\n)*)"


def block(name):
    """The place of a generated table on a page."""
    begin = f"<!-- {name}{WRITTEN}"
    return re.compile(re.escape(begin) + ROWS), begin


def without_blocks(text):
    """A page without its generated tables."""
    return re.sub(r"<!-- [^,\n]*" + re.escape(WRITTEN) + ROWS, "", text)


def write(root, drawn, svg):
    for circuit in drawn:
        (root / FOLDER / f"{circuit.name}.svg").write_text(svg(circuit))
    for page, name, rows in tables(drawn):
        pattern, begin = block(name)
        text = (root / page).read_text()
        if found := pattern.search(text):
            (root / page).write_text(text[: found.start()] + begin + "\n".join(rows) + "\n" + text[found.end() :])


# --- Checks ----------------------------------------------------------------------------------------------------------------------------


def check(root, circuits, drawn, svg, firmware):
    for circuit in drawn:
        picture = root / FOLDER / f"{circuit.name}.svg"
        if not picture.exists() or picture.read_text() != svg(circuit):
            yield f"{FOLDER}/{circuit.name}.svg is not what the circuit gives: run tests/tools/schematics/run --write"
        if f"({picture.name})" not in (root / circuit.page).read_text():
            yield f"{circuit.page} does not show {picture.name}"
    for page, name, rows in tables(drawn):
        yield from check_table(page, (root / page).read_text(), name, rows)
    for page in PICO_PAGES:
        shown = [circuit for circuit in circuits if circuit.page == page] or circuits
        used = {pin for circuit in shown for pin in used_pins(root, circuit, firmware)}
        yield from check_pico_pins(page, (root / page).read_text(), used)
    roles, _ = firmware.read(root, "tx-firmware/boards/pico")
    yield from check_rows(ROAD, (root / ROAD).read_text(), r"(\d+) \(\d+\)", "GP{}", ROAD_ROWS, roles)
    yield from check_registers(ROAD, (root / ROAD).read_text())
    stage = re.search(r"gate: \{ inverts: true, downKohm: ([\d.]+) \}", (root / EMULATOR).read_text())
    for circuit in circuits:
        if "R1" in circuit.components and (not stage or circuit.components["R1"].value != f"{stage[1]} kΩ"):
            yield f"{EMULATOR} has not the {circuit.components['R1'].value} of R1 in {circuit.name} at its gate"
    yield from check_low_current((root / ROAD).read_text(), (root / CALIBRATION).read_text(), circuits)
    yield from check_fuse((root / SAFETY).read_text(), circuits)
    roles, _ = firmware.read(root, "tx-firmware/boards/nucleo-g474")
    text = (root / PORTING).read_text()
    yield from check_rows(PORTING, text, r"\b(P[A-G]\d+)\b", "{}", NUCLEO_ROWS, roles)
    # The resistors beside these two.
    for circuit in (circuit for circuit in circuits if circuit.board.endswith("nucleo-g474")):
        for words, ref in (("inverting gate", "R1"), ("current switch", "R2")):
            value = circuit.components[ref].value
            if not re.search(rf"^\| [^|]*\| [^|]*{words}[^|]*; {re.escape(value)} to ground", text, re.M):
                yield f"{PORTING}: {words!r} is without the {value} of {ref}"


def check_table(page, text, name, rows):
    """A generated table is up to date."""
    found = block(name)[0].search(text)
    if not found:
        yield f"{page} has no place for its {name}: add the line {block(name)[1].strip()}"
    elif found[1].splitlines() != rows:
        yield f"{page}: its {name} are not those of the circuit: run tests/tools/schematics/run --write"


def check_low_current(page, firmware, circuits):
    """The page and the firmware have the share of the low current that the resistors give."""
    for circuit in (circuit for circuit in circuits if "R21" in circuit.components):
        always, switched = (quantity(circuit.components[ref].value) for ref in ("R11", "R21"))
        share = switched / (switched + always)
        kilohms = f"{switched / 1e3:g}/({switched / 1e3:g} + {always / 1e3:g}) = {share:.3f}"
        if kilohms not in page:
            yield f"{ROAD} has not the share of the low current in {circuit.name}, {kilohms}"
        stated = re.search(r"\(\(([\d_]+)u64 << \S+ / \(([\d_]+) \+ ([\d_]+)\)\)", firmware)
        if not stated or [int(ohms) for ohms in stated.groups()] != [switched, switched, always]:
            yield f"{CALIBRATION} has not the resistors of the low current in {circuit.name}: {switched:g} and {always:g} Ω"


def check_fuse(text, circuits):
    """The fuses are those that the page of the light's safety demands."""
    demanded = re.search(r"put a ([\d.]+ A)\s+fuse", text)
    for circuit in circuits:
        for component in circuit.components.values():
            if component.part.symbol == "fuse" and (not demanded or component.value != demanded[1]):
                yield f"{SAFETY} demands a fuse of {demanded[1] if demanded else 'no value'}, and {circuit.name} has {component.value}"


def used_pins(root, circuit, firmware):
    """The board's pins that a circuit or the board itself connects."""
    roles, _ = firmware.read(root, circuit.board)
    wired = {circuit.pin(end).name for ends in circuit.nets.values() for end in ends if circuit.pin(end).kind == "gpio"}
    return wired | {roles[role] for role in circuit.on_board}


def check_pico_pins(page, text, used):
    """The pins beside GPIO and supplies are the Pico's, and each GPIO is one that a kit uses."""
    text = without_blocks(text)
    pairs = re.findall(r"GPIO (\d+) \((?:pin )?(\d+)\)", text)
    for row in re.findall(r"^\| ((?:\d+ \(\d+\)(?:, )?)+) \|", text, re.M):
        pairs += re.findall(r"(\d+) \((\d+)\)", row)
    for gpio, number in pairs:
        names = {pin.name: pin.number for pin in PICO.pins}
        if names.get(f"GP{gpio}") != number:
            yield f"{page}: GPIO {gpio} is pin {names.get(f'GP{gpio}', 'none')} of a Pico, not {number}"
    for name, number in re.findall(r"\b(GND|3V3|VSYS|VBUS)\s*\((?:pin )?(\d+)\)", text):
        if not PICO.pin(number).name.startswith(name):
            yield f"{page}: pin {number} of a Pico is {PICO.pin(number).name}, not {name}"
    for numbers in re.findall(r"GPIO (\d+(?:(?:, | and | to )\d+)*)", text):
        for gpio in re.findall(r"\d+", numbers):
            if f"GP{gpio}" not in used:
                yield f"{page} names GPIO {gpio}, which no circuit connects"


def check_rows(page, text, pin, name, rows, roles):
    """The rows of a table of pins name the firmware's pins, in its order."""
    for words, expected in rows.items():
        found = [row for row in re.findall(r"^\| ([^|]*) \| ([^|]*)", text, re.M) if words in row[1] and re.search(pin, row[0])]
        if len(found) != 1:
            yield f"{page}: {len(found)} rows of pins have {words!r}, not one"
            continue
        pins = [name.format(each) for each in re.findall(pin, found[0][0])]
        right = [roles[role] for role in expected]
        if pins != right:
            yield f"{page}: {words!r} is on {', '.join(pins)}, and the firmware has {', '.join(right)}"


def expand(cell):
    """A cell such as "15, 1 to 3", as 15, 1, 2, 3."""
    found = []
    for first, last in re.findall(r"(\d+)(?: to (\d+))?", cell):
        found += [str(number) for number in range(int(first), int(last or first) + 1)]
    return found


def check_registers(page, text):
    """The table of the registers' pins."""
    match = re.search(r"^\| register's pin[^|]*((?:\|[^|\n]*)+)\|\n\|[-|]+\n((?:\|.*\n)+)", text, re.M)
    if not match:
        yield f"{page} has no table of the registers' pins"
        return
    columns = [[REGISTERS[name] for name in cell.strip().split(", ")] for cell in match[1].strip("|").split("|")]
    seen = set()
    for line in match[2].splitlines():
        what, *cells = [cell.strip() for cell in line.strip("|").split("|")]
        for parts, cell in zip(columns, cells):
            for part in parts:
                if what.startswith("supply; ground"):
                    seen.add("supply; ground")
                    right = [[pin.number for pin in part.pins if pin.kind == kind] for kind in ("supply", "ground")]
                    if [expand(side) for side in cell.split(";")] != right:
                        yield f"{page}: {part.name} has supply and ground at {right[0]} and {right[1]}, not at {cell}"
                    continue
                words = next((words for words in REGISTER_ROWS if what.startswith(words)), None)
                if words is None:
                    yield f"{page}: the table of the registers' pins has a row {what!r}, which nothing checks"
                    continue
                seen.add(words)
                role = REGISTER_ROWS[words]
                named = {f"Q{column}": None for column in range(8)} if role == "column" else None
                right = [part.pin(name).number for name in named] if named else [pin.number for pin in part.pins if pin.role == role]
                if expand(cell) != right:
                    yield f"{page}: {what} of {part.name} is at {', '.join(right) or 'no pin'}, not at {cell or 'no pin'}"
    if missing := ({*REGISTER_ROWS, "supply; ground"} - seen):
        yield f"{page}: the table of the registers' pins lacks {', '.join(sorted(missing))}"
