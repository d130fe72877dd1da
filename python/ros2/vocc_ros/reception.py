"""The receiver of image topics, without rclpy: ROS messages in, ROS messages with their topics out.

>>> from vocc_ros.reception import PARAMETERS
>>> PARAMETERS["detector"].default
'best'
"""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import vocc
from vocc_ros.images import Array, Message, UnsupportedImage, of_compressed, of_image

SECOND_NS = 1_000_000_000
# Maximum number of logged faults.
FAULTS = 50
# The number of first images, from which the rate is measured, and their maximum size in bytes.
FIRST = 16
FIRST_BYTES = 128 << 20
# Stamps within this time of the node's clock are of that clock, in seconds.
SAME_CLOCK_S = 60.0
# The attributes of a vocc.Camera that a calibration has.
LENS = ("focal_px", "principal_px", "distortion")
# The coefficients of each distortion model that is read.
DISTORTION = {"plumb_bob": 5, "rational_polynomial": 8}


@dataclass(frozen=True)
class Parameter:
    """A parameter of the node: its default and its description."""

    default: str | float | int | bool
    about: str


# Named as the arguments of vocc.Receiver; ROS has no None, so -1 or an empty text replaces it.
PARAMETERS = {
    "fps": Parameter(-1.0, "frames a second of the camera; -1: measured from the stamps of the first images"),
    "symbol_rate": Parameter(-1.0, "symbols a second of the transmitter; -1: 90, and other usual rates are tried"),
    "detector": Parameter("best", "best, ml, kmeans, kmeans-raw or otsu"),
    "panels": Parameter(1, "panels to follow at once, 1 to 4"),
    "channel": Parameter("brightest", "brightest, red, green, blue or grey"),
    "depth": Parameter(-1, "bits of 16-bit samples, 9 to 16; -1: by their values"),
    "interval": Parameter(-1.0, "gap between two LEDs over their diameter; -1: as the panel says"),
    "led_diameter_m": Parameter(-1.0, "diameter of an LED in metres; -1: as the panel says"),
    "trust": Parameter("", "a file of public keys: only messages that one of them signed are published; empty: all, unchecked"),
    "counters": Parameter("", "a file that keeps the greatest counter of each key; empty: in memory only"),
    "encoding": Parameter("", "the camera's: linear, srgb, rec709, or gamma's number; empty: learnt"),
    "rectified": Parameter(False, "whether images are rectified: then CameraInfo's P is used, without distortion"),
}


@dataclass(frozen=True)
class Types:
    """The classes of messages that are published, and how their fields are filled: rclpy has bytes for a byte, others a number."""

    Time: Callable[..., Message]
    Header: Callable[..., Message]
    String: Callable[..., Message]
    UInt8MultiArray: Callable[..., Message]
    MultiArrayLayout: Callable[..., Message]
    PoseWithCovarianceStamped: Callable[..., Message]
    PoseWithCovariance: Callable[..., Message]
    Pose: Callable[..., Message]
    Point: Callable[..., Message]
    Quaternion: Callable[..., Message]
    DiagnosticArray: Callable[..., Message]
    DiagnosticStatus: Callable[..., Message]
    KeyValue: Callable[..., Message]
    byte: Callable[[int], Any]
    octets: Callable[[bytes], Any]


@dataclass(frozen=True)
class Publication:
    """A message for a topic."""

    topic: str
    message: Message


def topics(panels: int) -> dict[str, str]:
    """The topics that are published, each with the name of its type."""
    of_panels = {}
    for panel in range(panels):
        of_panels[f"panel_{panel}/message"] = "String"
        of_panels[f"panel_{panel}/message_bytes"] = "UInt8MultiArray"
        of_panels[f"panel_{panel}/pose"] = "PoseWithCovarianceStamped"
    return {**of_panels, "/diagnostics": "DiagnosticArray"}


