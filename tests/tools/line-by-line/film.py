"""A film of a panel by a camera that exposes its lines one after another: the light of each line is summed over that line's own time."""

import subprocess

import numpy as np

# Light of the background is 1, which is encoded as this grey level.
MIDDLE_GREY = 118
OFF, ON = 2.2, 13.0
# LED diameter over pitch.
FILL = 0.5
# Points of an LED's disc on each side of its centre.
RINGS = 3


def symbols(vocc, message, count):
    """The panels of the message, repeated, as the transmitter sends them."""
    command = [vocc, "transmit", "--message", message, "--count", str(count)]
    return [int(line, 16) for line in subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()]


def discs(centres, pitch, sigma, size):
    """What each LED of light 1 adds to the pixels: a blurred disc, in its box (top, left, image)."""
    radius = 0.5 * FILL * pitch
    steps = np.linspace(-1, 1, 2 * RINGS + 1) * radius
    points = [(x, y) for x in steps for y in steps if x * x + y * y <= 1.001 * radius * radius]
    variance = sigma * sigma + 1 / 12
    reach = int(np.ceil(radius + 4 * np.sqrt(variance)))
    for x, y in centres:
        left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
        columns = np.arange(left, min(int(x) + reach + 2, size[0]))
        rows = np.arange(top, min(int(y) + reach + 2, size[1]))
        image = np.zeros((len(rows), len(columns)))
        for dx, dy in points:
            across = np.exp(-0.5 * (columns - x - dx) ** 2 / variance)
            down = np.exp(-0.5 * (rows - y - dy) ** 2 / variance)
            image += np.outer(down, across)
        # A disc that is wider than the blur is as bright as its surface; a narrower one loses light to its surroundings.
        yield top, left, image * (np.pi * radius**2) / (len(points) * 2 * np.pi * variance)


def lit(shown, begin_s, exposure_s, rate_hz, phase):
    """The share of each line's exposure for which each LED is On: lines along the first axis."""
    edges = np.array([begin_s, begin_s + exposure_s]) * rate_hz + phase
    first, last = int(edges.min()), int(edges.max())
    shares = np.zeros((edges.shape[1], 64))
    for symbol in range(first, last + 1):
        part = np.clip(edges[1], symbol, symbol + 1) - np.clip(edges[0], symbol, symbol + 1)
        bits = np.array([shown[symbol] >> led & 1 for led in range(64)])
        shares += np.outer(part / (exposure_s * rate_hz), bits)
    return shares


def grey(light):
    """Grey levels of light, encoded by BT.709."""
    middle = ((MIDDLE_GREY / 255 + 0.099) / 1.099) ** (1 / 0.45)
    share = light * middle
    coded = np.where(share < 0.018, 4.5 * share, 1.099 * np.maximum(share, 1e-9) ** 0.45 - 0.099)
    return 255 * coded


def frames(args, shown, random):
    """The film's frames, as arrays of grey levels."""
    size = args["size"]
    turn = np.radians(args["roll_deg"])
    middle = np.array(size) / 2 + random.uniform(-2, 2, 2)
    across = np.array([np.cos(turn), np.sin(turn)]) * args["pitch_px"]
    down = np.array([-np.sin(turn), np.cos(turn)]) * args["pitch_px"]
    centres = [middle + across * (led % 8 - 3.5) + down * (led // 8 - 3.5) for led in range(64)]
    images = list(discs(centres, args["pitch_px"], args["sigma_px"], size))
    lines = np.arange(size[1])
    lines = lines if args["line_s"] >= 0 else lines - size[1]
    for number in range(args["frames"]):
        time_s = number / args["fps"]
        light = np.ones((size[1], size[0]))
        shares = lit(shown, time_s + lines * args["line_s"], args["exposure_s"], args["symbol_rate"], args["phase"])
        for led, (top, left, image) in enumerate(images):
            height, width = image.shape
            surface = OFF + (ON - OFF) * shares[top : top + height, led]
            light[top : top + height, left : left + width] += image * (surface - 1)[:, None]
        # Electrons of a pixel that is white at `full_well_e`.
        per_light = args["full_well_e"] * (MIDDLE_GREY / 255) ** 2.2
        electrons = random.poisson(np.maximum(light, 0) * per_light) + random.normal(0, 3, light.shape)
        yield np.clip(np.rint(grey(electrons / per_light)), 0, 255).astype(np.uint8)


def write_pgm(path, pixels):
    """A frame as a file."""
    path.write_bytes(b"P5\n%d %d\n255\n" % (pixels.shape[1], pixels.shape[0]) + pixels.tobytes())
