"""Single pictures without a panel, of what a lattice of lights may be seen in."""

import math

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import surroundings
from lens import lens
from plane import homography
from sensor import CURVES, Sensor

SIZE = (1280, 720)
# Points of a drawing along a pixel's side.
FINE = 3
# The light of a lamp that is On, relative to that of a grey card.
LAMP = (4.0, 25.0)


def lamps(random, columns, rows, lit, off=None, square=False):
    """A board of lamps: `lit` says which are On; those that are Off show as `off`, if they do."""
    step = 24
    board = random.uniform(0.05, 0.4)
    margin = random.uniform(0.6, 1.5)
    size = (int((columns - 1 + 2 * margin) * step), int((rows - 1 + 2 * margin) * step))
    picture = np.full((size[1], size[0]), board)
    bright = random.uniform(*LAMP)
    radius = step * random.uniform(0.2, 0.42)
    y, x = np.mgrid[: size[1], : size[0]]
    for row in range(rows):
        for column in range(columns):
            across, down = abs(x - (margin + column) * step), abs(y - (margin + row) * step)
            within = np.maximum(across, down) < radius if square else np.hypot(across, down) < radius
            if lit[row, column]:
                picture[within] = bright
            elif off is not None:
                picture[within] = off * board
    return picture, step


def lamp_board(random):
    """Lamps at random in 5 to 12 lines, but not in eight by eight."""
    while True:
        columns, rows = random.integers(5, 13, 2)
        if (columns, rows) != (8, 8):
            break
    lit = random.random((rows, columns)) < random.uniform(0.25, 0.75)
    return lamps(random, columns, rows, lit, random.choice([None, random.uniform(1.5, 4)]))


def dot_matrix(random):
    """A sign of dots, of nine or sixteen lines, that shows letters."""
    rows = int(random.choice([9, 12, 16]))
    words = "".join(random.choice(list("ABCDEFGHKLMNPRSTUVXZ0123456789"), int(random.integers(3, 8))))
    font = ImageFont.load_default(rows - 1)
    width = int(font.getlength(words)) + 4
    letters = Image.new("L", (width, rows))
    ImageDraw.Draw(letters).text((2, -1), words, font=font, fill=255)
    return lamps(random, width, rows, np.asarray(letters) > 110, random.choice([None, random.uniform(1.5, 4)]))


def windows(random):
    """A front of windows, lit and dark."""
    columns, rows = random.integers(4, 16, 2)
    step = 24
    picture = np.full((rows * step, columns * step), random.uniform(0.3, 1.5))
    width, height = (int(step * random.uniform(0.4, 0.75)) for _ in range(2))
    lights = random.uniform(0.05, 0.4), random.uniform(2, 8)
    share = random.uniform(0.2, 0.8)
    for row in range(rows):
        for column in range(columns):
            top, left = row * step + (step - height) // 2, column * step + (step - width) // 2
            light = lights[int(random.random() < share)] * random.uniform(0.8, 1.2)
            picture[top : top + height, left : left + width] = light
    return picture, step


def keyboard(random):
    """Keys in rows that are shifted, with their letters."""
    step, rows, columns = 60, 5, 13
    picture = Image.new("F", (columns * step + step, rows * step + 8), random.uniform(0.1, 0.5))
    draw = ImageDraw.Draw(picture)
    key, letter = random.uniform(0.8, 1.6), random.choice([0.1, 3.0])
    font = ImageFont.load_default(20)
    for row, shift in enumerate([0, 0.5, 0.75, 1.0, 0.3]):
        for column in range(columns - 1):
            left, top = (column + shift) * step, row * step + 6
            draw.rectangle([left, top, left + 0.82 * step, top + 0.82 * step], fill=key)
            draw.text((left + 16, top + 10), str(random.choice(list("QWERTZUIOPASDFGHJKLYXCVBNM"))), font=font, fill=float(letter))
    return np.asarray(picture), step / random.choice([1, 3, 6])


def code(random):
    """Modules of a QR code at random, with its three finders."""
    count, step = int(random.choice([21, 25, 29])), 12
    modules = random.random((count, count)) < 0.5
    finder = np.zeros((8, 8), dtype=bool)
    finder[:7, :7] = True
    finder[1:6, 1:6] = False
    finder[2:5, 2:5] = True
    modules[:8, :8], modules[:8, -8:], modules[-8:, :8] = finder, finder[:, ::-1], finder[::-1]
    quiet = np.pad(modules, 4)
    return np.where(np.kron(quiet, np.ones((step, step))) > 0, random.uniform(0.1, 0.3), random.uniform(2, 4)), step


def halftone(random):
    """A picture printed in dots."""
    columns, rows = random.integers(10, 30, 2)
    step = 16
    tone = np.asarray(Image.fromarray(random.random((4, 5)).astype(np.float32)).resize((columns, rows), Image.Resampling.BICUBIC))
    y, x = np.mgrid[: rows * step, : columns * step]
    distance = np.hypot(x % step - step / 2, y % step - step / 2)
    radius = np.kron(np.clip(tone, 0, 1), np.ones((step, step))) * 0.55 * step
    return np.where(distance < radius, random.uniform(0.1, 0.4), random.uniform(2, 4)), step


