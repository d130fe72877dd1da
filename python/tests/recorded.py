"""A film, what `vocc receive --json` prints of it, and its recording."""

import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

START_NS = 1_800_000_000_250_000_000
PERIOD_NS = 10_000_000
FRAMES = 230
FRAME_ID = "front_camera"
MESSAGE = b"Braking hard: queue behind the bend \xff, 200 m ahead"
DEAD_LEDS = [9, 40]
FOCAL_PX = 3636.4
DISTORTION = [0.01, -0.002, 0.0001, 0.0002, 0.003]


def rotation_of(x: float, y: float, z: float, w: float) -> np.ndarray:
    """The matrix of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def values(status: Any) -> dict[str, str]:
    """The values of a status, by their keys."""
    return {value.key: value.value for value in status.values}


class Recorded:
    """A film, what was printed of it, and its recording. Two LEDs are dead, and the panel is hidden for a while."""

    def __init__(self, folder: Path, program: Path, vocc_json: Callable[..., list[dict[str, Any]]]) -> None:
        self.film, self.path = folder / "film", folder / "film.mcap"
        message, camera = folder / "message", folder / "camera.toml"
        message.write_bytes(MESSAGE)
        scene = [f"--set={key}" for key in ("camera.width_px=320", "camera.height_px=240", f"panel.dead_leds={DEAD_LEDS}")]
        vocc_json("link", "day", *scene, "--message-file", message, "--frames", FRAMES, "--save", self.film)
        files = sorted(self.film.glob("*.png"))
        for number in range(120, 160):
            cv2.imwrite(str(files[number]), np.full((240, 320), 118, np.uint8))
        camera.write_text(f"focal_px = {FOCAL_PX}\ndistortion = {DISTORTION}\n")
        done = subprocess.run(
            [program, "receive", self.film, "--bits", "--json", "--mcap", self.path, "--start", f"{START_NS // 10**9}.25"]
            + ["--frame-id", FRAME_ID, "--camera", camera, "--interval", "1", "--led-diameter", "0.03"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        self.files, self.lost = files, re.findall(r"^frame (\d+): (.*)$", done.stderr, re.MULTILINE)
        rows = [json.loads(line) for line in done.stdout.splitlines()]
        self.readings = [row for row in rows if "bits" in row]
        self.messages = [row for row in rows if "message" in row]
        [self.camera] = [row["camera"] for row in rows if "camera" in row and "message" not in row]
