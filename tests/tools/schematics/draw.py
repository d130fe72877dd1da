"""A circuit as a picture in SVG: parts in columns, wires in the channels between them, and flags for supplies and for nets that continue
elsewhere."""

from html import escape

# Pixels: between two pins, of a part with two pins, of a character, and beside a channel's wires.
PITCH = 20
SMALL_WIDTH = 64
CHARACTER = 6.6
MARGIN = 24
TRACK = 11
STUB = 20
# Lines above a part for its designator and its name.
TITLE = 1.7
COLOURS = {"ground": "#333333", "supply": "#b00020", "signal": "#1a4f8b"}


class Unplaced(Exception):
    """The picture lacks a place for something."""


def is_small(component):
    return component.part.symbol != "chip"


def sides(circuit, component):
    """The pins on the left and on the right, as numbers. Of a board only those that are connected."""
    part = component.part
    left, right = ([part.pin(name).number for name in names] for names in (part.left, part.right))
    if part.may_be_open:
        left, right = ([number for number in side if circuit.net_of((component.ref, number))] for side in (left, right))
    for pin in part.pins:
        if circuit.net_of((component.ref, pin.number)) and pin.number not in left + right:
            raise Unplaced(f"{circuit.label((component.ref, pin.number))} of {part.name} is connected, and is not drawn")
    return left, right


def text_width(text):
    return CHARACTER * len(text)


