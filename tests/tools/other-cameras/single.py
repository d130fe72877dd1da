"""Single pictures of a panel on a board."""

import json
import math

import numpy as np
from PIL import Image

import panel
from film import as_shares, summary
from scene import Scene, draw_setting, expose_setting
from surroundings import photographs as listed

# A picture counts if the panel's contrast to its neighbourhood exceeds this multiple of the noise.
CONTRAST = 3.0


def draw_single(seed, index, folder, photographs, size):
    """Draws picture `index` of a seed into a folder, and its truth beside it."""
    for attempt in range(20):
        random = np.random.default_rng([seed, index, attempt])
        setting = draw_setting(random, seed + index, size, listed(photographs), True)
        scene = Scene(setting, photographs, random)
        scene.place(setting.pose)
        clearness = expose_setting(scene, random)
        bits = int(random.integers(0, 2**63)) * 2 + int(random.integers(2))
        light = scene.light(as_shares(bits))
        contrast = contrast_to_noise(scene, light, bits)
        if contrast > CONTRAST and clearness > 2:
            break
    else:
        raise SystemExit(f"picture {index} of seed {seed}: no contrast of {CONTRAST} in 20 draws")
    grey = np.rint(setting.sensor.expose(light, setting.sensor.fixed(light.shape), random)).astype(np.uint8)
    name = folder / f"{setting.background}-{index:04d}"
    quality = int(random.integers(50, 96)) if random.random() < 0.5 else None
    if quality:
        Image.fromarray(grey).save(f"{name}.jpg", quality=quality)
    else:
        Image.fromarray(grey).save(f"{name}.png")
    pixels, _ = panel.project(setting.pose, panel.led_metres(setting.pose), scene.principal)
    board, _ = panel.project(setting.pose, panel.board_metres(setting.pose, setting.margin), scene.principal)
    rows = ["".join(str(bits >> (8 * row + column) & 1) for column in range(8)) for row in range(8)]
    truth = {
        "bits": rows,
        "params": summary(setting, scene) | {"jpeg": quality},
        "dead_leds": setting.dead + setting.stuck,
        "contrast_to_noise": contrast,
        "contrast_is": "mean grey of On LEDs' middles less that of the board between LEDs, over the noise (grey) there, both without noise",
        "clearness": clearness,
        "led_corner_centres_px": pixels[[0, 7, 63, 56]].tolist(),
        "board_corners_px": board.tolist(),
        "led_centres_px": pixels.tolist(),
    }
    name.with_name(name.name + ".json").write_text(json.dumps(truth))


def contrast_to_noise(scene, light, bits):
    """How far On LEDs stand out of the board between LEDs, over the noise of a pixel."""
    setting, sensor = scene.setting, scene.setting.sensor
    pixels, _ = panel.project(setting.pose, panel.led_metres(setting.pose), scene.principal)
    middles = np.rint(pixels).astype(int)
    grid = pixels.reshape(8, 8, 2)
    gaps = np.rint((grid[:-1, :-1] + grid[1:, 1:]).reshape(-1, 2) / 2).astype(int)
    on = middles[[led for led in range(64) if bits >> led & 1 and led not in setting.dead]]
    share = light / sensor.white
    grey = sensor.encode(share)
    between = light[gaps[:, 1], gaps[:, 0]]
    slope = np.maximum((sensor.encode(between / sensor.white + 1e-3) - sensor.encode(between / sensor.white - 1e-3)) / 2e-3, 1)
    noise = math.sqrt(np.mean((sensor.noise_light(between) * slope) ** 2))
    return float((grey[on[:, 1], on[:, 0]].mean() - grey[gaps[:, 1], gaps[:, 0]].mean()) / noise)