def settings_of(parameters: dict[str, Any]) -> dict[str, Any]:
    """The arguments of vocc.Receiver for the node's parameters, all but the camera.

    Raises VoccError of what is out of its range.
    """
    settings: dict[str, Any] = {"detector": str(parameters["detector"]), "channel": str(parameters["channel"])}
    settings["panels"] = number("panels", parameters["panels"], int, 0)
    for name in ("fps", "symbol_rate", "interval", "led_diameter_m"):
        value = number(name, parameters[name], float, -1)
        settings[name] = None if value == -1 else value
    depth = number("depth", parameters["depth"], int, -1)
    settings["depth"] = None if depth == -1 else depth
    for name in ("trust", "counters"):
        settings[name] = str(parameters[name]) or None
    settings["only_trusted"] = settings["trust"] is not None
    # Reject them now rather than with the first image.
    vocc.Receiver(camera_of(parameters, None), **settings).close()
    return settings


Number = TypeVar("Number", int, float)


def number(name: str, value: Any, kind: type[Number], least: int) -> Number:
    """A parameter as a number of at least that."""
    try:
        told = kind(value)
    except (TypeError, ValueError, OverflowError):
        told = kind(least - 1)
    if not (told == value and told >= least and (kind is float or told <= 255)):
        raise vocc.VoccError(f"{name} = {value!r}: give a {'whole ' if kind is int else ''}number, {least} or more")
    return told


def camera_of(parameters: dict[str, Any], lens: "Lens | None") -> dict[str, Any]:
    """The attributes of vocc.Camera that parameters and a calibration give."""
    told = str(parameters["encoding"])
    camera: dict[str, Any] = {}
    if told:
        try:
            camera["encoding"] = float(told)
        except ValueError:
            camera["encoding"] = told
    if lens is not None:
        camera |= {"focal_px": list(lens.focal_px), "principal_px": list(lens.principal_px), "distortion": list(lens.distortion)}
    return camera


@dataclass(frozen=True)
class Lens:
    """A calibration for images of a width and a height."""

    size: tuple[int, int]
    focal_px: tuple[float, float]
    principal_px: tuple[float, float]
    distortion: tuple[float, ...]


