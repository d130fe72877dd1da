"""Optical camera communication between vehicles: the simulator and the receiver.

One vehicle carries a panel of 8x8 LEDs, the other a camera that reads it. Images are NumPy arrays of shape (height, width), (0, 0) is the
centre of the top-left pixel, x points right and y down; the bits of a panel are bool arrays of shape (8, 8), row 0 at the top as the camera
sees it. Names carry their units: distance_m, illuminance_lx, centre_px.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from ._vocc import (
    Batch,
    Camera,
    Decision,
    Decoded,
    DetectorInput,
    Evaluation,
    Flicker,
    Frame,
    Frames,
    LearntCamera,
    Loss,
    Message,
    Optimization,
    Optimum,
    Pose,
    Proof,
    Reading,
    Received,
    Receiver,
    Renderer,
    Scene,
    Status,
    Table,
    TableEntry,
    VoccError,
    __version__,
    as_bits,
    as_hex,
    decode,
    evaluate,
    flicker,
    frames,
    optimize,
    render,
    transmit,
)

__all__ = [
    "Batch",
    "Camera",
    "Decision",
    "Decoded",
    "DetectorInput",
    "Evaluation",
    "Flicker",
    "Frame",
    "Frames",
    "LearntCamera",
    "Loss",
    "Message",
    "Optimization",
    "Optimum",
    "Pose",
    "Proof",
    "Reading",
    "Received",
    "Receiver",
    "Renderer",
    "Scene",
    "Status",
    "Table",
    "TableEntry",
    "VoccError",
    "__version__",
    "as_bits",
    "as_hex",
    "decode",
    "evaluate",
    "flicker",
    "frames",
    "optimize",
    "receive",
    "render",
    "transmit",
]


def receive(images: Iterable[Any], **settings: Any) -> Iterator[Message]:
    """Yields the messages of successive images, each as soon as it is complete; settings are those of Receiver.

    >>> import vocc
    >>> renderer = vocc.Renderer("paper", level="fast", crop=True)
    >>> film = (renderer.render(bits) for bits in vocc.transmit("Ice", count=8))
    >>> [message.text for message in vocc.receive(film, symbol_rate=100)]
    ['Ice']
    """
    receiver = Receiver(**settings)
    for image in images:
        yield from receiver.feed(image).messages
    yield from receiver.finish()
