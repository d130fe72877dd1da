"""A film of a panel that sends a message, with its truth."""

import json
import math
import subprocess
from dataclasses import replace

import numpy as np
from PIL import Image
from scipy.ndimage import shift as shifted

import panel
from lens import lens
from scene import SOFTEST, Scene, draw_setting, expose_setting
from surroundings import photographs as listed

FPS = 100.0
EXPOSURE_S = 0.001
# The share of the LEDs' light in each channel: for grey that of a camera, for colours that of red LEDs.
GREY = (1.0,)
RED = (1.0, 0.3, 0.1)
TINTS = {"bayer": RED, "rgb": RED}
USUAL_QUALITY = {"jpg": 90, "h264": 23, "h265": 23}
MESSAGE = "Lane closed ahead"
# Panels of the message; a film shows it a little more than twice.
PANELS = 10


def symbols(vocc, count):
    """The panels of the message, repeated, as the transmitter sends them."""
    command = [vocc, "transmit", "--message", MESSAGE, "--count", str(count)]
    return [int(line, 16) for line in subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()]


def draw_clock(random):
    """Symbol rate, its fault, the phase of the first frame in symbols, and the share of frames that the camera loses."""
    rate = float(random.choice([30, 45, 60, 75, 90, 90.909, 99, 100, 100, 100]))
    # At equal rates the phase is constant, and must not be at a change.
    phase = random.uniform(0.05, 0.85) if rate > 98 else random.uniform(0, 1)
    return {
        "symbol_rate": rate,
        "ppm": random.uniform(-150, 150),
        "phase": phase,
        "begins": int(random.integers(0, PANELS)),
        "drop": random.uniform(0.01, 0.05) if random.random() < 0.3 else 0.0,
    }


def draw_course(random):
    """How the panel and the camera move, and how exposure and focus change, from frame to frame."""
    kind = random.choice(["still", "still", "drift", "drift", "shake", "growth", "exposure", "focus"])
    course = {"drift": [0.0, 0.0], "shake": 0.0, "growth": 1.0, "exposure_stops": 0.0, "focus": 1.0}
    if kind == "drift":
        course["drift"] = (random.uniform(-0.6, 0.6, 2)).tolist()
    elif kind == "shake":
        course["shake"] = random.uniform(0.3, 2.0)
    elif kind == "growth":
        course["growth"] = random.uniform(1.01, 1.05)
    elif kind == "exposure":
        course["exposure_stops"] = random.uniform(-1.2, 1.2)
    elif kind == "focus":
        course["focus"] = random.uniform(1.2, 1.7)
    return str(kind), course


def draw_storage(random):
    """How frames are kept."""
    kind = str(random.choice(["png", "png", "png16", "jpg", "jpg", "h264", "h264", "h265"]))
    quality = {"jpg": int(random.integers(50, 96)), "h264": int(random.integers(18, 29)), "h265": int(random.integers(18, 29))}.get(kind)
    return {"storage": kind, "quality": quality}


def shown(clock, frame, sent):
    """Which symbol a frame shows first, and the share of its exposure that the next one has."""
    rate = clock["symbol_rate"] * (1 + clock["ppm"] * 1e-6)
    at = frame / FPS * rate + clock["phase"]
    symbol = math.floor(at)
    mixed = max(0.0, at + EXPOSURE_S * rate - (symbol + 1)) / (EXPOSURE_S * rate)
    first = clock["begins"] + symbol
    return symbol, mixed, sent[first], sent[first + 1]


def as_shares(bits):
    return np.array([bits >> led & 1 for led in range(64)], dtype=float)


def draw_film(seed, folder, photographs, vocc, size, storage=None):
    """Draws film `seed` into a folder; `storage` fixes how it is kept."""
    random = np.random.default_rng([seed, 1])
    setting = draw_setting(random, seed, size, listed(photographs), random.random() < 0.75)
    clock, kept_as = draw_clock(random), draw_storage(random)
    if storage:
        kept_as = {"storage": storage, "quality": USUAL_QUALITY.get(storage)}
    kind, course = draw_course(random)
    count = max(32, math.ceil(2.3 * PANELS * FPS / clock["symbol_rate"]))
    if course["growth"] > 1:
        # At the end of the film, the panel is as near as was drawn.
        begins = setting.pose.distance_m * course["growth"] ** (count - 1)
        farthest = panel.FOCAL_PX * setting.pose.pitch_m / max(1.5, setting.lens["width_px"] / SOFTEST)
        course["growth"] = min(course["growth"], max(1.0, (min(begins, farthest, 80) / setting.pose.distance_m) ** (1 / (count - 1))))
    scene = Scene(setting, photographs, random)
    poses, lenses, gains, moves = plan(setting, course, count, random)
    worst = 0 if course["growth"] > 1 else count - 1
    scene.place(poses[worst], lenses[worst])
    clearness = expose_setting(scene, random)
    sent = symbols(vocc, clock["begins"] + math.ceil(count / FPS * clock["symbol_rate"] * 1.001) + 3)
    lost = set((np.flatnonzero(random.random(count) < clock["drop"])).tolist()) - {0}
    fixed = setting.sensor.fixed((size[1], size[0]))
    folder.mkdir(parents=True, exist_ok=True)
    keeper = Keeper(folder, kept_as, size)
    truths = []
    for frame in range(count):
        symbol, mixed, bits, following = shown(clock, frame, sent)
        pose = poses[frame]
        pixels, _ = panel.project(pose, np.array([[0.0, 0.0]]), scene.principal)
        truths.append(
            {
                "frame": frame,
                "symbol": symbol,
                "mixed_with_next": mixed,
                "bits": f"{bits:016x}",
                "lost": frame in lost,
                "distance_m": pose.distance_m,
                "centre_px": pixels[0].tolist(),
                "pitch_px": panel.FOCAL_PX * pose.pitch_m / pose.distance_m,
            }
        )
        if frame in lost:
            continue
        scene.place(pose, lenses[frame])
        behind = scene.behind
        if any(moves[frame]):
            behind = np.maximum(shifted(behind, (moves[frame][1], moves[frame][0]), order=1, mode="nearest"), 0)
        shares = (1 - mixed) * as_shares(bits) + mixed * as_shares(following)
        channels = [scene.light(shares, behind, tint) for tint in TINTS.get(kept_as["storage"], GREY)]
        keeper.keep(frame, [setting.sensor.expose(light, fixed, random, gains[frame]) for light in channels])
    keeper.close()
    args = summary(setting, scene) | clock | course | kept_as
    args |= {"n": count, "fps": FPS, "exposure": EXPOSURE_S, "course": kind, "clearness": clearness, "receive_args": keeper.receive_args}
    truth = {"args": args, "dead_leds": setting.dead + setting.stuck, "frames": truths}
    (folder / "truth.json").write_text(json.dumps(truth))
    return args


