"""Finished calls leave no memory allocated. VOCC_TEST_CASES=all makes a million of each short call."""

import gc
import itertools
import os
from collections.abc import Callable

import numpy as np
import psutil
import pytest

import vocc

CALLS = 1_000_000 if os.environ.get("VOCC_TEST_CASES") == "all" else 5_000
# Memory that Python's own allocator and the C library may keep in any case.
LEEWAY_BYTES = 3 << 20

image = np.full((40, 40), 118, np.uint8)
renderer = vocc.Renderer(vocc.Scene("paper", distance_m=200), level="fast", crop=True)
receiver = vocc.Receiver(detector="kmeans")
seconds = itertools.count(1)
scene = vocc.Scene("night")
table = vocc.Table()


def refused() -> None:
    try:
        vocc.as_hex("no bits")
    except vocc.VoccError:
        pass


def fed() -> None:
    receiver.feed(image).to_dict()


SHORT: dict[str, Callable[[], object]] = {
    "as_bits": lambda: vocc.as_bits(5),
    "refused": refused,
    "transmit": lambda: vocc.transmit("Ice", count=3),
    "flicker": lambda: vocc.flicker("Ice", carrier_cycles=16).to_dict(),
    "render": lambda: renderer.render(5),
    "look up": lambda: (table.l2a(50, 1), table.ratios),
    "camera": lambda: vocc.Camera(encoding="srgb").to_dict(),
    "feed": fed,
    "diagnose": lambda: receiver.diagnose(next(seconds)),
    "scene": lambda: scene.with_(distance_m=60).to_dict(),
}
LONG: dict[str, Callable[[], object]] = {
    "decode": lambda: vocc.decode(image, detector="kmeans"),
    "evaluate": lambda: vocc.evaluate("paper", frames=1, threads=1),
    "own detector": lambda: vocc.evaluate("paper", frames=2, threads=1, detector=lambda frames: frames.features[..., 0] - 1, by_frame=True),
    "frames": lambda: list(vocc.frames("paper", 2, batch=1)),
    "receiver": lambda: vocc.Receiver(detector="kmeans").feed(image),
}


def growth(call: Callable[[], object], calls: int) -> int:
    """Growth of the process, in bytes, between the first half of the calls and the second."""
    memory = psutil.Process().memory_info
    sizes = []
    for _ in range(2):
        for _ in range(calls // 2):
            call()
        gc.collect()
        sizes.append(memory().rss)
    return sizes[1] - sizes[0]


@pytest.mark.parametrize("name", SHORT)
def test_short_calls_leave_nothing_behind(name: str) -> None:
    grown = growth(SHORT[name], CALLS)
    print(f"{name}: {CALLS} calls, {grown / 1024:.0f} kB more after the second half of them")
    assert grown < LEEWAY_BYTES


@pytest.mark.parametrize("name", LONG)
def test_long_calls_leave_nothing_behind(name: str) -> None:
    calls = max(CALLS // 1000, 40)
    grown = growth(LONG[name], calls)
    print(f"{name}: {calls} calls, {grown / 1024:.0f} kB more after the second half of them")
    assert grown < LEEWAY_BYTES
