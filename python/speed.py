"""The speed of the package compared with the program, in pictures a second, and with GalSim and SciPy for one picture at one error.

    python -m pip install ./python numpy scipy galsim
    cargo build --release -p vocc
    python python/speed.py --program target/release/vocc

Program and package are timed alternately, by the clock and by their processor time, which does not depend on the computer's load. A time
is the median of several. An error is the maximum over all pixels, in grey levels before rounding, relative to vocc's reference level.
"""

import argparse
import json
import resource
import statistics
import subprocess
import time
from collections.abc import Callable

import numpy as np
from scipy import ndimage

import vocc

Picture = np.ndarray
# Without air, which the other programs cannot simulate.
SCENE = vocc.Scene("paper", atmosphere="off")
BITS = "8142a51824c34281"


def grey(light: Picture) -> Picture:
    """Grey levels before rounding: Do & Yoo 2020, Eq. 11."""
    return 118 * np.maximum(light, 0) ** (1 / 2.2)


def seconds(call: Callable[[], object], least_s: float = 0.3) -> float:
    """The median duration of several calls."""
    times: list[float] = []
    while sum(times) < least_s or len(times) < 5:
        begun = time.perf_counter()
        call()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def evaluations(program: str, rounds: int, frames: int) -> None:
    """The speeds of `vocc evaluate` and vocc.evaluate, measured alternately."""
    scene = vocc.Scene("paper", distance_m=70)
    options = ["evaluate", "paper", "--set", "pose.distance_m=70", "--frames", str(frames), "--threads", "2", "--json"]
    by_clock, by_processor, rates = [], [], []
    for _ in range(rounds):
        before = processor_s(resource.RUSAGE_CHILDREN)
        printed = subprocess.run([program, *options], capture_output=True, text=True, check=True).stdout
        of_program = processor_s(resource.RUSAGE_CHILDREN) - before
        before = processor_s(resource.RUSAGE_SELF)
        found = vocc.evaluate(scene, frames=frames, threads=2)
        of_package = processor_s(resource.RUSAGE_SELF) - before
        seconds_of_program = json.loads(printed)["seconds"]
        rates.append((frames / seconds_of_program, frames / found.seconds))
        by_clock.append(seconds_of_program / found.seconds)
        by_processor.append(of_program / of_package)
    fastest = [max(column) for column in zip(*rates, strict=True)]
    print(f"evaluate, 70 m, 2 threads, the fastest of {rounds} turns: program {fastest[0]:.0f}, package {fastest[1]:.0f} frames a second")
    for name, ratios in (("the clock", by_clock), ("processor time", by_processor)):
        print(f"  package over program by {name}: {statistics.median(ratios):.3f}, from {min(ratios):.3f} to {max(ratios):.3f}")


def processor_s(of_whom: int) -> float:
    """The processor time so far of this program, or of its child processes."""
    used = resource.getrusage(of_whom)
    return used.ru_utime + used.ru_stime


def batches(frames: int) -> None:
    """Pictures a second that arrive in NumPy in batches."""
    for distance_m in (140, 70, 50):
        scene = vocc.Scene("paper", distance_m=distance_m)
        rates = []
        for threads in (1, 2):
            pictures = vocc.frames(scene, 6 * frames, batch=frames, threads=threads)
            next(pictures)
            rates.append(frames / seconds(lambda pictures=pictures: next(pictures), least_s=0))
        height, width = pictures.shape
        print(f"frames, {distance_m} m, {width} x {height}: {rates[0]:.0f} a second on 1 thread, {rates[1]:.0f} on 2")


def lights() -> tuple[float, float, float]:
    """The light of an On LED, an Off LED and the background, from a panel so near that a pixel shows only one of them."""
    near = vocc.Renderer(SCENE.with_(distance_m=2, blur="off"), level="reference")
    on, off = near.render(1, linear=True), near.render(0, linear=True)
    x, y = np.rint(near.corners_px[0]).astype(int)
    return float(on[y, x]), float(off[y, x]), float(off[0, 0])


