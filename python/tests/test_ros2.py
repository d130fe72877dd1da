"""The package for ROS 2, without ROS 2: messages are of rosbags' classes and of stand-ins, and so is what the node needs of rclpy.

No installation of ROS 2 runs here.
"""

import compileall
import importlib
import re
import subprocess
import sys
import types
import xml.etree.ElementTree as ElementTree
from array import array
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from recorded import FRAME_ID, FRAMES, MESSAGE, PERIOD_NS, START_NS, Recorded, rotation_of, values
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from signers import write_key
from vocc_ros.images import ENCODINGS, UnsupportedImage, of_compressed, of_image
from vocc_ros.reception import PARAMETERS, Clock, ImageReceiver, Publication, Types, lens_of, quaternion, topics

import vocc

FOLDER = Path(__file__).parents[1] / "ros2"
STORE = get_typestore(Stores.ROS2_HUMBLE)
PACKAGES = {
    "builtin_interfaces": ["Time"],
    "std_msgs": ["Header", "String", "UInt8MultiArray", "MultiArrayLayout"],
    "geometry_msgs": ["PoseWithCovarianceStamped", "PoseWithCovariance", "Pose", "Point", "Quaternion"],
    "diagnostic_msgs": ["DiagnosticArray", "DiagnosticStatus", "KeyValue"],
    "sensor_msgs": ["Image", "CompressedImage", "CameraInfo"],
}
CLASSES = {name: STORE.types[f"{package}/msg/{name}"] for package, names in PACKAGES.items() for name in names}
PUBLISHED = {name: CLASSES[name] for package, names in PACKAGES.items() if package != "sensor_msgs" for name in names}
TYPES = Types(**PUBLISHED, byte=int, octets=lambda data: np.frombuffer(data, np.uint8))


class Log:
    def __init__(self) -> None:
        self.lines: list[tuple[str, str]] = []

    def __call__(self, level: str, text: str) -> None:
        self.lines.append((level, text))

    def of(self, level: str) -> list[str]:
        return [text for found, text in self.lines if found == level]


def receiver_of(log: Log, now_ns: int = 0, **parameters: Any) -> ImageReceiver:
    return ImageReceiver(parameters, TYPES, lambda: now_ns, log)


