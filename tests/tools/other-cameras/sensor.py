"""The sensor and what a camera makes of its charges: noise, fixed pattern, encoding curve, sharpening, bits."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

# Electrons of a pixel that saturates at ISO 100.
FULL_WELL = 20_000
# With a shoulder, the maximum light relative to the light that is white without one.
HEADROOM = 4.0


def linear(x):
    return x


def power(gamma):
    return lambda x: x ** (1 / gamma)


def srgb(x):
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def rec709(x):
    return np.where(x < 0.018, 4.5 * x, 1.099 * np.maximum(x, 1e-9) ** 0.45 - 0.099)


def shoulder(x):
    """Gamma 2.2 over Reinhard's curve: the brightest lights are pressed together."""
    light = HEADROOM * x
    return (light * (1 + light / HEADROOM**2) / (1 + light) / (HEADROOM / (1 + HEADROOM) * (1 + 1 / HEADROOM))) ** (1 / 2.2)


CURVES = {
    "linear": linear,
    "1.8": power(1.8),
    "2.2": power(2.2),
    "2.6": power(2.6),
    "srgb": srgb,
    "rec709": rec709,
    "shoulder": shoulder,
}


@dataclass
class Sensor:
    """A camera behind its lens. Grey levels are of 8 bits; `white` is the scene's light that saturates."""

    curve: str
    white: float
    iso: float
    read_noise_e: float
    black_grey: float = 0.0
    prnu: float = 0.0
    hot: int = 0
    vignetting: float = 0.0
    sharpen: float = 0.0
    sharpen_px: float = 1.0
    seed: int = 0

    @property
    def electrons(self):
        """Electrons of a saturated pixel."""
        return FULL_WELL * 100 / self.iso

    def fixed(self, shape):
        """What stays from frame to frame: each pixel's gain, and its dark charge as a share of saturation."""
        random = np.random.default_rng([self.seed, 77])
        height, width = shape
        gain = 1 + self.prnu * random.standard_normal(shape)
        x, y = (np.arange(width) - width / 2) / (width / 2), (np.arange(height) - height / 2) / (height / 2)
        gain /= (1 + self.vignetting * (x[None, :] ** 2 + y[:, None] ** 2) / 2) ** 2
        dark = np.zeros(shape)
        places = random.integers(0, height * width, self.hot)
        dark.ravel()[places] = random.uniform(0.1, 1.0, self.hot)
        return gain, dark

    def encode(self, light):
        """Grey of light that saturates at 1, before it is sharpened and rounded."""
        return self.black_grey + (255 - self.black_grey) * CURVES[self.curve](np.clip(light, 0, 1))

    def finish(self, grey):
        """Sharpens."""
        if self.sharpen > 0:
            grey = grey + self.sharpen * (grey - gaussian_filter(grey, self.sharpen_px))
        return np.clip(grey, 0, 255)

    def expose(self, scene, fixed, random, gain=1.0):
        """A picture of 0..255, not rounded, with all noise."""
        vignetting, dark = fixed
        mean = np.maximum(scene * vignetting * (gain / self.white) + dark, 0) * self.electrons
        charge = mean + np.sqrt(mean) * random.standard_normal(scene.shape)
        few = mean < 50
        charge[few] = random.poisson(mean[few])
        charge += self.read_noise_e * random.standard_normal(scene.shape)
        return self.finish(self.encode(charge / self.electrons))

    def noise_light(self, light):
        """Standard deviation of the noise at a scene's light, as a share of saturation, with the rounding to 8 bits."""
        light = np.clip(light / self.white, 0, 1)
        slope = (self.encode(light + 1e-3) - self.encode(light - 1e-3)) / 2e-3
        shot = (light * self.electrons + self.read_noise_e**2) / self.electrons**2
        return np.sqrt(shot + 1 / 12 / np.maximum(slope, 1) ** 2 + (self.prnu * light) ** 2)
