"""The lens: how a point of light spreads over the pixels."""

import math
from dataclasses import dataclass

import galsim
import numpy as np
from scipy.signal import fftconvolve

# The lens's own blur, without defocus or motion.
SHARPEST_PX = 0.45
# Fine pixels per camera pixel, on which the widths are measured.
FINE = 4


@dataclass
class Lens:
    """A spread of light (GalSim's, in px), and how far its light reaches."""

    kind: str
    spread: galsim.GSObject
    reach_px: float

    def kernel(self, fine):
        """The spread on a grid of `fine` points a pixel, of sum 1."""
        half = int(math.ceil(self.reach_px * fine))
        size = 2 * half + 1
        picture = self.spread.drawImage(nx=size, ny=size, scale=1 / fine, method="no_pixel", dtype=float).array
        return picture / picture.sum()

    def blur(self, picture, fine):
        return fftconvolve(picture, self.kernel(fine), mode="same")

    def widths_px(self):
        """Standard deviations of a Gaussian that is as wide at half its height, along x and y, and the larger one of all directions."""
        kernel = self.kernel(FINE)
        half = kernel.shape[0] // 2
        offset = (np.arange(kernel.shape[0]) - half) / FINE
        inside = kernel > 0.1 * kernel.max()
        weight = kernel * inside
        weight /= weight.sum()
        covariance = np.array(
            [
                [(weight * offset[None, :] ** 2).sum(), (weight * offset[None, :] * offset[:, None]).sum()],
                [0, (weight * offset[:, None] ** 2).sum()],
            ]
        )
        covariance[1, 0] = covariance[0, 1]
        return math.sqrt(covariance[0, 0]), math.sqrt(covariance[1, 1]), math.sqrt(np.linalg.eigvalsh(covariance)[-1])


def lens(kind, width_px, aspect=1.0, angle_deg=0.0, motion_px=0.0):
    """A lens about as wide as a Gaussian of `width_px`; `aspect` stretches it along `angle_deg`, and `motion_px` smears it there."""
    sharp = galsim.Gaussian(sigma=SHARPEST_PX)
    if kind == "gauss":
        spread, reach = galsim.Gaussian(sigma=width_px), 5 * width_px
    elif kind == "defocus":
        spread, reach = galsim.Convolve([galsim.TopHat(radius=2 * width_px), sharp]), 2 * width_px + 5 * SHARPEST_PX
    elif kind == "moffat":
        spread = galsim.Moffat(beta=3.5, fwhm=2.355 * width_px, trunc=8 * width_px)
        reach = 8 * width_px
    elif kind == "airy":
        # The core of an Airy pattern is as wide as a Gaussian of 0.42 lambda / D.
        spread = galsim.Convolve([galsim.Airy(lam_over_diam=width_px / 0.42), galsim.Gaussian(sigma=0.3)])
        reach = 9 * width_px
    else:
        raise ValueError(f"lens {kind!r}: gauss, defocus, moffat or airy")
    angle = galsim.Angle(angle_deg, galsim.degrees)
    if aspect != 1.0:
        stretch = math.sqrt(aspect)
        spread = spread.transform(stretch, 0, 0, 1 / stretch).rotate(angle).withFlux(1)
        reach *= stretch
    if motion_px > 0:
        smear = galsim.Box(width=motion_px, height=0.05).rotate(angle)
        spread = galsim.Convolve([spread, smear])
        reach += motion_px / 2
    return Lens(kind, spread, reach + 2)