class Panel:
    """The picture for the other programs: discs on a lattice, in the region that vocc draws."""

    def __init__(self, renderer: vocc.Renderer) -> None:
        on, off, self.background = lights()
        self.shape = renderer.shape
        corners = renderer.corners_px
        across, down = (corners[1] - corners[0]) / 7, (corners[3] - corners[0]) / 7
        rows, columns = np.mgrid[:8, :8]
        self.centres = corners[0] + columns[..., None] * across + rows[..., None] * down
        self.radius_px = np.linalg.norm(across) / (1 + SCENE["interval"]) / 2
        self.excess = np.where(vocc.as_bits(BITS), on, off) - self.background

    def by_scipy(self, samples: int) -> Picture:
        """Draws `samples` x `samples` fine pixels per pixel with smooth edges, blurs by scipy.ndimage.gaussian_filter, and averages."""
        height, width = self.shape
        fine = np.full((height * samples, width * samples), self.background)
        reach = int(np.ceil((self.radius_px + 1) * samples))
        for (x, y), excess in zip(self.centres.reshape(-1, 2), self.excess.ravel(), strict=True):
            # Positions in fine pixels; the centre of pixel 0 is at 0.
            column, row = (x + 0.5) * samples - 0.5, (y + 0.5) * samples - 0.5
            left, top = int(column) - reach, int(row) - reach
            part = fine[max(top, 0) : top + 2 * reach + 1, max(left, 0) : left + 2 * reach + 1]
            ys, xs = np.mgrid[: part.shape[0], : part.shape[1]]
            away = np.hypot(xs + max(left, 0) - column, ys + max(top, 0) - row)
            part += excess * np.clip(self.radius_px * samples - away + 0.5, 0, 1)
        blurred = ndimage.gaussian_filter(fine, SCENE["blur_sigma_px"] * samples, mode="nearest", truncate=6)
        return blurred.reshape(height, samples, width, samples).mean((1, 3))

    def by_galsim(self, accuracy: float) -> Picture:
        """Convolves discs with the blur and the pixel by GalSim's Fourier transforms."""
        import galsim

        height, width = self.shape
        knobs = galsim.GSParams(
            folding_threshold=accuracy, maxk_threshold=accuracy, kvalue_accuracy=accuracy / 100, maximum_fft_size=16384
        )
        middle = np.array([(width - 1) / 2, (height - 1) / 2])
        disc = galsim.TopHat(self.radius_px, flux=np.pi * self.radius_px**2, gsparams=knobs)
        discs = [
            (disc * float(excess)).shift(*(centre - middle))
            for centre, excess in zip(self.centres.reshape(-1, 2), self.excess.ravel(), strict=True)
        ]
        blurred = galsim.Convolve([galsim.Add(discs), galsim.Gaussian(sigma=SCENE["blur_sigma_px"])], gsparams=knobs)
        picture = blurred.drawImage(nx=width, ny=height, scale=1, method="auto", dtype=float)
        return picture.array + self.background


def pictures() -> None:
    """Time and error of one picture by each program, at least as accurate as each level of vocc."""
    for level in ("fast", "fine"):
        renderer = vocc.Renderer(SCENE, level=level, crop=True)
        of_vocc = seconds(lambda renderer=renderer: renderer.render(BITS, linear=True))
        expected = reference_of(renderer)
        error = np.abs(grey(renderer.render(BITS, linear=True)) - grey(expected)).max()
        bound = renderer.error_bound_grey
        height, width = renderer.shape
        print(f"one picture of {width} x {height} pixels, at most {bound} grey levels off:")
        print(f"  vocc, {level}: {of_vocc * 1e6:.0f} us, {error:.4f} off")
        panel = Panel(renderer)
        tried: list[tuple[str, Callable[[float], Picture], list[float]]] = [
            ("SciPy, samples a side", lambda samples: panel.by_scipy(int(samples)), [1, 2, 3, 4, 6, 8, 12, 16, 24, 32]),
        ]
        try:
            import galsim  # noqa: F401

            tried.append(("GalSim, accuracy", panel.by_galsim, [0.1, 5e-2, 1e-2, 1e-3, 1e-4]))
        except ImportError:
            print("  GalSim is not installed")
        for name, draw, knobs in tried:
            for knob in knobs:
                error = np.abs(grey(draw(knob)) - grey(expected)).max()
                if error <= bound:
                    taken = seconds(lambda draw=draw, knob=knob: draw(knob))
                    print(f"  {name} {knob:g}: {taken * 1e6:.0f} us, {error:.4f} off: {taken / of_vocc:.0f} times as long")
                    break
            else:
                print(f"  {name} up to {knobs[-1]:g}: {error:.4f} off, more than that")


def reference_of(renderer: vocc.Renderer) -> Picture:
    """The same region at the reference level."""
    whole = vocc.render(SCENE, bits=BITS, level="reference", linear=True)
    (x, y), (height, width) = renderer.origin_px, renderer.shape
    return whole[y : y + height, x : x + width]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", help="the program that evaluations are compared with")
    parser.add_argument("--rounds", type=int, default=9, help="turns of program and package")
    parser.add_argument("--frames", type=int, default=200_000, help="frames of an evaluation, and of all batches but the first")
    arguments = parser.parse_args()
    if arguments.program:
        evaluations(arguments.program, arguments.rounds, arguments.frames)
    batches(max(arguments.frames // 4, 1000))
    pictures()


if __name__ == "__main__":
    main()
