"""Typical code of users, for the type checker."""

import numpy as np
from numpy.typing import NDArray

import vocc

scene: vocc.Scene = vocc.Scene("night", distance_m=70)
names: list[str] = [decision.effect for decision in scene.plan() if decision.included]
image: NDArray[np.uint8] = vocc.render(scene, bits=1, level="fast")
for frame in vocc.frames(scene, 3):
    whole: NDArray[np.bool_] = frame.bits
for batch in vocc.frames(scene, 3, batch=2):
    first: int = batch.first
found: vocc.Evaluation = vocc.evaluate(scene, frames=100, progress=print)
low: float = found.ber_95[0]


def brighter(frames: vocc.DetectorInput) -> NDArray[np.float32]:
    soft: NDArray[np.float32] = frames.features[..., 0] - 1
    return soft


own: vocc.Evaluation = vocc.evaluate(scene, frames=100, detector=brighter, by_frame=True, batch=50)
if own.errors_by_frame is not None:
    worst: int = int(own.errors_by_frame.max())
receiver = vocc.Receiver({"focal_px": 3636.4}, fps=30)
texts: list[str] = [message.text for message in receiver.feed(image).messages]
learnt: vocc.LearntCamera | None = receiver.camera
decoded = vocc.decode(image, corners=[[1, 1], [9, 1], [9, 9], [1, 9]])
if decoded.bits is not None:
    word: str = vocc.as_hex(decoded.bits)
ratio: float = vocc.optimize(scene, intervals=[1]).table.l2a(50, 1)
