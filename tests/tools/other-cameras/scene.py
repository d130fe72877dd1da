"""One panel before one camera, everything drawn at random from one seed."""

import math
from dataclasses import dataclass, field

import numpy as np

import panel
import surroundings
from lens import lens
from panel import Pose
from sensor import CURVES, Sensor

# Reflectance of the card that has light 1.
CARD = 0.18
# LEDs closer than this many standard deviations of the blur overlap so much that no receiver reads them.
SOFTEST = 0.5
# Minimum of half the distance of On and Off relative to the noise, if the camera is known and the light inverted: below it, a set says
# nothing about receivers.
CLEAREST_ERROR = 3.3


@dataclass
class Setting:
    """All that a camera and a panel were drawn with."""

    seed: int
    size: tuple
    pose: Pose
    lens: dict
    sensor: Sensor
    reflectance: float
    l2a: float
    board: float | None
    margin: float
    illumination: float
    background: str
    lamps: int
    words: str
    windows: bool
    led_gain: list
    dead: list = field(default_factory=list)
    stuck: list = field(default_factory=list)
    dim_row: int | None = None


def draw_setting(random, seed, size, photographs, has_board):
    """Draws all but the sensor's white and noise, which `expose_setting` chooses by what the panel's light is."""
    interval = random.uniform(0.5, 2.0)
    width_px = math.exp(random.uniform(math.log(0.6), math.log(4.0)))
    nearest = max(1.5, width_px / SOFTEST)
    farthest = min(109.0, min(size) / 9.5)
    pitch_px = math.exp(random.uniform(math.log(nearest), math.log(farthest)))
    distance = panel.FOCAL_PX * (1 + interval) * panel.DIAMETER_M / pitch_px
    distance = float(np.clip(distance, 2, 80))
    pitch_px = panel.FOCAL_PX * (1 + interval) * panel.DIAMETER_M / distance
    width_px = min(width_px, max(0.6, SOFTEST * pitch_px))
    room = 5.2 * pitch_px
    centre = tuple(random.uniform(min(room, side / 2), max(side - room, side / 2)) for side in size)
    pose = Pose(centre, distance, interval, random.uniform(-12, 12), random.uniform(-28, 28), random.uniform(-12, 12))
    kind = random.choice(["gauss", "gauss", "defocus", "moffat", "airy"])
    about = {"kind": str(kind), "width_px": width_px}
    if random.random() < 0.35:
        about |= {"aspect": random.uniform(1.15, 1.7), "angle_deg": random.uniform(0, 180)}
    if random.random() < 0.2:
        about |= {"motion_px": random.uniform(0.5, 1.5) * width_px, "angle_deg": about.get("angle_deg", random.uniform(0, 180))}
    board = math.exp(random.uniform(math.log(0.02), math.log(0.9))) if has_board else None
    sensor = Sensor(
        curve=str(random.choice(list(CURVES))),
        white=1.0,
        iso=math.exp(random.uniform(math.log(100), math.log(12800))),
        read_noise_e=random.uniform(1.5, 6),
        black_grey=float(random.choice([0, 0, 4, 16])),
        prnu=random.uniform(0, 0.02) if random.random() < 0.5 else 0.0,
        hot=int(random.integers(20, 300)) if random.random() < 0.4 else 0,
        vignetting=random.uniform(0.1, 0.5) if random.random() < 0.5 else 0.0,
        sharpen=random.uniform(0.3, 1.5) if random.random() < 0.35 else 0.0,
        sharpen_px=random.uniform(0.8, 2.0),
        seed=seed,
    )
    gains = 1 + random.uniform(-0.2, 0.2, 64) if random.random() < 0.5 else np.ones(64)
    words = str(random.choice(["", "", "", "EXIT 12", "Lane closed", "STOP", "24h PARKING", "A7 north"]))
    setting = Setting(
        seed=seed,
        size=tuple(size),
        pose=pose,
        lens=about,
        sensor=sensor,
        reflectance=random.uniform(0.3, 0.5),
        l2a=random.uniform(1.0, 4.0),
        board=board,
        margin=random.choice([0.0, random.uniform(0, 0.5), random.uniform(0.5, 3)]) if has_board else 0.0,
        illumination=random.uniform(0.4, 1.6),
        background=random.choice(photographs).stem,
        lamps=int(random.integers(1, 7)) if random.random() < 0.3 else 0,
        words=words,
        windows=bool(random.random() < 0.2),
        led_gain=gains.tolist(),
    )
    broken = random.random()
    if broken < 0.3:
        leds = random.choice(64, 2, replace=False).tolist()
        for led in leds:
            (setting.dead if random.random() < 0.6 else setting.stuck).append(led)
    if random.random() < 0.15:
        setting.dim_row = int(random.integers(8))
    return setting


def led_light(setting, bits, tint=1.0):
    """Light of each LED's surface that shows `bits` (64 shares of On, 0..1), to a channel that takes in `tint` of what it sends."""
    off = setting.reflectance / CARD
    own = off * math.pi * setting.l2a * np.array(setting.led_gain)
    if setting.dim_row is not None:
        own[8 * setting.dim_row : 8 * setting.dim_row + 8] *= 0.5
    shown = np.array(bits, dtype=float)
    shown[setting.dead] = 0
    shown[setting.stuck] = 1
    return off + tint * own * shown


