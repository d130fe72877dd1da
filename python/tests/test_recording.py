"""Recordings of `vocc receive --mcap`, read by other software: mcap-ros2-support and rosbags find what `--json` printed of the film."""

import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recorded import DEAD_LEDS, DISTORTION, FOCAL_PX, FRAME_ID, FRAMES, MESSAGE, PERIOD_NS, START_NS, Recorded, rotation_of, values
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore

TYPES = {
    "/camera/image": "sensor_msgs/msg/CompressedImage",
    "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/panel_0/outline": "foxglove_msgs/msg/ImageAnnotations",
    "/panel_0/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/panel_0/message": "std_msgs/msg/String",
    "/panel_0/message_bytes": "std_msgs/msg/UInt8MultiArray",
}


Read = dict[str, list[tuple[int, str, Any]]]


def with_mcap_ros2(path: Path) -> Read:
    read: Read = defaultdict(list)
    with path.open("rb") as file:
        for schema, channel, message, content in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            assert message.log_time == message.publish_time
            read[channel.topic].append((message.log_time, schema.name, content))
    return read


def with_rosbags(path: Path) -> Read:
    read: Read = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, time_ns, data in reader.messages():
            read[connection.topic].append((time_ns, connection.msgtype, reader.deserialize(data, connection.msgtype)))
    return read


READERS = {"mcap-ros2-support": with_mcap_ros2, "rosbags": with_rosbags}


@pytest.fixture(scope="module", params=READERS)
def read(recorded: Recorded, request: pytest.FixtureRequest) -> Read:
    return READERS[request.param](recorded.path)