def header(time_ns: int, frame_id: str = "front") -> Any:
    return CLASSES["Header"](stamp=CLASSES["Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9), frame_id=frame_id)


def image(pixels: np.ndarray, encoding: str = "mono8", *, time_ns: int = 0, padding: int = 0, is_bigendian: int = 0) -> Any:
    """A message as rclpy has it: its data are an array.array."""
    height, width = pixels.shape[:2]
    data = np.ascontiguousarray(pixels).view(np.uint8).reshape(height, -1)
    data = np.pad(data, [(0, 0), (0, padding)], constant_values=77)
    return SimpleNamespace(
        header=header(time_ns),
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=is_bigendian,
        step=data.shape[1],
        data=array("B", data.tobytes()),
    )


def camera_info(focal_px: float, size: tuple[int, int] = (320, 240), **fields: Any) -> Any:
    roi = SimpleNamespace(x_offset=0, y_offset=0, width=0, height=0, do_rectify=False)
    centre = [(side - 1) / 2 for side in size]
    usual = dict(width=size[0], height=size[1], distortion_model="plumb_bob", d=[0.0] * 5, binning_x=0, binning_y=0, roi=roi)
    usual["k"] = [focal_px, 0.0, centre[0], 0.0, focal_px, centre[1], 0.0, 0.0, 1.0]
    usual["p"] = [focal_px, 0.0, centre[0], 0.0, 0.0, focal_px, centre[1], 0.0, 0.0, 0.0, 1.0, 0.0]
    return SimpleNamespace(**(usual | fields))


def film(message: str, count: int = 30, *, sign: Path | None = None, **scene: Any) -> list[np.ndarray]:
    renderer = vocc.Renderer(vocc.Scene("paper", **{"camera.width_px": 320, "camera.height_px": 240} | scene), level="fast")
    counter = None if sign is None else 1
    return [renderer.render(bits) for bits in vocc.transmit(message, count=count, sign=sign, counter=counter)]


def of_topic(publications: list[Publication], topic: str) -> list[Any]:
    return [publication.message for publication in publications if publication.topic == topic]


def checked(publications: list[Publication]) -> list[Publication]:
    """Publications, each of which ROS's own type can carry."""
    kinds = topics(4)
    for publication in publications:
        [kind] = [f"{package}/msg/{name}" for package, names in PACKAGES.items() for name in names if name == kinds[publication.topic]]
        data = STORE.serialize_cdr(publication.message, kind)
        assert bytes(STORE.serialize_cdr(STORE.deserialize_cdr(data, kind), kind)) == bytes(data)
    return publications


def fields(status: Any) -> tuple[Any, ...]:
    values = [(value.key, value.value) for value in status.values]
    return (status.level, status.name, status.message, status.hardware_id, values)


def test_a_recording_that_is_played_gives_what_was_recorded(recorded: Recorded) -> None:
    """All topics of the node beside those that the program has written of the same frames."""
    log = Log()
    receiver = receiver_of(log, interval=1, led_diameter_m=0.03)
    publications: list[Publication] = []
    written: dict[str, list[Any]] = {}
    with AnyReader([recorded.path]) as reader:
        for connection, _, data in reader.messages():
            content = reader.deserialize(data, connection.msgtype)
            written.setdefault(connection.topic, []).append(content)
            if connection.topic == "/camera/camera_info":
                receiver.camera_info(content)
            if connection.topic == "/camera/image":
                publications += receiver.compressed(content)
    publications = checked(publications + receiver.finish())
    assert log.lines == [("info", "the camera takes 100.00 images a second")]
    poses, expected = of_topic(publications, "panel_0/pose"), written["/panel_0/pose"]
    assert len(poses) == len(expected) > 100
    for pose, other in zip(poses, expected, strict=True):
        assert pose.header.frame_id == other.header.frame_id == FRAME_ID
        assert (pose.header.stamp.sec, pose.header.stamp.nanosec) == (other.header.stamp.sec, other.header.stamp.nanosec)
        assert np.allclose(pose.pose.covariance, other.pose.covariance, rtol=1e-9)
        for axis in "xyz":
            assert getattr(pose.pose.pose.position, axis) == pytest.approx(getattr(other.pose.pose.position, axis), rel=1e-9)
        turns = [[getattr(of.pose.pose.orientation, axis) for axis in "xyzw"] for of in (pose, other)]
        assert abs(np.dot(*turns)) == pytest.approx(1, abs=1e-12)
    assert [text.data for text in of_topic(publications, "panel_0/message")] == [text.data for text in written["/panel_0/message"]]
    assert [bytes(told.data) for told in of_topic(publications, "panel_0/message_bytes")] == [MESSAGE] * len(recorded.messages)
    reports, others = of_topic(publications, "/diagnostics"), written["/diagnostics"]
    # The program's last report is that of the film's end.
    assert len(reports) == len(others) - 1
    for report, other in zip(reports, others, strict=False):
        assert [fields(status) for status in report.status] == [fields(status) for status in other.status]


def test_calibrations_that_come_late_or_are_of_another_size_are_heeded() -> None:
    log, focal_px = Log(), 3636.4
    receiver = receiver_of(log, fps=100, symbol_rate=100, interval=1, led_diameter_m=0.03)
    images, poses = film("late", 40), []
    for number, pixels in enumerate(images):
        if number == 20:
            receiver.camera_info(camera_info(focal_px, (640, 480)))
        if number >= 25:
            receiver.camera_info(camera_info(focal_px))
        publications = checked(receiver.image(image(pixels, time_ns=number * PERIOD_NS)))
        poses += [(number, pose) for pose in of_topic(publications, "panel_0/pose")]
    assert poses and poses[0][0] >= 25
    assert all(abs(pose.pose.pose.position.z - 50) < 1 for _, pose in poses)
    [error] = log.of("error")
    assert error.startswith("no poses: the calibration is of 640 x 480 pixels, and images have 320 x 240: calibrate")
    # Each calibration began the receiver anew once, not with each message.
    assert len(log.of("info")) == 2


def test_a_calibration_is_read_for_its_region_binning_and_kind() -> None:
    plain = lens_of(camera_info(1000.0))
    assert plain is not None and (plain.size, plain.focal_px, plain.distortion) == ((320, 240), (1000.0, 1000.0), ())
    roi = SimpleNamespace(x_offset=100, y_offset=40, width=160, height=120, do_rectify=False)
    part = lens_of(camera_info(1000.0, roi=roi, binning_x=2, binning_y=2))
    assert part is not None
    assert (part.size, part.focal_px, part.principal_px) == ((80, 60), (500.0, 500.0), ((159.5 - 100) / 2, (119.5 - 40) / 2))
    wide = [0.1, -0.2, 0.001, 0.002, 0.03, 0.4, 0.05, 0.006]
    rational = lens_of(camera_info(1000.0, d=wide, distortion_model="rational_polynomial"))
    assert rational is not None and rational.distortion == tuple(wide)
    rectified = lens_of(camera_info(1000.0, d=wide, distortion_model="equidistant"), rectified=True)
    assert rectified is not None and rectified.distortion == ()
    assert lens_of(camera_info(0.0)) is None
    with pytest.raises(vocc.VoccError, match="equidistant.*rectify"):
        lens_of(camera_info(1000.0, d=wide, distortion_model="equidistant"))
    with pytest.raises(vocc.VoccError, match="2 coefficients, not 5"):
        lens_of(camera_info(1000.0, d=[0.1, 0.2]))
    log = Log()
    receiver = receiver_of(log)
    for _ in range(3):
        receiver.camera_info(camera_info(1000.0, d=wide, distortion_model="equidistant"))
        receiver.camera_info(camera_info(float("nan")))
    assert len(log.of("error")) == 2 and all(text.startswith("no poses: ") for text in log.of("error"))


GREY = (np.arange(6 * 8, dtype=np.uint8) * 5).reshape(6, 8)
COLOUR = np.stack([GREY, GREY[::-1], 255 - GREY], axis=-1)
DEEP = GREY.astype(np.uint16) * 257 + 3


@pytest.mark.parametrize("padding", [0, 6])
def test_each_encoding_becomes_an_array(padding: int) -> None:
    alpha = np.full((6, 8, 1), 9, np.uint8)
    yuv = np.stack([GREY, np.full_like(GREY, 128)], axis=-1)
    found = {
        "mono8": (GREY, GREY),
        "8UC1": (GREY, GREY),
        "mono16": (DEEP, DEEP),
        "16UC1": (DEEP, DEEP),
        "bgr8": (COLOUR, COLOUR),
        "8UC3": (COLOUR, COLOUR),
        "rgb8": (COLOUR[..., ::-1], COLOUR),
        "bgra8": (np.concatenate([COLOUR, alpha], -1), COLOUR),
        "8UC4": (np.concatenate([COLOUR, alpha], -1), COLOUR),
        "rgba8": (np.concatenate([COLOUR[..., ::-1], alpha], -1), COLOUR),
        "yuyv": (yuv, GREY),
        "yuv422_yuy2": (yuv, GREY),
        "uyvy": (yuv[..., ::-1], GREY),
        "yuv422": (yuv[..., ::-1], GREY),
    }
    for encoding, (sent, expected) in found.items():
        pixels = of_image(image(sent, encoding, padding=padding))
        assert pixels.dtype == expected.dtype and pixels.flags.c_contiguous, encoding
        assert np.array_equal(pixels, expected), encoding
        vocc.Receiver(depth=12 if pixels.dtype == np.uint16 else None).feed(pixels)
    # Blue, green and red of a flat picture, from a mosaic of each kind.
    flat = {"r": 200, "g": 120, "b": 40}
    for encoding in ("bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"):
        cell = np.array([flat[colour] for colour in encoding[6:10]], np.uint8).reshape(2, 2)
        pixels = of_image(image(np.tile(cell, (4, 4)), encoding, padding=padding))
        assert np.array_equal(pixels[2:-2, 2:-2], np.broadcast_to([40, 120, 200], (4, 4, 3))), encoding
    assert set(found) | {"bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"} == set(ENCODINGS)
    swapped = of_image(image(DEEP.byteswap(), "mono16", padding=padding, is_bigendian=1))
    assert swapped.dtype == np.uint16 and np.array_equal(swapped, DEEP)


def test_images_of_wrong_sizes_and_other_encodings_are_refused() -> None:
    for encoding in ("32FC1", "rgb16", "bayer_rggb16", "nv12", "", "\x1b[31m"):
        with pytest.raises(UnsupportedImage, match="are not read: publish one of mono8") as why:
            of_image(image(GREY, encoding))
        assert "\x1b" not in str(why.value)
    for fault in ({"step": 7}, {"height": 7}, {"height": 0}, {"width": 9}, {"data": array("B")}):
        message = image(GREY)
        vars(message).update(fault)
        with pytest.raises(UnsupportedImage, match="wrong size"):
            of_image(message)


def test_compressed_images_are_decoded() -> None:
    def compressed(ending: str, pixels: np.ndarray) -> Any:
        return SimpleNamespace(header=header(0), format=ending, data=array("B", cv2.imencode(f".{ending}", pixels)[1].tobytes()))

    for pixels in (GREY, COLOUR, DEEP):
        assert np.array_equal(of_compressed(compressed("png", pixels)), pixels)
    assert of_compressed(compressed("jpeg", COLOUR)).shape == COLOUR.shape
    assert np.array_equal(of_compressed(compressed("png", np.dstack([COLOUR, GREY]))), COLOUR)
    for data in (b"", b"no picture", b"\x89PNG\r\n\x1a\n"):
        with pytest.raises(UnsupportedImage, match="'h264' is not read"):
            of_compressed(SimpleNamespace(header=header(0), format="h264", data=array("B", data)))


def test_what_needs_opencv_says_so_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    assert np.array_equal(of_image(image(GREY)), GREY)
    for take in (lambda: of_image(image(GREY, "bayer_rggb8")), lambda: of_compressed(SimpleNamespace(format="png", data=b"x"))):
        with pytest.raises(UnsupportedImage, match="install python3-opencv"):
            take()


def test_an_unsupported_encoding_is_one_error_and_a_status() -> None:
    log = Log()
    receiver = receiver_of(log, fps=100)
    publications = [publication for k in range(50) for publication in receiver.image(image(GREY, "32FC1", time_ns=k * PERIOD_NS))]
    assert len(log.lines) == 1 and log.of("error")[0].startswith("images of encoding '32FC1' are not read")
    [report] = of_topic(checked(publications), "/diagnostics")
    assert (report.status[0].level, report.status[0].hardware_id) == (2, "front")
    # Watchers see it as long as it lasts.
    [again] = of_topic(checked(receiver.silence()), "/diagnostics")
    assert again.status[0].message == log.of("error")[0]
    assert [value.value for value in again.status[0].values] == ["50"]
    publications = checked(receiver.image(image(film("x", 1)[0], time_ns=50 * PERIOD_NS)))
    camera = of_topic(publications, "/diagnostics")[0].status[0]
    assert (camera.level, values(camera)["frames_unusable"]) == (1, "50")


def test_faults_of_many_numbers_and_names_do_not_fill_the_log() -> None:
    log = Log()
    receiver = receiver_of(log, fps=100)
    for number in range(200):
        message = image(GREY)
        message.step = number % 7
        receiver.image(message)
    assert len(log.lines) == 1
    for number in range(200):
        receiver.image(image(GREY, "a" * number))
    assert len(log.lines) == 50


def test_stamps_that_no_camera_has_are_an_error() -> None:
    log = Log()
    receiver = receiver_of(log, symbol_rate=100)
    pixels = film("x", 1)[0]
    publications = [publication for k in range(64) for publication in receiver.image(image(pixels, time_ns=1000 * k * 10**9))]
    assert len(log.of("error")) == 1 and log.of("error")[0].startswith("the stamps of images are 1e+06 ms apart: ")
    assert [report.status[0].level for report in of_topic(checked(publications), "/diagnostics")] == [2]


def test_a_topic_without_images_is_an_error_status() -> None:
    receiver = receiver_of(Log(), now_ns=5 * 10**9)
    [report] = of_topic(checked(receiver.silence()), "/diagnostics")
    assert report.status[0].level == 2 and "no image has come yet" in report.status[0].message
    assert report.header.stamp.sec == 5


def test_silence_and_latency_are_by_the_node_s_clock() -> None:
    now = SimpleNamespace(ns=START_NS)
    receiver = ImageReceiver({"fps": 100.0}, TYPES, lambda: now.ns, Log())
    now.ns += 30_000_000
    [report] = of_topic(checked(receiver.image(image(film("x", 1)[0], time_ns=START_NS))), "/diagnostics")
    assert values(report.status[0])["latency_s"] == "0.03"
    now.ns += 2_000_000_000
    assert receiver.silence() == []
    now.ns += 1_500_000_000
    [report] = of_topic(checked(receiver.silence()), "/diagnostics")
    assert (report.status[0].level, report.status[0].message, report.header.frame_id) == (2, "no frame for 3 s", "front")


def test_images_are_numbered_by_their_stamps() -> None:
    clock = Clock(fps=50.0)
    period = 20_000_000
    stamps = [0, period, 2 * period + 2_000_000, 3 * period, 7 * period, 7 * period, 9 * period, 0, period]
    numbers = [clock.number(5 * period + stamp) for stamp in stamps]
    assert [number for number, _ in numbers] == [0, 1, 2, 3, 7, 8, 10, 11, 12]
    assert [late for _, late in numbers] == pytest.approx([0, 0, 0.1, 0, 0, 0, 0, 0, 0])


@pytest.mark.parametrize("fps", [30.0, 100.0, None])
def test_the_rate_is_measured_where_it_is_not_given_and_frames_may_be_missing(fps: float | None) -> None:
    log = Log()
    receiver = receiver_of(log, symbol_rate=100, **({} if fps is None else {"fps": 100.0}))
    publications = []
    for number, pixels in enumerate(film("missing frames", 60)):
        if number not in (20, 21, 33):
            publications += receiver.image(image(pixels, time_ns=START_NS + number * PERIOD_NS))
    publications += receiver.finish()
    assert "missing frames" in [text.data for text in of_topic(checked(publications), "panel_0/message")]
    assert log.of("info") == (["the camera takes 100.00 images a second"] if fps is None else [])
    assert receiver.receiver is not None and receiver.receiver.next_frame == 60


def test_images_without_stamps_are_counted() -> None:
    log = Log()
    receiver = receiver_of(log, symbol_rate=100)
    publications = [publication for pixels in film("no stamps") for publication in receiver.image(image(pixels))]
    assert "no stamps" in [text.data for text in of_topic(checked(publications + receiver.finish()), "panel_0/message")]
    assert len(log.lines) == 1 and "no stamps that rise" in log.of("warn")[0]


def test_with_keys_only_what_is_proven_is_published(tmp_path: Path) -> None:
    key, trust = tmp_path / "key.toml", tmp_path / "keys.toml"
    write_key(key, trust, "truck")
    for sign, expected in [(key, ["Ice"]), (None, [])]:
        receiver = receiver_of(Log(), symbol_rate=100, trust=str(trust))
        publications = []
        for number, pixels in enumerate(film("Ice", 60, sign=sign)):
            publications += receiver.image(image(pixels, time_ns=START_NS + number * PERIOD_NS))
        publications += receiver.finish()
        assert [text.data for text in of_topic(checked(publications), "panel_0/message")] == expected


def test_parameters_are_those_of_the_receiver() -> None:
    import inspect

    told = inspect.signature(vocc.Receiver).parameters
    # With keys, only what is proven is published.
    assert set(PARAMETERS) - {"encoding", "rectified"} == set(told) - {"camera", "only_trusted"}
    for name in set(PARAMETERS) & set(told):
        default = PARAMETERS[name].default
        assert told[name].default == (None if default in (-1, "") else default), name
    for faults, why in [
        ({"panels": 5}, "panels = 5"),
        ({"panels": 1.5}, "panels = 1.5"),
        ({"panels": -1}, "panels = -1"),
        ({"depth": 8}, "depth = 8"),
        ({"fps": 0.0}, "fps = 0"),
        ({"symbol_rate": "fast"}, "symbol_rate = 'fast'"),
        ({"interval": float("nan")}, "interval = nan"),
        ({"detector": "guess"}, "guess"),
        ({"encoding": "9"}, "9"),
        ({"trust": "none.toml"}, "cannot read none.toml"),
        ({"counters": "seen.toml"}, "give trust"),
        ({"speed": 1}, "speed: there are fps"),
    ]:
        with pytest.raises(vocc.VoccError, match=re.escape(why)):
            receiver_of(Log(), **faults)


def test_quaternions_are_those_of_their_matrices() -> None:
    random = np.random.default_rng(5)
    turns = [*np.eye(4), *random.normal(size=(200, 4)), *(random.normal(size=(50, 4)) * [1, 1, 1, 1e-9])]
    for turn in turns:
        x, y, z, w = turn / np.linalg.norm(turn)
        found = np.array(quaternion(rotation_of(x, y, z, w)))
        assert abs(np.linalg.norm(found) - 1) < 1e-12
        assert abs(found @ [x, y, z, w]) == pytest.approx(1, abs=1e-12)


class StandInNode:
    """What the node uses of rclpy.node.Node."""

    parameters: dict[str, Any] = {}

    def __init__(self, name: str) -> None:
        self.name, self.published, self.subscriptions, self.timers = name, [], {}, []
        self.log = Log()

    def declare_parameter(self, name: str, default: Any, descriptor: Any) -> Any:
        assert descriptor.description
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_publisher(self, kind: Any, topic: str, depth: int) -> Any:
        def publish(message: Any) -> None:
            assert isinstance(message, kind)
            self.published.append(Publication(topic, message))

        return SimpleNamespace(publish=publish)

    def create_subscription(self, kind: Any, topic: str, take: Any, qos: Any) -> None:
        self.subscriptions[topic] = (kind, take)

    def create_timer(self, period_s: float, call: Any) -> None:
        self.timers.append(call)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=START_NS))

    def get_logger(self) -> Any:
        return SimpleNamespace(**{name: lambda text, name=name: self.log(name, text) for name in ("error", "warning", "info")})