def chess(random):
    """Squares in turn, of eight lines or another number, some with a piece."""
    columns, rows = (8, 8) if random.random() < 0.5 else random.integers(5, 12, 2)
    step = 24
    squares = np.add.outer(np.arange(rows), np.arange(columns)) % 2
    picture = np.where(np.kron(squares, np.ones((step, step))) > 0, random.uniform(1.5, 4), random.uniform(0.2, 0.6))
    y, x = np.mgrid[:step, :step]
    piece = np.hypot(x - step / 2, y - step / 2) < 0.33 * step
    for row, column in zip(*np.nonzero(random.random((rows, columns)) < random.choice([0, 0.3]))):
        picture[row * step : (row + 1) * step, column * step : (column + 1) * step][piece] = random.choice([0.15, 3.0])
    return picture, step


def text(random):
    """Lines of letters, dark on bright or bright on dark."""
    size = int(random.integers(14, 40))
    font = ImageFont.load_default(size)
    ground, ink = random.permutation([random.uniform(0.1, 0.4), random.uniform(2, 6)])
    picture = Image.new("F", (560, 6 * int(1.3 * size)), ground)
    draw = ImageDraw.Draw(picture)
    for line in range(6):
        letters = random.choice(list("ABCDEFGHIJKLMNOPRSTUVWXYZabcdefghiklmnoprstuvwxyz0123456789    .-"), 60)
        draw.text((4, 1.3 * size * line), "".join(letters), font=font, fill=ink)
    return np.asarray(picture), size / random.uniform(2, 8)


def neon(random):
    """Tubes of light: strokes, rings and rows of bulbs."""
    picture = Image.new("F", (360, 360), random.uniform(0.1, 0.5))
    draw = ImageDraw.Draw(picture)
    bright = random.uniform(*LAMP)
    for _ in range(random.integers(6, 24)):
        x, y, u, v = random.integers(10, 350, 4)
        if random.random() < 0.5:
            draw.line([int(x), int(y), int(u), int(v)], fill=bright, width=int(random.integers(4, 10)))
        else:
            draw.ellipse([int(x) - 14, int(y) - 14, int(x) + 14, int(y) + 14], outline=bright, width=6)
    return np.asarray(picture), random.uniform(12, 40)


KINDS = [lamp_board, dot_matrix, windows, keyboard, code, halftone, chess, text, neon]


def quad(random, width, height, size):
    """Corners of a rectangle of that size seen askew somewhere in the frame."""
    roll = math.radians(random.uniform(-12, 12)) if random.random() < 0.6 else 0.0
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, height / 2]
    corners[:, 0] *= math.cos(math.radians(random.uniform(0, 30)))
    corners[:, 1] *= 1 + random.uniform(-0.08, 0.08) * np.sign(corners[:, 0])
    turn = np.array([[math.cos(roll), math.sin(roll)], [-math.sin(roll), math.cos(roll)]])
    return corners @ turn + [random.uniform(0.25, 0.75) * side for side in size]


def onto(picture, corners, size):
    """A drawing mapped on four corners of a frame, and the share of each pixel that it covers."""
    height, width = picture.shape
    outline = [(0, 0), (width, 0), (width, height), (0, height)]
    to_drawing = homography(corners * FINE, outline).ravel()[:8]
    fine = tuple(FINE * side for side in size)
    mapped = [
        Image.fromarray(layer.astype(np.float32)).transform(fine, Image.Transform.PERSPECTIVE, to_drawing, Image.Resampling.BILINEAR)
        for layer in (picture, np.ones_like(picture))
    ]
    small = [np.asarray(layer).reshape(size[1], FINE, size[0], FINE).mean(axis=(1, 3)) for layer in mapped]
    return small[0], np.clip(small[1], 0, 1)


def draw_deceiver(seed, index, folder, photographs):
    """Draws picture `index` of a seed, each kind in its turn."""
    random = np.random.default_rng([seed, index, 4242])
    kind = KINDS[index % len(KINDS)]
    drawing, step = kind(random)
    pitch_px = math.exp(random.uniform(math.log(3.5), math.log(26)))
    scale = min(pitch_px / step, 0.9 * SIZE[0] / drawing.shape[1], 0.9 * SIZE[1] / drawing.shape[0])
    light = surroundings.photograph(random.choice(surroundings.photographs(photographs)), SIZE, random)
    if random.random() < 0.4:
        light = np.full_like(light, random.uniform(0.3, 1.5))
    corners = quad(random, scale * drawing.shape[1], scale * drawing.shape[0], SIZE)
    there, share = onto(drawing, corners, SIZE)
    width_px = random.uniform(0.6, max(0.7, 0.3 * scale * step))
    light = np.maximum(lens("gauss", width_px).blur(light * (1 - share) + there, 1), 0)
    iso = math.exp(random.uniform(math.log(100), math.log(3200)))
    sensor = Sensor(curve=str(random.choice(list(CURVES))), white=1.0, iso=iso, read_noise_e=3.0)
    sensor.white = float(np.percentile(light[share > 0.5], 99.5)) / math.exp(random.uniform(math.log(0.5), math.log(1.6)))
    grey = np.rint(sensor.expose(light, sensor.fixed(light.shape), random)).astype(np.uint8)
    name = folder / f"{kind.__name__}-{index:04d}"
    if random.random() < 0.4:
        Image.fromarray(grey).save(f"{name}.jpg", quality=int(random.integers(60, 96)))
    else:
        Image.fromarray(grey).save(f"{name}.png")
