"""Images of sensor_msgs as arrays that vocc.Receiver takes."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

# Of any class with the fields of its ROS message: that of rclpy, of rosbags, or of a test.
Message: TypeAlias = Any
Array: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]


class UnsupportedImage(ValueError):
    """An unreadable image: the reason, and a remedy."""


# The places of blue, green and red in a pixel: slices, because other indices copy the image.
BLUE_FIRST, RED_FIRST = slice(0, 3), slice(2, None, -1)
# Samples of a pixel, and the order of blue, green and red.
COLOURS = {
    "bgr8": (3, BLUE_FIRST),
    "8UC3": (3, BLUE_FIRST),
    "rgb8": (3, RED_FIRST),
    "bgra8": (4, BLUE_FIRST),
    "8UC4": (4, BLUE_FIRST),
    "rgba8": (4, RED_FIRST),
}
GREY = ("mono8", "8UC1")
DEEP = ("mono16", "16UC1")
# The index of the brightness among two bytes.
YUV = {"uyvy": 1, "yuv422": 1, "yuyv": 0, "yuv422_yuy2": 0}
# OpenCV names a mosaic by its second row and column.
BAYER = {
    "bayer_rggb8": "COLOR_BayerBG2BGR",
    "bayer_bggr8": "COLOR_BayerRG2BGR",
    "bayer_gbrg8": "COLOR_BayerGR2BGR",
    "bayer_grbg8": "COLOR_BayerGB2BGR",
}
ENCODINGS = (*GREY, *DEEP, *COLOURS, *YUV, *BAYER)


def rows(message: Message, samples: int, depth: type[np.uint8] | type[np.uint16]) -> NDArray[Any]:
    """The samples of an image, of shape (height, width, samples), without the padding of its rows."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    kind = np.dtype(depth)
    row = width * samples * kind.itemsize
    data = np.frombuffer(message.data, np.uint8)
    if not height or step < row or len(data) < step * (height - 1) + row:
        raise UnsupportedImage(
            f"an image of {width} x {height} pixels, {message.encoding!r}, has rows of {step} bytes and {len(data)} in all, and needs "
            f"{row} and {row * height}: the driver fills in a wrong size"
        )
    pixels: NDArray[Any] = np.ndarray((height, row), np.uint8, buffer=data, strides=(step, 1))
    if kind.itemsize > 1:
        kind = kind.newbyteorder(">" if message.is_bigendian else "<")
    return pixels.view(kind).astype(depth, copy=False).reshape(height, width, samples)


def opencv(what: str) -> Any:
    """OpenCV, which decodes what NumPy alone cannot."""
    try:
        import cv2
    except ImportError:
        raise UnsupportedImage(f"{what} needs OpenCV: install python3-opencv, or subscribe to mono8, bgr8 or rgb8") from None
    return cv2


def of_image(message: Message) -> Array:
    """The pixels of a sensor_msgs/Image: grey of 8 or 16 bits, or blue, green and red.

    Raises UnsupportedImage for another encoding, and for contradictory sizes.
    """
    encoding = str(message.encoding)
    if encoding in GREY:
        return np.ascontiguousarray(rows(message, 1, np.uint8)[..., 0])
    if encoding in DEEP:
        return np.ascontiguousarray(rows(message, 1, np.uint16)[..., 0])
    if encoding in COLOURS:
        samples, order = COLOURS[encoding]
        return np.ascontiguousarray(rows(message, samples, np.uint8)[..., order])
    if encoding in YUV:
        return np.ascontiguousarray(rows(message, 2, np.uint8)[..., YUV[encoding]])
    if encoding in BAYER:
        cv2 = opencv(f"a mosaic of {encoding}")
        mosaic = np.ascontiguousarray(rows(message, 1, np.uint8)[..., 0])
        colours: NDArray[np.uint8] = cv2.cvtColor(mosaic, getattr(cv2, BAYER[encoding]))
        return colours
    raise UnsupportedImage(
        f"images of encoding {encoding!r} are not read: publish one of {', '.join(ENCODINGS)}; image_proc or cv_bridge converts others"
    )


def of_compressed(message: Message) -> Array:
    """The pixels of a sensor_msgs/CompressedImage: JPEG, PNG or another format that OpenCV reads.

    Raises UnsupportedImage for other data, such as compressed depth or a film's.
    """
    cv2 = opencv("a compressed image")
    decode: Callable[..., Any] = cv2.imdecode
    data = np.frombuffer(message.data, np.uint8)
    try:
        image = decode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
    except cv2.error:
        image = None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise UnsupportedImage(f"a compressed image of format {str(message.format)!r} is not read: publish jpeg or png")
    if image.ndim == 3:
        if image.dtype != np.uint8:
            raise UnsupportedImage(f"a compressed image of format {str(message.format)!r} has colours of 16 bits: publish bgr8 or mono16")
        image = image[..., :3]
    return np.ascontiguousarray(image)