@pytest.fixture
def node_module(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The node's file, imported with stand-ins for ROS 2."""
    modules: dict[str, dict[str, Any]] = {f"{package}.msg": {name: CLASSES[name] for name in names} for package, names in PACKAGES.items()}
    modules |= {
        "rclpy": {},
        "rclpy.executors": {"ExternalShutdownException": type("ExternalShutdownException", (Exception,), {})},
        "rclpy.node": {"Node": StandInNode},
        "rclpy.qos": {"qos_profile_sensor_data": "sensor data"},
        "rcl_interfaces.msg": {"ParameterDescriptor": SimpleNamespace},
    }
    for name, content in modules.items():
        package = name.partition(".")[0]
        for module in {package, name}:
            if module not in sys.modules or not isinstance(sys.modules[module], types.ModuleType):
                monkeypatch.setitem(sys.modules, module, types.ModuleType(module))
        vars(sys.modules[name]).update(content)
    monkeypatch.delitem(sys.modules, "vocc_ros.node", raising=False)
    yield importlib.import_module("vocc_ros.node")
    sys.modules.pop("vocc_ros.node", None)


@pytest.mark.parametrize("compressed", [False, True])
def test_the_node_subscribes_and_publishes(node_module: Any, monkeypatch: pytest.MonkeyPatch, compressed: bool) -> None:
    monkeypatch.setattr(StandInNode, "parameters", {"symbol_rate": 100, "panels": 2, "compressed": compressed})
    node = node_module.ReceiverNode()
    topic = "image/compressed" if compressed else "image"
    assert set(node.subscriptions) == {topic, "camera_info"}
    kind, take = node.subscriptions[topic]
    assert kind is CLASSES["CompressedImage" if compressed else "Image"]
    for call in node.timers:
        call()
    assert "no image has come yet" in node.published.pop().message.status[0].message
    for number, pixels in enumerate(film("node")):
        message = image(pixels, time_ns=START_NS + number * PERIOD_NS)
        if compressed:
            message = SimpleNamespace(header=message.header, format="png", data=cv2.imencode(".png", pixels)[1].tobytes())
        take(message)
    node.publish(node.receiver.finish())
    texts = of_topic(node.published, "panel_0/message")
    assert "node" in [text.data for text in texts]
    octets = of_topic(node.published, "panel_0/message_bytes")[0].data
    assert (octets.typecode, bytes(octets)) == ("B", b"node")
    # rclpy's field for a byte is bytes.
    assert of_topic(node.published, "/diagnostics")[0].status[0].level == b"\x00"
    node.say("error", "a")
    node.say("warn", "b")
    assert node.log.lines[-2:] == [("error", "a"), ("warning", "b")]


def test_the_package_is_whole() -> None:
    package = ElementTree.parse(FOLDER / "package.xml").getroot()
    assert package.findtext("name") == "vocc_ros" and (FOLDER / "resource" / "vocc_ros").exists()
    assert package.findtext("version") == vocc.__version__
    setup = (FOLDER / "setup.py").read_text()
    assert f'version="{vocc.__version__}"' in setup
    assert compileall.compile_dir(FOLDER, quiet=2, legacy=False, force=False)
    used = set(re.findall(r"^from (\w+)(?:\.\w+)* import", (FOLDER / "vocc_ros" / "node.py").read_text(), re.MULTILINE))
    needed = {element.text for element in package.findall("exec_depend")}
    assert used - {"array", "typing", "vocc_ros"} <= needed
    text = (FOLDER / "README.md").read_text()
    for name in [*PARAMETERS, "compressed", *ENCODINGS]:
        assert f"`{name}`" in text, name
    for topic in topics(1):
        assert f"`{topic}`" in text, topic


def test_types_are_strict() -> None:
    strict = [sys.executable, "-m", "mypy", "--strict"]
    lax = ["--ignore-missing-imports", "--allow-subclassing-any", "--allow-untyped-decorators"]
    for arguments in (["vocc_ros/images.py", "vocc_ros/reception.py"], [*lax, "vocc_ros/node.py"]):
        done = subprocess.run([*strict, *arguments], capture_output=True, text=True, check=False, cwd=FOLDER)
        assert done.returncode == 0, done.stdout


def test_frames_of_the_recording_are_stamped_from_its_start(recorded: Recorded) -> None:
    with AnyReader([recorded.path]) as reader:
        assert (reader.start_time, reader.end_time) == (START_NS, START_NS + (FRAMES - 1) * PERIOD_NS + 1)
