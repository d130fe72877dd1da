"""What is around the panel: a photograph, lamps, text, windows. Light is such that a card of 18 % has 1."""

import pathlib

import numpy as np
from PIL import Image, ImageDraw, ImageFont

CARD_GREY = 118


def photographs(folder):
    paths = sorted(pathlib.Path(folder).glob("*.png"))
    if not paths:
        raise SystemExit(f"no photographs (*.png) in {folder}: tests/tools/fetch-photographs {folder}")
    return paths


def photograph(path, size, random):
    """A random part of a photograph, mirrored or not, as large as the frame, as light."""
    picture = Image.open(path).convert("L")
    width, height = size
    largest = min(picture.width / width, picture.height / height)
    scale = largest * random.uniform(0.4, 1.0)
    part = (max(2, int(width * scale)), max(2, int(height * scale)))
    left, top = random.integers(0, picture.width - part[0] + 1), random.integers(0, picture.height - part[1] + 1)
    picture = picture.crop((left, top, left + part[0], top + part[1])).resize(size, Image.Resampling.BICUBIC)
    grey = np.asarray(picture, dtype=float)
    if random.random() < 0.5:
        grey = grey[:, ::-1]
    return (np.maximum(grey, 0) / CARD_GREY) ** 2.2


def away(place, radius, keep_out):
    """Whether a disc stays clear of a circle (x, y, radius)."""
    x, y, r = keep_out
    return np.hypot(place[0] - x, place[1] - y) > r + radius


def lamps(light, count, brightness, keep_out, pitch_px, random):
    """Steady lamps: discs as bright as LEDs."""
    height, width = light.shape
    share = np.zeros_like(light)
    x, y = np.arange(width), np.arange(height)
    for _ in range(count):
        radius = pitch_px * random.uniform(0.3, 1.5)
        for _ in range(50):
            reach = keep_out[2] * random.uniform(1.1, 3) + radius
            angle = random.uniform(0, 2 * np.pi)
            place = (keep_out[0] + reach * np.cos(angle), keep_out[1] + reach * np.sin(angle))
            if away(place, radius, keep_out):
                break
        distance = np.hypot(x[None, :] - place[0], y[:, None] - place[1])
        share = np.maximum(share, np.clip(radius - distance + 0.5, 0, 1))
    return light * (1 - share) + brightness * share


def text(light, words, keep_out, random):
    """White words on a sign, clear of the panel."""
    height, width = light.shape
    size = int(random.uniform(12, 48))
    font = ImageFont.load_default(size)
    picture = Image.new("L", (width, height))
    draw = ImageDraw.Draw(picture)
    sign = Image.new("L", (width, height))
    for _ in range(50):
        left, top = random.uniform(0, width * 0.7), random.uniform(0, height * 0.9)
        box = draw.textbbox((left, top), words, font=font)
        middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
        if away(middle, np.hypot(box[2] - box[0], box[3] - box[1]) / 2, keep_out):
            ImageDraw.Draw(sign).rectangle([box[0] - 6, box[1] - 6, box[2] + 6, box[3] + 6], fill=255)
            draw.text((left, top), words, font=font, fill=255)
            break
    sign, letters = np.asarray(sign) / 255, np.asarray(picture) / 255
    return light * (1 - sign) + sign * (0.15 * (1 - letters) + 4 * letters)


def windows(light, keep_out, random):
    """A front of repeated windows, lit and dark, clear of the panel."""
    height, width = light.shape
    step = random.uniform(6, 30)
    columns, rows = random.integers(4, 16, 2)
    lit = random.random((rows, columns)) < random.uniform(0.2, 0.8)
    picture = light.copy()
    for _ in range(50):
        left, top = random.uniform(0, width * 0.8), random.uniform(0, height * 0.8)
        middle = (left + columns * step / 2, top + rows * step / 2)
        if away(middle, np.hypot(columns, rows) * step / 2, keep_out):
            break
    else:
        return picture
    for row in range(rows):
        for column in range(columns):
            x, y = int(left + column * step), int(top + row * step)
            picture[y : y + max(1, int(step * 0.6)), x : x + max(1, int(step * 0.6))] = 3.0 if lit[row, column] else 0.1
    return picture