class Scene:
    """What a setting looks like: draws the light that falls on the pixels."""

    def __init__(self, setting, folder, random):
        self.setting = setting
        self.lens = lens(**setting.lens)
        self.principal = (np.array(setting.size) - 1) / 2
        path = next(p for p in surroundings.photographs(folder) if p.stem == setting.background)
        behind = surroundings.photograph(path, setting.size, random) * setting.illumination
        pitch = panel.FOCAL_PX * setting.pose.pitch_m / setting.pose.distance_m
        circle = (*setting.pose.centre_px, (4.2 + setting.margin) * math.sqrt(2) * pitch)
        if setting.windows:
            behind = surroundings.windows(behind, circle, random)
        if setting.words:
            behind = surroundings.text(behind, setting.words, circle, random)
        if setting.lamps:
            bright = setting.reflectance / CARD * (1 + math.pi * setting.l2a)
            behind = surroundings.lamps(behind, setting.lamps, bright, circle, pitch, random)
        edge = math.ceil(self.lens.reach_px)
        behind = self.lens.blur(np.pad(behind, edge, mode="symmetric"), 1)[edge:-edge, edge:-edge]
        self.behind = np.maximum(behind, 0)
        self.pose = None

    def place(self, pose, lens=None):
        """Puts the panel at a pose; what does not change from symbol to symbol is drawn here."""
        if pose == self.pose and lens is None:
            return
        self.pose = pose
        self.lens = lens or self.lens
        setting = self.setting
        self.stamps = panel.led_stamps(pose, self.lens, self.principal)
        if setting.board is None:
            share = None
        else:
            share = panel.board_share(pose, setting.margin, self.lens, self.principal, setting.size)
        covered = np.zeros_like(self.behind)
        for window, stamp in self.boxes():
            covered[window] += stamp
        self.covered = np.minimum(covered, 1)
        self.share = share

    def boxes(self):
        """Each LED's part of the picture, and its stamp cut to that."""
        height, width = self.behind.shape
        for left, top, stamp in self.stamps:
            x0, y0 = max(left, 0), max(top, 0)
            x1, y1 = min(left + stamp.shape[1], width), min(top + stamp.shape[0], height)
            if x1 > x0 and y1 > y0:
                yield (slice(y0, y1), slice(x0, x1)), stamp[y0 - top : y1 - top, x0 - left : x1 - left]
            else:
                yield (slice(0, 0), slice(0, 0)), stamp[:0, :0]

    def surface(self, behind=None):
        """The light without LEDs."""
        behind = self.behind if behind is None else behind
        if self.share is None:
            return behind
        return behind * (1 - self.share) + self.share * (self.setting.board / CARD)

    def light(self, bits, behind=None, tint=1.0):
        """The light of a picture in which the LEDs show `bits`, to a channel that takes in `tint` of theirs."""
        light = self.surface(behind) * (1 - self.covered)
        for (window, stamp), shine in zip(self.boxes(), led_light(self.setting, bits, tint)):
            light[window] += stamp * shine
        return light


def expose_setting(scene, random):
    """Chooses the white level; lowers the noise until a receiver that knows the camera can read the bits.

    Returns the error_distance.
    """
    sensor = scene.setting.sensor
    columns, region = region_of_leds(scene)
    brightest = float(np.percentile(region, 99.5))
    sensor.white = brightest / math.exp(random.uniform(math.log(0.35), math.log(2.0)))
    clearness = error_distance(scene, columns, region)
    while clearness < CLEAREST_ERROR and sensor.iso > 100:
        sensor.iso = max(100.0, sensor.iso * 0.7)
        clearness = error_distance(scene, columns, region)
    if clearness < CLEAREST_ERROR:
        sensor.prnu *= 0.3
        sensor.white = brightest / 0.9
        clearness = error_distance(scene, columns, region)
    return clearness


def region_of_leds(scene):
    """The share that each LED has of the pixels round the panel, and these pixels' light when all LEDs are half On."""
    boxes = list(scene.boxes())
    top, left = (min(box[axis].start for box, _ in boxes) for axis in (0, 1))
    bottom, right = (max(box[axis].stop for box, _ in boxes) for axis in (0, 1))
    columns = np.zeros((64, bottom - top, right - left), dtype=np.float32)
    for column, (box, stamp) in zip(columns, boxes):
        column[box[0].start - top : box[0].stop - top, box[1].start - left : box[1].stop - left] = stamp
    region = scene.light(np.full(64, 0.5))[top:bottom, left:right]
    # The pixels of large panels are redundant.
    step = max(1, (right - left) // 100)
    return columns[:, ::step, ::step].reshape(64, -1) * step, region[::step, ::step].ravel()


def error_distance(scene, columns, region):
    """Half the distance between On and Off over the noise of the light inverted by least squares: the median of the working LEDs.

    With the camera known and pixels that clip hardly counted; 3.3 is an error rate of 0.05 %.
    """
    setting, sensor = scene.setting, scene.setting.sensor
    weight = 1 / sensor.noise_light(region) ** 2
    weight[region > sensor.white] *= 0.05
    information = (columns * weight) @ columns.T
    difference = (led_light(setting, np.ones(64)) - led_light(setting, np.zeros(64))) / sensor.white
    variance = np.diag(np.linalg.inv(information + 1e-9 * np.trace(information) / 64 * np.eye(64)))
    working = difference > 0
    return float(np.median(difference[working] / np.sqrt(np.maximum(variance[working], 1e-12))) / 2)