class Picture:
    def __init__(self, circuit):
        self.circuit = circuit
        self.out = []
        self.drawn = [component for component in circuit.components.values() if component.at]
        self.pins = {}
        self.boxes = {}
        self.columns = 1 + max(component.at[0] for component in self.drawn)
        self.place()

    # --- Places --------------------------------------------------------------------------------------------------------------------------

    def pin_text(self, component, number):
        name = component.part.pin(number).name
        if name.startswith("GP") and component.part.pin(number).kind == "gpio":
            return f"GPIO {name[2:]}"
        return "GND" if name.startswith("GND") else name

    def width(self, component):
        if is_small(component):
            return SMALL_WIDTH
        left, right = sides(self.circuit, component)
        widest = [max((text_width(self.pin_text(component, number)) for number in side), default=0) for side in (left, right)]
        return max(sum(widest) + 36, text_width(component.part.name) * 0.95 + 16, 96)

    def place(self):
        widths = [max((self.width(c) for c in self.drawn if c.at[0] == column), default=0) for column in range(self.columns)]
        # The contents of each channel; the first and the last one are beside the outer columns.
        self.channels = [self.channel(column) for column in range(self.columns + 1)]
        x = MARGIN
        self.tracks = []
        column_x = []
        for column in range(self.columns + 1):
            left, nets, right = self.channels[column]
            flags_left = max((self.flag_width(net) for net in left), default=0)
            flags_right = max((self.flag_width(net) for net in right), default=0)
            x += flags_left + (STUB if nets else 0)
            tracks = self.ordered(column, self.with_track(column))
            self.tracks.append({net: x + TRACK * (number + 1) for number, net in enumerate(tracks)})
            x += TRACK * (len(tracks) + 1) + (STUB if nets else 0) + flags_right
            if column < self.columns:
                column_x.append(x)
                x += widths[column]
        self.total_width = x + MARGIN
        self.bottom = 0
        for component in self.drawn:
            column, line = component.at
            left, right = sides(self.circuit, component)
            width = self.width(component)
            x0 = column_x[column] + (widths[column] - width) / 2
            y0 = 70 + line * PITCH
            lines = 2 if is_small(component) else max(len(left), len(right)) + 1
            self.boxes[component.ref] = (x0, y0, width, lines * PITCH)
            self.bottom = max(self.bottom, y0 + lines * PITCH)
            for number_list, side in ((left, -1), (right, 1)):
                for index, number in enumerate(number_list):
                    y = y0 + PITCH if is_small(component) else y0 + PITCH * (index + 1)
                    self.pins[(component.ref, number)] = (x0 if side < 0 else x0 + width, y, side)

        for one in self.drawn:
            for other in self.drawn:
                if one.ref < other.ref and one.at[0] == other.at[0]:
                    (top, bottom), (other_top, other_bottom) = self.extent(one), self.extent(other)
                    if top < other_bottom and other_top < bottom:
                        raise Unplaced(f"{self.circuit.name}: {one.ref} and {other.ref} overlap")

    def extent(self, component):
        """The first and the last line of a part, with its name."""
        line = component.at[1]
        if is_small(component):
            return line + 0.5, line + 1.5
        return line - TITLE, line + 1 + max(len(side) for side in sides(self.circuit, component))

    def ends_in(self, channel):
        """The connected pins at a channel: those of the column on its left, and on its right."""
        found = ([], [])
        for component in self.drawn:
            for side, numbers in zip((-1, 1), sides(self.circuit, component)):
                if component.at[0] + (1 if side > 0 else 0) != channel:
                    continue
                for number in numbers:
                    net = self.circuit.net_of((component.ref, number))
                    if net:
                        found[0 if side > 0 else 1].append((net, (component.ref, number)))
        return found

    def is_rail(self, net):
        return self.circuit.net_v(net) is not None

    def routed(self, channel):
        """The nets that are drawn as wires in a channel: signals with two pins or more there."""
        left, right = self.ends_in(channel)
        count = {}
        for net, _ in left + right:
            count[net] = count.get(net, 0) + 1
        return [net for net in count if count[net] > 1 and not self.is_rail(net)]

    def height(self, end):
        """The line of a pin."""
        component = self.circuit.components[end[0]]
        if is_small(component):
            return component.at[1] + 1
        left, right = sides(self.circuit, component)
        return component.at[1] + 1 + (left if end[1] in left else right).index(end[1])

    def with_track(self, channel):
        """The nets of a channel that are not just a line from the left to the right."""
        left, right = self.ends_in(channel)
        found = []
        for net in self.routed(channel):
            heights = [{self.height(end) for name, end in ends if name == net} for ends in (left, right)]
            if heights[0] != heights[1] or len(heights[0]) > 1:
                found.append(net)
        return found

    def channel(self, channel):
        left, right = self.ends_in(channel)
        nets = self.routed(channel)
        # A net that continues elsewhere has its name at each pin, too.
        flags = [[net for net, _ in ends if net not in nets] for ends in (left, right)]
        return flags[0], nets, flags[1]

    def ordered(self, channel, nets):
        """Tracks from the left such that no two wires overlap: of two pins at one height the left one's track is first."""
        left, right = self.ends_in(channel)
        height = {}
        for side, ends in enumerate((left, right)):
            for net, end in ends:
                if net in nets:
                    height.setdefault(self.height(end), [None, None])[side] = net
        before = {net: set() for net in nets}
        for pair in height.values():
            if pair[0] and pair[1] and pair[0] != pair[1]:
                before[pair[1]].add(pair[0])
        order = []
        while len(order) < len(nets):
            free = [net for net in nets if net not in order and before[net] <= set(order)]
            if not free:
                raise Unplaced(f"{self.circuit.name}: wires in channel {channel} block each other: move a part by half a line")
            order.append(free[0])
        return order

    def flag_width(self, net):
        return text_width(net) + STUB + 14

    # --- Drawing -------------------------------------------------------------------------------------------------------------------------

    def line(self, points, colour="#000000", width=1.2):
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.out.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"/>')

    def text(self, x, y, text, size=11, anchor="start", colour="#000000", weight="normal"):
        style = f'font-size="{size}" text-anchor="{anchor}" fill="{colour}" font-weight="{weight}"'
        self.out.append(f'<text x="{x:g}" y="{y:g}" {style}>{escape(text)}</text>')

    def rectangle(self, x, y, width, height, fill="#ffffff", stroke="#000000", rounded=0):
        self.out.append(f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="{rounded}" fill="{fill}" stroke="{stroke}"/>')

    def dot(self, x, y):
        self.out.append(f'<circle cx="{x:g}" cy="{y:g}" r="2.6" fill="#000000"/>')

    def flag(self, x, y, side, net):
        """A net's name at a pin."""
        volts = self.circuit.net_v(net)
        colour = COLOURS["ground" if volts == 0 else "supply" if volts else "signal"]
        width = text_width(net) + 8
        start = x + side * STUB
        self.line([(x, y), (start, y)])
        self.rectangle(min(start, start + side * width), y - 8, width, 16, "#ffffff", colour, 3)
        self.text(start + side * width / 2, y + 4, net, 11, "middle", colour)

    def component(self, component):
        x, y, width, height = self.boxes[component.ref]
        if is_small(component):
            return self.small(component, x, y + PITCH, width)
        self.rectangle(x, y, width, height, "#fbfaf4")
        self.text(x + width / 2, y - 18, component.ref, 12, "middle", weight="bold")
        self.text(x + width / 2, y - 5, component.part.name, 11, "middle")
        for end, (px, py, side) in self.pins.items():
            if end[0] != component.ref:
                continue
            pin = component.part.pin(end[1])
            name = self.pin_text(component, end[1])
            self.text(px - side * 5, py + 4, name, 11, "end" if side > 0 else "start")
            if component.part.is_active_low(pin):
                start = px - side * 5
                self.line([(start, py - 7), (start - side * text_width(name) * 0.85, py - 7)], width=0.9)
            if pin.number != pin.name:
                self.text(px + side * 3, py - 3, pin.number, 8, "start" if side > 0 else "end", "#666666")
            if end in self.circuit.open:
                self.cross(px + side * 6, py)
            elif not self.circuit.net_of(end):
                self.line([(px, py), (px + side * 6, py)])
        return None

    def cross(self, x, y):
        self.line([(x - 3, y - 3), (x + 3, y + 3)])
        self.line([(x - 3, y + 3), (x + 3, y - 3)])

    def small(self, component, x, y, width):
        """A part with two pins, between its left pin and its right one."""
        middle = x + width / 2
        symbol = component.part.symbol
        label = f"{component.ref} {component.value}{', at ' + component.beside if component.beside else ''}"
        half = {"resistor": 16, "fuse": 16, "capacitor": 3, "led": 7, "diode": 7}[symbol]
        self.line([(x, y), (middle - half, y)])
        self.line([(middle + half, y), (x + width, y)])
        if symbol in ("resistor", "fuse"):
            self.rectangle(middle - 16, y - 5, 32, 10)
            if symbol == "fuse":
                self.line([(middle - 16, y), (middle + 16, y)])
        elif symbol == "capacitor":
            if component.part.is_polarised:
                self.text(middle - 12, y + 10, "+", 9)
            self.line([(middle - 3, y - 9), (middle - 3, y + 9)], width=2)
            self.line([(middle + 3, y - 9), (middle + 3, y + 9)], width=2)
        else:
            # The cathode is on the left.
            self.line([(middle + 7, y - 6), (middle + 7, y + 6), (middle - 7, y), (middle + 7, y - 6)])
            self.line([(middle - 7, y - 6), (middle - 7, y + 6)], width=2)
            if symbol == "led":
                for shift in (0, 6):
                    self.line([(middle - 3 + shift, y - 6), (middle + 1 + shift, y - 11)], width=0.9)
        if symbol == "led":
            self.text(middle - 11, y - 3, component.ref, 9, "end")
        else:
            self.text(middle, y - 11 if symbol == "capacitor" else y - 7, label, 8, "middle")

    def wires(self):
        for channel in range(self.columns + 1):
            left, right = self.ends_in(channel)
            routed = self.routed(channel)
            by_net = {}
            for net, end in left + right:
                x, y, side = self.pins[end]
                if net in routed:
                    by_net.setdefault(net, []).append((x, y, side))
                else:
                    self.flag(x, y, side, net)
            for net, points in by_net.items():
                if net in self.tracks[channel]:
                    self.wire(self.tracks[channel][net], points)
                else:
                    self.line([(x, y) for x, y, _ in points])
                # The name is above the wire at its first pin on the left.
                x, y, side = min(points, key=lambda point: (point[2] < 0, point[1]))
                self.text(x + side * STUB, y - 3, net, 8, "start" if side > 0 else "end", COLOURS["signal"])

    def wire(self, track, points):
        heights = sorted({y for _, y, _ in points})
        for x, y, _ in points:
            self.line([(x, y), (track, y)])
        if len(heights) > 1:
            self.line([(track, heights[0]), (track, heights[-1])])
        for y in heights:
            count = sum(point[1] == y for point in points)
            if len(heights) > 1 and (count > 1 or heights[0] < y < heights[-1]):
                self.dot(track, y)

    def svg(self):
        for component in self.drawn:
            self.component(component)
        self.wires()
        self.text(MARGIN, 22, self.circuit.title, 15, weight="bold")
        y = self.bottom + 34
        for note in self.circuit.notes:
            self.text(MARGIN, y, note, 11)
            y += 16
        width, height = self.total_width, y
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}" '
            'font-family="Helvetica, Arial, sans-serif">'
        )
        # A background of its own, so that it looks the same on dark pages.
        ground = f'<rect width="{width:g}" height="{height:g}" fill="#ffffff"/>'
        return "\n".join([head, ground, *self.out, "</svg>", ""])


def svg(circuit):
    return Picture(circuit).svg()
