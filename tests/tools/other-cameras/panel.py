"""The panel: 8 x 8 LEDs of 3 cm on a board, seen by a pinhole of 25 mm over pixels of 6.875 um."""

import math
from dataclasses import dataclass

import galsim
import numpy as np

FOCAL_PX = 25e-3 / 6.875e-6
DIAMETER_M = 0.03
SIDE = 8


@dataclass
class Pose:
    """Where the panel is: its centre's pixel, its distance in m, interval, and turns in degrees."""

    centre_px: tuple
    distance_m: float
    interval: float
    roll: float = 0.0
    yaw: float = 0.0
    tilt: float = 0.0

    @property
    def pitch_m(self):
        return (1 + self.interval) * DIAMETER_M


def led_metres(pose):
    """Centres of the 64 LEDs on the panel in m, in the order of their bits."""
    rows, columns = np.divmod(np.arange(SIDE * SIDE), SIDE)
    return np.stack([columns - 3.5, rows - 3.5], axis=1) * pose.pitch_m


def board_metres(pose, margin):
    """Corners of a board that ends `margin` pitches outside the outer LEDs' cells."""
    half = (4 + margin) * pose.pitch_m
    return np.array([[-half, -half], [half, -half], [half, half], [-half, half]])


def project(pose, points_m, principal):
    """Pixels of points on the panel, and the Jacobian (px per m) there; pixel centres are at whole numbers."""
    roll, yaw, tilt = np.radians([pose.roll, pose.yaw, pose.tilt])
    about_axis = np.array([[math.cos(roll), -math.sin(roll), 0], [math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    about_vertical = np.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]])
    about_horizontal = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
    turn = (about_axis @ about_vertical @ about_horizontal)[:, :2]
    ray = np.array([*(np.array(pose.centre_px) - principal) / FOCAL_PX, 1.0])
    at = pose.distance_m * ray + points_m @ turn.T
    depth = at[:, 2:]
    pixels = FOCAL_PX * at[:, :2] / depth + principal
    jacobians = FOCAL_PX * (turn[None, :2] - (at[:, :2] / depth)[:, :, None] * turn[None, 2:]) / depth[:, :, None]
    return pixels, jacobians


def led_stamps(pose, lens, principal):
    """For each LED the pixels that it covers: top left corner of the stamp, and the share of each pixel's light that is the LED's."""
    pixels, jacobians = project(pose, led_metres(pose), principal)
    disc = galsim.TopHat(radius=DIAMETER_M / 2, flux=math.pi * DIAMETER_M**2 / 4)
    stamps = []
    for (x, y), jacobian in zip(pixels, jacobians):
        seen = galsim.Convolve([disc.transform(*jacobian.ravel()), lens.spread])
        half = int(math.ceil(np.abs(jacobian).sum() * DIAMETER_M / 2 + lens.reach_px))
        left, top = round(x) - half, round(y) - half
        size = 2 * half + 1
        picture = seen.drawImage(nx=size, ny=size, scale=1.0, offset=(x - round(x), y - round(y)), dtype=float)
        stamps.append((left, top, np.maximum(picture.array, 0)))
    return stamps


def board_share(pose, margin, lens, principal, size):
    """The share of each pixel's light that is the board's, LEDs included."""
    width, height = size
    corners, _ = project(pose, board_metres(pose, margin), principal)
    reach = lens.reach_px + 2
    left, top = np.maximum(np.floor(corners.min(axis=0) - reach), 0).astype(int)
    right, bottom = np.minimum(np.ceil(corners.max(axis=0) + reach) + 1, [width, height]).astype(int)
    share = np.zeros((height, width))
    if right <= left or bottom <= top:
        return share
    fine = 4 if max(right - left, bottom - top) < 300 else 2
    pad = int(math.ceil(reach))
    x = left - pad + (np.arange((right - left + 2 * pad) * fine) + 0.5) / fine - 0.5
    y = top - pad + (np.arange((bottom - top + 2 * pad) * fine) + 0.5) / fine - 0.5
    inside = np.ones((y.size, x.size))
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0)):
        inside *= ((x1 - x0) * (y[:, None] - y0) - (y1 - y0) * (x[None, :] - x0)) > 0
    blurred = lens.blur(inside, fine)
    coarse = blurred.reshape(y.size // fine, fine, x.size // fine, fine).mean(axis=(1, 3))
    share[top:bottom, left:right] = coarse[pad:-pad, pad:-pad]
    return np.clip(share, 0, 1)