def plan(setting, course, count, random):
    """Pose, lens, exposure and the background's move of each frame."""
    shake = np.zeros(2)
    poses, lenses, gains, moves = [], [], [], []
    for frame in range(count):
        part = frame / max(1, count - 1)
        shake = 0.5 * shake + course["shake"] * random.standard_normal(2)
        centre = np.array(setting.pose.centre_px) + np.array(course["drift"]) * (frame - count / 2) + shake
        distance = setting.pose.distance_m * course["growth"] ** (count - 1 - frame)
        poses.append(replace(setting.pose, centre_px=tuple(centre), distance_m=distance))
        about = dict(setting.lens)
        about["width_px"] = about["width_px"] / course["focus"] ** (1 - part)
        lenses.append(lens(**about) if course["focus"] != 1 else None)
        gains.append(2.0 ** (course["exposure_stops"] * min(1, max(0, 2 * part - 0.5))))
        moves.append(tuple(shake))
    return poses, lenses, gains, moves


def summary(setting, scene):
    """What was drawn, flat, under the names that the films' README has where it has one."""
    pose, sensor = setting.pose, setting.sensor
    widths = scene.lens.widths_px()
    return {
        "seed": setting.seed,
        "crop": f"{setting.size[0]}x{setting.size[1]}",
        "distance": pose.distance_m,
        "interval": pose.interval,
        "roll": pose.roll,
        "yaw": pose.yaw,
        "tilt": pose.tilt,
        "pitch": panel.FOCAL_PX * pose.pitch_m / pose.distance_m,
        "R": setting.reflectance,
        "l2a": setting.l2a,
        "board": None if setting.board is None else setting.board / 0.18,
        "margin": setting.margin,
        "background": setting.background,
        "lamps": setting.lamps,
        "words": setting.words,
        "windows": setting.windows,
        "psf": setting.lens,
        "widths_px": widths,
        "curve": sensor.curve,
        "black": sensor.black_grey,
        "white": sensor.white,
        "iso": sensor.iso,
        "read_noise": sensor.read_noise_e,
        "prnu": sensor.prnu,
        "hot": sensor.hot,
        "vignette": sensor.vignetting,
        "sharpen": sensor.sharpen,
        "sharpen_px": sensor.sharpen_px,
        "led_spread": 0.2 if max(setting.led_gain) > 1 else 0,
        "dead": len(setting.dead) + len(setting.stuck),
        "dim_row": setting.dim_row,
    }


class Keeper:
    """Writes frames: numbered pictures, or a film."""

    def __init__(self, folder, storage, size):
        self.folder, self.storage, self.quality = folder, storage["storage"], storage["quality"]
        self.receive_args = ["--bayer", "RGGB"] if self.storage == "bayer" else []
        self.film = None
        if self.storage in ("h264", "h265"):
            codec = {"h264": "libx264", "h265": "libx265"}[self.storage]
            quiet = ["-x265-params", "log-level=none"] if codec == "libx265" else []
            command = ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{size[0]}x{size[1]}"]
            command += ["-framerate", str(FPS), "-i", "-", "-c:v", codec, "-threads", "1", *quiet, "-crf", str(self.quality)]
            command += ["-pix_fmt", "yuv420p", str(folder / "film.mp4")]
            self.film = subprocess.Popen(command, stdin=subprocess.PIPE)

    def keep(self, frame, channels):
        name = self.folder / f"{frame:05d}"
        grey = channels[0]
        if self.film:
            self.film.stdin.write(np.rint(grey).astype(np.uint8).tobytes())
        elif self.storage == "png16":
            Image.fromarray(np.rint(grey * 257).astype(np.uint16)).save(f"{name}.png")
        elif self.storage == "rgb":
            Image.fromarray(np.rint(np.stack(channels, axis=2)).astype(np.uint8)).save(f"{name}.png")
        elif self.storage == "bayer":
            red, green, blue = channels
            mosaic = green.copy()
            mosaic[::2, ::2], mosaic[1::2, 1::2] = red[::2, ::2], blue[1::2, 1::2]
            Image.fromarray(np.rint(mosaic).astype(np.uint8)).save(f"{name}.png")
        elif self.storage == "jpg":
            Image.fromarray(np.rint(grey).astype(np.uint8)).save(f"{name}.jpg", quality=self.quality)
        else:
            Image.fromarray(np.rint(grey).astype(np.uint8)).save(f"{name}.png")

    def close(self):
        if self.film:
            self.film.stdin.close()
            if self.film.wait():
                raise SystemExit(f"ffmpeg failed on {self.folder}")