def stamp_ns(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def frame_of(time_ns: int) -> int:
    number, rest = divmod(time_ns - START_NS, PERIOD_NS)
    assert rest == 0
    return number


def test_all_channels_are_there_with_their_stamps(read: Read) -> None:
    assert {topic: messages[0][1] for topic, messages in read.items()} == TYPES
    for topic, messages in read.items():
        for time_ns, _, content in messages:
            assert 0 <= frame_of(time_ns) < FRAMES, topic
            if hasattr(content, "header"):
                assert (stamp_ns(content.header.stamp), content.header.frame_id) == (time_ns, FRAME_ID), topic


def test_images_and_the_calibration_are_those_of_the_film(recorded: Recorded, read: Read) -> None:
    images, infos = read["/camera/image"], read["/camera/camera_info"]
    assert [frame_of(time_ns) for time_ns, _, _ in images] == list(range(FRAMES))
    for number in (0, 130, FRAMES - 1):
        image = images[number][2]
        assert image.format == "mono8; png compressed"
        pixels = cv2.imdecode(np.frombuffer(bytes(image.data), np.uint8), cv2.IMREAD_UNCHANGED)
        assert np.array_equal(pixels, cv2.imread(str(recorded.files[number]), cv2.IMREAD_UNCHANGED))
    assert len(infos) == FRAMES
    info = infos[-1][2]
    assert (info.width, info.height, info.distortion_model) == (320, 240, "plumb_bob")
    assert list(info.d) == DISTORTION
    assert list(info.k) == [FOCAL_PX, 0, 159.5, 0, FOCAL_PX, 119.5, 0, 0, 1]
    assert list(info.r) == np.eye(3).flatten().tolist()
    assert list(info.p) == [FOCAL_PX, 0, 159.5, 0, 0, FOCAL_PX, 119.5, 0, 0, 0, 1, 0]
    assert (info.binning_x, info.binning_y, info.roi.width, info.roi.height, info.roi.do_rectify) == (0, 0, 0, 0, False)


def test_outlines_and_poses_are_those_that_were_printed(recorded: Recorded, read: Read) -> None:
    outlines = read["/panel_0/outline"]
    assert [frame_of(time_ns) for time_ns, _, _ in outlines] == [row["frame"] for row in recorded.readings]
    for (time_ns, _, outline), row in zip(outlines, recorded.readings, strict=True):
        [text], [points] = outline.texts, outline.points
        assert text.text == row["bits"]
        assert stamp_ns(points.timestamp) == time_ns
        middle = np.mean([[point.x, point.y] for point in points.points], axis=0)
        assert middle == pytest.approx(row["centre_px"], abs=0.05)
    known = [row for row in recorded.readings if row["pose"]["known"]]
    poses = read["/panel_0/pose"]
    assert len(known) > 100
    assert [frame_of(time_ns) for time_ns, _, _ in poses] == [row["frame"] for row in known]
    for (_, _, content), row in zip(poses, known, strict=True):
        pose, told = content.pose.pose, row["pose"]
        assert [pose.position.x, pose.position.y, pose.position.z] == told["translation_m"]
        assert list(content.pose.covariance) == np.ravel(told["covariance"]).tolist()
        rotation = rotation_of(*(getattr(pose.orientation, axis) for axis in "xyzw"))
        assert np.allclose(rotation, told["rotation"], atol=1e-9)


def test_messages_are_those_that_were_printed(recorded: Recorded, read: Read) -> None:
    assert recorded.messages
    assert [content.data for _, _, content in read["/panel_0/message"]] == [row["message"] for row in recorded.messages]
    assert [bytes(content.data) for _, _, content in read["/panel_0/message_bytes"]] == [MESSAGE] * len(recorded.messages)
    for _, _, content in read["/panel_0/message_bytes"]:
        assert (len(content.layout.dim), content.layout.data_offset) == (0, 0)


def test_diagnostics_count_what_was_printed(recorded: Recorded, read: Read) -> None:
    reports = [(frame_of(time_ns), content.status) for time_ns, _, content in read["/diagnostics"]]
    for frame, (camera, panel) in reports[:-1]:
        lost = [int(number) for number, _ in recorded.lost if int(number) <= frame]
        assert values(camera) == {"frames": str(frame + 1), "frames_dropped": "0", "frames_unusable": "0"}
        assert values(panel)["frames_read"] == str(sum(row["frame"] <= frame for row in recorded.readings))
        assert values(panel)["frames_lost"] == str(len(lost))
    names = [("vocc: camera", FRAME_ID), ("vocc: panel 0", "panel_0")]
    assert all([(status.name, status.hardware_id) for status in statuses] == names for _, statuses in reports)
    # Once a second, when the hidden panel is given up and found again, and at the end.
    frames, levels = [frame for frame, _ in reports], [panel.level for _, (_, panel) in reports]
    assert frames[0] == 0 and frames[-1] == FRAMES - 1
    assert all(after - before <= 100 for before, after in zip(frames, frames[1:], strict=False))
    assert len(reports) <= 7
    [(given_up, statuses)] = [report for report in reports if report[1][1].level == 2 and report[0] > 110][:1]
    assert 120 < given_up < 160
    why = dict(recorded.lost)[str(given_up)]
    assert statuses[1].message == f"no panel is followed: {why}"
    last = values(reports[-1][1][1])
    assert int(last["frames_read"]) == len(recorded.readings)
    assert int(last["frames_lost"]) == len(recorded.lost) == FRAMES - len(recorded.readings)
    assert sum(int(count) for key, count in last.items() if key.startswith("lost_")) == len(recorded.lost)
    assert int(last["messages"]) == len(recorded.messages)
    assert recorded.camera["broken_leds"] == DEAD_LEDS
    assert last["broken_leds"] == ", ".join(map(str, DEAD_LEDS))
    assert levels[-1] == 1 and "; broken LEDs: 2" in reports[-1][1][1].message


def test_definitions_are_those_of_ros(recorded: Recorded) -> None:
    """A type's hash changes with any name, type or order of its fields."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([recorded.path]) as reader:
        for topic, kind in TYPES.items():
            if not kind.startswith("foxglove"):
                assert reader.typestore.hash_rihs01(kind) == store.hash_rihs01(kind), topic
        [connection] = [connection for connection in reader.connections if connection.topic == "/diagnostics"]
        constants = reader.typestore.fielddefs["diagnostic_msgs/msg/DiagnosticStatus"][0]
        assert [(name, value) for name, _, value in constants] == [("OK", 0), ("WARN", 1), ("ERROR", 2), ("STALE", 3)]
        # CDR is unambiguous: what ROS's own types write is what was recorded, byte for byte.
        for found, _, data in reader.messages():
            if not found.msgtype.startswith("foxglove"):
                assert bytes(store.serialize_cdr(store.deserialize_cdr(data, found.msgtype), found.msgtype)) == bytes(data)
        assert connection.msgcount > 0


def test_tools_that_need_a_folder_get_one(recorded: Recorded, tmp_path: Path) -> None:
    """The command in docs/live.md."""
    convert = Path(sys.executable).with_name("rosbags-convert")
    bag = tmp_path / "drive"
    subprocess.run([convert, "--src", recorded.path, "--dst", bag], check=True)
    assert (bag / "metadata.yaml").exists()
    converted, direct = with_rosbags(bag), with_rosbags(recorded.path)
    assert {topic: len(messages) for topic, messages in converted.items()} == {topic: len(messages) for topic, messages in direct.items()}
    assert [time_ns for time_ns, _, _ in converted["/panel_0/pose"]] == [time_ns for time_ns, _, _ in direct["/panel_0/pose"]]


def write_car(bag: Path) -> list[int]:
    """Writes a car's bag of the film's clock, with the camera's place in the car; the stamps, between those of the frames."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    stamps = [START_NS + PERIOD_NS // 2 + number * PERIOD_NS for number in range(-10, FRAMES + 10)]
    with Writer(bag, version=9) as writer:
        topics = {"/imu/data": "sensor_msgs/msg/Imu", "/diagnostics": TYPES["/diagnostics"], "/tf_static": "tf2_msgs/msg/TFMessage"}
        connections = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in topics.items()}

        def put(topic: str, time_ns: int, **content: Any) -> None:
            kind = topics[topic]
            writer.write(connections[topic], time_ns, store.serialize_cdr(kinds[kind](**content), kind))

        def header(time_ns: int, frame: str) -> Any:
            stamp = kinds["builtin_interfaces/msg/Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
            return kinds["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

        vector, quaternion = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
        # The camera looks ahead, 1.2 m above the ground.
        ahead = quaternion(x=-0.5, y=0.5, z=-0.5, w=0.5)
        mounted = kinds["geometry_msgs/msg/Transform"](translation=vector(x=1.5, y=0, z=1.2), rotation=ahead)
        placed = kinds["geometry_msgs/msg/TransformStamped"](header(stamps[0], "base_link"), child_frame_id=FRAME_ID, transform=mounted)
        put("/tf_static", stamps[0], transforms=[placed])
        status = kinds["diagnostic_msgs/msg/DiagnosticStatus"](level=0, name="battery", message="", hardware_id="battery", values=[])
        put("/diagnostics", stamps[20], header=header(stamps[20], ""), status=[status])
        unknown = np.full(9, -1.0)
        for time_ns in stamps:
            put(
                "/imu/data",
                time_ns,
                header=header(time_ns, "imu_link"),
                orientation=quaternion(x=0, y=0, z=0, w=1),
                orientation_covariance=unknown,
                angular_velocity=vector(x=0, y=0, z=0.1),
                angular_velocity_covariance=unknown,
                linear_acceleration=vector(x=0, y=0, z=9.81),
                linear_acceleration_covariance=unknown,
            )
    return stamps


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_recording_merges_with_a_cars_bag(recorded: Recorded, tmp_path: Path, storage: str) -> None:
    """The command in docs/live.md."""
    convert = Path(sys.executable).with_name("rosbags-convert")
    car, merged = tmp_path / "car", tmp_path / "merged"
    stamps = write_car(car)
    subprocess.run([convert, "--src", car, recorded.path, "--dst", merged, "--dst-storage", storage], check=True)
    with AnyReader([merged]) as reader:
        order = [(time_ns, connection.topic, bytes(data)) for connection, time_ns, data in reader.messages()]
    times = [time_ns for time_ns, _, _ in order]
    assert times == sorted(times)
    sources = []
    for path in (car, recorded.path):
        with AnyReader([path]) as reader:
            sources += [(time_ns, connection.topic, bytes(data)) for connection, time_ns, data in reader.messages()]
    assert sorted(order) == sorted(sources)
    assert {topic for _, topic, _ in order} == {*TYPES, "/imu/data", "/tf_static"}
    # Images and the car's messages alternate while both are there.
    both = [(time_ns, topic) for time_ns, topic, _ in order if topic in ("/camera/image", "/imu/data")]
    assert [topic for _, topic in both[9:-10]] == ["/imu/data", *["/camera/image", "/imu/data"] * FRAMES]
    assert [time_ns for time_ns, topic in both if topic == "/imu/data"] == stamps
    # The car's tree of frames has the camera that the poses are in.
    content = with_rosbags(merged)
    [placed] = content["/tf_static"][0][2].transforms
    assert {pose.header.frame_id for _, _, pose in content["/panel_0/pose"]} == {placed.child_frame_id}
    assert [status.name for _, _, report in content["/diagnostics"] for status in report.status].count("battery") == 1