def lens_of(info: Message, *, rectified: bool = False) -> Lens | None:
    """The calibration of a sensor_msgs/CameraInfo, for its region of interest and binning as image_geometry reads them; None of a camera
    that is not calibrated, whose K or P begins with 0.

    Raises VoccError of a distortion model that is not read.
    """
    matrix, stride = (info.p, 4) if rectified else (info.k, 3)
    focal = (float(matrix[0]), float(matrix[stride + 1]))
    if focal[0] == 0.0:
        return None
    distortion: tuple[float, ...] = ()
    if not rectified and any(float(term) != 0.0 for term in info.d):
        model = str(info.distortion_model)
        if model not in DISTORTION:
            raise vocc.VoccError(
                f"distortion model {model!r} is not read: rectify the images and set rectified, or calibrate with {' or '.join(DISTORTION)}"
            )
        distortion = tuple(float(term) for term in info.d)[: DISTORTION[model]]
        if len(distortion) < DISTORTION[model]:
            raise vocc.VoccError(f"distortion model {model} has {len(distortion)} coefficients, not {DISTORTION[model]}: calibrate anew")
    binning = [int(side) or 1 for side in (info.binning_x, info.binning_y)]
    roi = info.roi
    region = [int(roi.width) or int(info.width), int(roi.height) or int(info.height)]
    offset = [int(roi.x_offset), int(roi.y_offset)]
    centre = (float(matrix[2]), float(matrix[stride + 2]))
    along_x, along_y = (
        (size // by, scale / by, (middle - begin) / by)
        for size, by, scale, middle, begin in zip(region, binning, focal, centre, offset, strict=True)
    )
    return Lens((along_x[0], along_y[0]), (along_x[1], along_y[1]), (along_x[2], along_y[2]), distortion)


def quaternion(rotation: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """x, y, z and w of a rotation matrix, by the largest of the four (Shepperd 1978)."""
    trace = float(np.trace(rotation))
    diagonal = [float(rotation[k, k]) for k in range(3)]
    largest = max(range(4), key=lambda k: [*diagonal, trace][k])
    if largest == 3:
        w = 0.5 * math.sqrt(1.0 + trace)
        x, y, z = ((float(rotation[b, a]) - float(rotation[a, b])) / (4 * w) for a, b in ((1, 2), (2, 0), (0, 1)))
        return x, y, z, w
    i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
    part = [0.0] * 3
    part[i] = 0.5 * math.sqrt(max(0.0, 1.0 + 2.0 * diagonal[i] - trace))
    part[j] = (float(rotation[j, i]) + float(rotation[i, j])) / (4 * part[i])
    part[k] = (float(rotation[k, i]) + float(rotation[i, k])) / (4 * part[i])
    return part[0], part[1], part[2], (float(rotation[k, j]) - float(rotation[j, k])) / (4 * part[i])


def stamp_ns(header: Message) -> int:
    return int(header.stamp.sec) * SECOND_NS + int(header.stamp.nanosec)


@dataclass
class Clock:
    """Numbers images by their stamps: cameras drop frames, and their rates vary."""

    fps: float
    begin_ns: int = 0
    last_ns: int | None = None
    last: int = -1

    def number(self, time_ns: int) -> tuple[int, float]:
        """An image's frame number, which rises, and how many periods later than that it was taken.

        A stamp that does not rise, as when a bag begins again, is a period after the image before.
        """
        following = self.last + 1
        if self.last_ns is None or time_ns <= self.last_ns:
            self.begin_ns = time_ns - round(following / self.fps * SECOND_NS)
        periods = (time_ns - self.begin_ns) / SECOND_NS * self.fps
        self.last = max(following, round(periods))
        self.last_ns = time_ns
        return self.last, periods - self.last


@dataclass(frozen=True)
class Held:
    """A received image."""

    pixels: Array
    header: Message

    @property
    def size(self) -> tuple[int, int]:
        """Its width and height."""
        return self.pixels.shape[1], self.pixels.shape[0]


class ImageReceiver:
    """Receives a topic's images; returns messages to publish.

    `now_ns` is the node's clock; `log` takes "error", "warn" or "info", and a text. Each fault is logged once, not with each image.
    """

    def __init__(
        self, parameters: dict[str, Any], types: Types, now_ns: Callable[[], int], log: Callable[[str, str], object]
    ) -> None:
        self.parameters = {name: parameter.default for name, parameter in PARAMETERS.items()} | parameters
        unknown = self.parameters.keys() - PARAMETERS.keys()
        if unknown:
            raise vocc.VoccError(f"{', '.join(sorted(unknown))}: there are {', '.join(PARAMETERS)}")
        self.settings = settings_of(self.parameters)
        self.types = types
        self.now_ns = now_ns
        self.log = log
        self.lens: Lens | None = None
        self.held: list[Held] = []
        self.receiver: vocc.Receiver | None = None
        self.clock: Clock | None = None
        self.size = (0, 0)
        self.faults: set[str] = set()
        self.unusable = 0
        self.why_unusable = ""
        self.frame_id = ""
        self.last_came_ns: int | None = None

    def image(self, message: Message) -> list[Publication]:
        """Processes a sensor_msgs/Image."""
        return self._take(message, of_image)

    def compressed(self, message: Message) -> list[Publication]:
        """Processes a sensor_msgs/CompressedImage."""
        return self._take(message, of_compressed)

    def camera_info(self, info: Message) -> None:
        """Processes a sensor_msgs/CameraInfo. If it is new, the receiver restarts with it, and with the learnt camera."""
        try:
            lens = lens_of(info, rectified=bool(self.parameters["rectified"]))
            vocc.Camera(**camera_of(self.parameters, lens))
        except ValueError as why:
            self._once("error", f"no poses: {why}")
            lens = None
        if lens != self.lens:
            self.lens = lens
            if self.receiver is not None:
                self.log("info", "the calibration is new: the receiver begins anew")
                self._begin(self.size)

    def silence(self) -> list[Publication]:
        """Returns messages to publish while no readable image arrives; call it once a second."""
        now_ns = self.now_ns()
        stamp = self.types.Time(sec=now_ns // SECOND_NS, nanosec=now_ns % SECOND_NS)
        header = self.types.Header(stamp=stamp, frame_id=self.frame_id)
        if self.last_came_ns is None:
            return [self._camera_error("no image has come yet: is the topic right?", header)]
        if self.unusable:
            return [self._camera_error(self.why_unusable, header)]
        if self.receiver is None:
            return []
        report = self.receiver.diagnose_silence(max(0, now_ns - self.last_came_ns) / SECOND_NS)
        return list(self._diagnostics(report, header))

    def finish(self) -> list[Publication]:
        """Ends; returns the messages that the last symbol completes."""
        publications = []
        if self.receiver is None and self.held:
            publications += self._begin_with_held()
        if self.receiver is not None and not self.receiver.closed:
            for message in self.receiver.finish():
                publications += self._message(message)
        return publications

    def _take(self, message: Message, convert: Callable[[Message], Array]) -> list[Publication]:
        self.last_came_ns = self.now_ns()
        self.frame_id = str(message.header.frame_id)
        try:
            pixels = convert(message)
        except UnsupportedImage as why:
            return self._unusable(str(why), message.header)
        held = Held(pixels, message.header)
        if self.receiver is not None:
            return self._feed(held)
        self.held.append(held)
        is_enough = len(self.held) >= FIRST or sum(held.pixels.nbytes for held in self.held) >= FIRST_BYTES
        if self.settings["fps"] is None and not is_enough:
            return []
        return self._begin_with_held()

    def _begin_with_held(self) -> list[Publication]:
        held, self.held = self.held, []
        steps = np.diff([stamp_ns(one.header) for one in held])
        steps = steps[steps > 0]
        fps: float | None = self.settings["fps"]
        if fps is None and not len(steps):
            self._once("warn", "images have no stamps that rise: 100 a second are assumed; set fps, or let the driver stamp them")
        elif fps is None:
            fps = SECOND_NS / float(np.median(steps))
            self.log("info", f"the camera takes {fps:.2f} images a second")
        self.clock = Clock(fps or 100.0)
        try:
            self._begin(held[0].size)
        except ValueError as why:
            # Everything but the measured rate was checked before.
            return self._unusable(f"the stamps of images are {1e3 / self.clock.fps:.3g} ms apart: {why}", held[-1].header)
        return [publication for one in held for publication in self._feed(one)]

    def _begin(self, size: tuple[int, int]) -> None:
        """Begins with a new receiver, for images of a width and a height."""
        assert self.clock is not None
        lens = self.lens
        if lens is not None and lens.size != size:
            told, seen = (f"{width} x {height}" for width, height in (lens.size, size))
            self._once("error", f"no poses: the calibration is of {told} pixels, and images have {seen}: calibrate the camera at this size")
            lens = None
        camera = camera_of(self.parameters, lens)
        if self.receiver is not None:
            learnt = self.receiver.camera
            if learnt is not None:
                # Its lens was that of the previous calibration.
                camera = {name: value for name, value in learnt.camera.to_dict().items() if name not in LENS} | camera
            self.receiver.close()
        self.receiver = vocc.Receiver(camera, **{**self.settings, "fps": self.clock.fps})
        self.size = size

    def _feed(self, held: Held) -> list[Publication]:
        assert self.clock is not None and self.receiver is not None
        pixels, header = held.pixels, held.header
        size = held.size
        if self.size != size:
            self.log("info", f"images are now of {size[0]} x {size[1]} pixels: the receiver begins anew")
            self._begin(size)
        before = self.clock.last
        number, late = self.clock.number(stamp_ns(header))
        try:
            received = self.receiver.feed(pixels, frame=number, late=late)
        except ValueError as why:
            return self._unusable(str(why), header)
        publications: list[Publication] = []
        for message in received.messages:
            publications += self._message(message)
        for reading in received.readings:
            if reading.pose is not None:
                publications.append(Publication(f"panel_{reading.panel}/pose", self._pose(reading.pose, header)))
        report = self.receiver.diagnose(
            max(0, stamp_ns(header)) / SECOND_NS,
            latency_s=self._latency_s(header),
            dropped=number - before - 1,
            unusable=self.unusable,
        )
        self.unusable = 0
        return [*publications, *self._diagnostics(report, header)]

    def _latency_s(self, header: Message) -> float | None:
        """The time since an image was taken, if its stamp is of the node's clock."""
        latency_s = (self.now_ns() - stamp_ns(header)) / SECOND_NS
        return max(0.0, latency_s) if abs(latency_s) <= SAME_CLOCK_S else None

    def _unusable(self, why: str, header: Message) -> list[Publication]:
        self._once("error", why)
        self.unusable += 1
        self.why_unusable = why
        # The receiver counts it with the next readable image.
        return [self._camera_error(why, header)] if self.unusable == 1 else []

    def _camera_error(self, why: str, header: Message) -> Publication:
        values = [self.types.KeyValue(key="frames_unusable_since", value=str(self.unusable))]
        status = self._status(2, "vocc: camera", why, str(header.frame_id), values)
        return Publication("/diagnostics", self.types.DiagnosticArray(header=header, status=[status]))

    def _once(self, level: str, text: str) -> None:
        """Logs a fault, unless it was logged with any numbers."""
        fault = re.sub(r"\d+", "0", text)
        if fault not in self.faults and len(self.faults) < FAULTS:
            self.faults.add(fault)
            self.log(level, text)

    def _message(self, message: vocc.Message) -> Iterator[Publication]:
        layout = self.types.MultiArrayLayout(dim=[], data_offset=0)
        data = self.types.octets(bytes(message.data))
        yield Publication(f"panel_{message.panel}/message", self.types.String(data=message.text))
        yield Publication(f"panel_{message.panel}/message_bytes", self.types.UInt8MultiArray(layout=layout, data=data))

    def _pose(self, pose: vocc.Pose, header: Message) -> Message:
        types = self.types
        place = dict(zip("xyz", map(float, pose.translation_m), strict=True))
        turn = dict(zip("xyzw", quaternion(pose.rotation), strict=True))
        at = types.Pose(position=types.Point(**place), orientation=types.Quaternion(**turn))
        covariance = types.PoseWithCovariance(pose=at, covariance=np.asarray(pose.covariance, np.float64).reshape(36))
        return types.PoseWithCovarianceStamped(header=header, pose=covariance)

    def _status(self, level: int, name: str, message: str, hardware_id: str, values: list[Message]) -> Message:
        return self.types.DiagnosticStatus(
            level=self.types.byte(level), name=name, message=message, hardware_id=hardware_id, values=values
        )

    def _diagnostics(self, report: list[vocc.Status] | None, header: Message) -> Iterator[Publication]:
        if report is None:
            return
        statuses = []
        for status in report:
            values = [self.types.KeyValue(key=key, value=value) for key, value in status.values.items()]
            hardware_id = str(header.frame_id) if status.name == "vocc: camera" else status.hardware_id
            statuses.append(self._status(status.level, status.name, status.message, hardware_id, values))
        yield Publication("/diagnostics", self.types.DiagnosticArray(header=header, status=statuses))
