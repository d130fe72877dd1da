"""Decoding and receiving: bits and messages equal those of the program, positions and poses within its rounding."""

from pathlib import Path

import cv2
import numpy as np
import pytest

import vocc

# A blur that differs from the receiver's initial one, so that it has to be learnt.
SCENE = {"camera.width_px": 320, "camera.height_px": 240, "camera.blur_sigma_px": 1}
MESSAGE = "Ice on the bridge"


@pytest.fixture(scope="module")
def film(program: Path, tmp_path_factory: pytest.TempPathFactory, vocc_json) -> Path:
    """A folder of frames from the program."""
    folder = tmp_path_factory.mktemp("film")
    sizes = [part for key, value in SCENE.items() for part in ("--set", f"{key}={value}")]
    [report] = vocc_json("link", "day", *sizes, "--message", MESSAGE, "--frames", 30, "--save", folder)
    assert report["delivered"]
    return folder


def images(film: Path) -> list[np.ndarray]:
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(film.glob("*.png"))]


def test_a_receiver_says_what_the_program_says(film: Path, vocc_json) -> None:
    rows = vocc_json("receive", film, "--bits", "--interval", 1, "--led-diameter", 0.03)
    printed = [row for row in rows if "bits" in row]
    [told] = [row for row in rows if "message" in row]
    receiver = vocc.Receiver(interval=1, led_diameter_m=0.03)
    readings, messages, lost = [], [], 0
    for image in images(film):
        received = receiver.feed(image)
        readings += received.readings
        messages += received.messages
        lost += len(received.losses)
    messages += receiver.finish()
    assert len(readings) + lost == 30
    assert len(readings) > 20
    for reading, row in zip(readings, printed, strict=True):
        assert (reading.frame, vocc.as_hex(reading.bits)) == (row["frame"], row["bits"])
        assert (reading.symbol, reading.panel) == (row["symbol"], row["panel"])
        assert (reading.turned_deg, reading.is_mirrored) == (row["turned_deg"], row["is_mirrored"])
        assert reading.centre_px == pytest.approx(row["centre_px"], abs=1e-5)
        assert reading.confidence == pytest.approx(row["confidence"], abs=1e-6)
        sure = np.abs(reading.llr) > 0
        assert sure.any()
        assert np.array_equal((reading.llr > 0)[sure], reading.bits[sure])
        assert reading.pose is None and "focal" in reading.no_pose
    [message] = messages
    assert (message.text, message.data) == (MESSAGE, MESSAGE.encode())
    keys = ("first_frame", "last_frame", "corrected_bits")
    assert [getattr(message, key) for key in keys] == [told[key] for key in keys]
    camera = receiver.camera
    assert camera is not None and camera.frames >= told["camera"]["frames"]
    assert receiver.closed


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_film_is_read_whichever_way_up_the_camera_was(film: Path, turns: int, is_mirrored: bool) -> None:
    receiver = vocc.Receiver()
    readings, messages = [], []
    for image in images(film):
        image = np.fliplr(image) if is_mirrored else image
        received = receiver.feed(np.ascontiguousarray(np.rot90(image, -turns)))
        readings += received.readings
        messages += received.messages
    messages += receiver.finish()
    assert [message.text for message in messages] == [MESSAGE]
    known = [(reading.turned_deg, reading.is_mirrored) for reading in readings if reading.turned_deg is not None]
    assert len(known) > 20
    assert set(known) == {(90 * turns, is_mirrored)}


def test_the_learnt_camera_is_what_the_program_saves_and_the_next_receiver_begins_with(film: Path, tmp_path: Path, vocc_json) -> None:
    receiver = vocc.Receiver()
    for image in images(film):
        receiver.feed(image)
    learnt = receiver.camera
    assert learnt is not None
    assert 0.8 < learnt.camera.blur_sigma_px < 1.2
    file = tmp_path / "camera.toml"
    vocc_json("receive", film, "--save-camera", file)
    saved = dict(line.split(" = ") for line in file.read_text().splitlines() if " = " in line)
    assert learnt.camera.encoding == pytest.approx(float(saved.pop("gamma")), abs=1e-6)
    assert {"black_grey", "blur_sigma_px", "blur_aspect", "read_noise_e"} <= saved.keys()
    for key, value in saved.items():
        assert getattr(learnt.camera, key) == pytest.approx(float(value), abs=1e-6), key
    again = vocc.Receiver(learnt, fps=100)
    first = again.feed(images(film)[0])
    assert again.camera is not None and abs(again.camera.camera.blur_sigma_px - learnt.camera.blur_sigma_px) < 0.1
    assert len(first.readings) == 1
    same = vocc.Camera(**learnt.camera.to_dict())
    assert same.to_dict() == learnt.camera.to_dict()
    assert vocc.Receiver(learnt.camera.to_dict()).feed(images(film)[0]).readings[0].centre_px == first.readings[0].centre_px


def test_a_camera_says_of_itself_what_was_told() -> None:
    assert vocc.Camera().encoding is None
    assert vocc.Camera().line_delay_exposures is None
    told = vocc.Camera(encoding="linear", line_delay_exposures=-0.02)
    assert (told.encoding, told.line_delay_exposures) == (1, -0.02)
    for camera in (vocc.Camera(), told):
        assert vocc.Camera(**camera.to_dict()).to_dict() == camera.to_dict()


@pytest.mark.parametrize("kind", ["deep", "light"])
def test_a_linear_film_is_read_alike_with_what_was_learnt_of_it(film: Path, kind: str) -> None:
    light = [(image / 255.0) ** 2.2 for image in images(film)]
    linear = [np.round(image * 4095).astype(np.uint16) if kind == "deep" else (image * 5.44).astype(np.float32) for image in light]

    def read(camera: vocc.LearntCamera | vocc.Camera | None) -> tuple[vocc.Receiver, list[str | None]]:
        receiver = vocc.Receiver(camera, depth=12)
        read = [receiver.feed(image).readings for image in linear]
        return receiver, [vocc.as_hex(readings[0].bits) if readings else None for readings in read]

    first, bits = read(None)
    assert first.camera is not None
    assert first.camera.camera.encoding == 1
    again, same = read(first.camera)
    both = [(a, b) for a, b in zip(bits, same, strict=True) if a and b]
    assert len(both) > 20
    assert all(a == b for a, b in both)
    assert again.camera is not None
    assert again.camera.camera.encoding == 1
    assert again.camera.camera.blur_sigma_px == pytest.approx(first.camera.camera.blur_sigma_px, abs=0.05)
    if kind == "light":
        # Linear light does not depend on the camera's curve.
        assert read(vocc.Camera("srgb"))[1] == bits


def test_a_receiver_goes_by_the_line_delay_that_it_is_told(film: Path) -> None:
    for told in (None, 0.01, -0.01):
        receiver = vocc.Receiver({"line_delay_exposures": told})
        for image in images(film):
            receiver.feed(image)
        learnt = receiver.camera
        assert learnt is not None
        assert learnt.line_delay_exposures == learnt.camera.line_delay_exposures == told


def test_single_images_are_read_as_by_the_program(film: Path, vocc_json) -> None:
    files = sorted(film.glob("*.png"))[:4]
    corners = None
    for detector in ("best", "kmeans"):
        for row, path in zip(vocc_json("decode", *files, "--detector", detector), files, strict=True):
            decoded = vocc.decode(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), detector=detector)
            assert decoded.found == row["found"]
            if decoded.found:
                assert vocc.as_hex(decoded.bits) == row["bits"]
                assert decoded.centre_px == pytest.approx(row["centre_px"], abs=1e-5)
                assert decoded.pitch_px == pytest.approx(row["pitch_px"], abs=1e-5)
                assert decoded.confidence == pytest.approx(row["confidence"], abs=1e-6)
                corners = decoded.corners_px
    assert corners is not None
    text = ",".join(str(x) for x in corners.flatten().tolist())
    [row] = vocc_json("decode", files[0], f"--corners={text}")
    at_corners = vocc.decode(cv2.imread(str(files[0]), cv2.IMREAD_GRAYSCALE), corners=corners)
    assert vocc.as_hex(at_corners.bits) == row["bits"]
    assert (at_corners.place, at_corners.turned_deg) == (row["place"], row["turned_deg"]) == ("confirmed", 0)
    turned = vocc.decode(cv2.imread(str(files[0]), cv2.IMREAD_GRAYSCALE), corners=np.roll(corners, -1, axis=0))
    assert turned.turned_deg == 90


def test_a_pose_is_that_of_the_program(film: Path, tmp_path: Path, vocc_json) -> None:
    focal_px = 25 / 6.875e-3
    camera = tmp_path / "camera.toml"
    camera.write_text(f"focal_px = {focal_px}")
    path = sorted(film.glob("*.png"))[3]
    options = ["--camera", camera, "--interval", 1, "--led-diameter", 0.03]
    [row] = vocc_json("decode", path, *options)
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    pose = vocc.decode(image, camera=vocc.Camera(focal_px=focal_px), interval=1, led_diameter_m=0.03).pose
    assert pose is not None
    assert abs(pose.range_m - 50) < 5 * pose.range_sigma_m < 2
    found = pose.to_dict()
    for key in found.keys() & row["pose"].keys():
        expected = row["pose"][key]
        assert np.allclose(np.asarray(found[key], float), np.asarray(expected, float), rtol=1e-9, atol=1e-12), key
    receiver = vocc.Receiver({"focal_px": focal_px}, interval=1, led_diameter_m=0.03)
    poses = [reading.pose for image in images(film) for reading in receiver.feed(image).readings]
    assert all(pose is not None and abs(pose.range_m - 50) < 1 for pose in poses)
    assert abs(poses[-1].closing_speed_m_s) < 5 * poses[-1].closing_speed_sigma_m_s


def test_colours_deep_samples_and_light_are_read_too(film: Path) -> None:
    grey = images(film)[5]
    plain = vocc.decode(grey)
    assert plain.found
    colours = np.zeros((*grey.shape, 3), np.uint8)
    colours[..., 2] = grey
    red = vocc.decode(colours, channel="red")
    assert vocc.as_hex(red.bits) == vocc.as_hex(vocc.decode(colours).bits) == vocc.as_hex(plain.bits)
    assert red.centre_px == plain.centre_px
    assert not vocc.decode(colours, channel="blue").found
    light = ((grey / 118.0) ** 2.2).astype(np.float32)
    as_light = vocc.decode(light)
    assert as_light.centre_px == pytest.approx(plain.centre_px, abs=1e-3)
    assert vocc.as_hex(as_light.bits) == vocc.as_hex(plain.bits)
    deep = np.round((grey / 255.0) ** 2.2 * 4095).astype(np.uint16)
    assert vocc.as_hex(vocc.decode(deep, depth=12).bits) == vocc.as_hex(plain.bits)


def test_an_image_without_a_panel_is_an_answer() -> None:
    nothing = vocc.decode(np.full((64, 64), 118, np.uint8))
    assert not nothing.found and nothing.bits is None
    assert nothing.why is not None and "no candidate" in nothing.why
    received = vocc.Receiver().feed(np.full((64, 64), 118, np.uint8))
    assert received.readings == [] and len(received.losses) == 1


def test_two_panels_are_followed_at_once() -> None:
    scene = vocc.Scene(
        {
            "camera": {"width_px": 400, "height_px": 240},
            "panel": [{"pose": {"x_m": -1.2}}, {"pose": {"x_m": 1.2}}],
            "effects": {"noise": "off"},
        }
    )
    renderer = vocc.Renderer(scene, level="fast")
    receiver = vocc.Receiver(panels=2, symbol_rate=100)
    seen = set()
    for k, bits in enumerate(vocc.transmit("two", count=6)):
        seen |= {reading.panel for reading in receiver.feed(renderer.render(bits, frame=k)).readings}
    assert seen == {0, 1}


def test_messages_come_from_any_iterable() -> None:
    renderer = vocc.Renderer("paper", level="fast", crop=True)
    film = [renderer.render(bits) for bits in vocc.transmit(MESSAGE, count=25)]
    assert [message.text for message in vocc.receive(film, symbol_rate=100)] == [MESSAGE]
    # The rate is not configured: the usual ones are tried.
    assert MESSAGE in [message.text for message in vocc.receive(film)]


def test_panels_are_those_of_the_program(vocc_json) -> None:
    for message, options in ((MESSAGE, {}), ("raw", {"raw": True}), ("x" * 1024, {}), ("again", {"count": 40})):
        arguments = ["--raw"] if options.get("raw") else ["--count", options["count"]] if "count" in options else []
        printed = [row["panel"] for row in vocc_json("transmit", "--message", message, *arguments)]
        panels = vocc.transmit(message, **options)
        assert (panels.dtype, panels.shape[1:]) == (bool, (8, 8))
        assert [vocc.as_hex(panel) for panel in panels] == printed
        assert np.array_equal(vocc.transmit(message.encode(), **options), panels)


def test_flicker_is_that_of_the_program(vocc_json) -> None:
    for message, cycles in ((None, 0), (MESSAGE, 16), (MESSAGE, 3)):
        arguments = ["--message", message] if message else []
        [printed] = vocc_json("transmit", "--flicker", "--symbol-rate", "90", "--carrier-cycles", cycles, *arguments)
        flicker = vocc.flicker(message, carrier_cycles=cycles)
        assert (flicker.carrier_cycles, flicker.carrier_hz) == (printed["carrier_cycles"], 90 * cycles)
        standards = printed["rates"][0]["by_standards"]
        assert flicker.low_risk_times == pytest.approx(max(light["low_risk_times"] for light in standards))
        for measure in ("longest_period_s", "pst_lm", "svm"):
            assert getattr(flicker, measure) == pytest.approx(standards[0][measure])


def test_a_panel_with_a_carrier_is_known_as_one() -> None:
    small = {"camera.width_px": 160, "camera.height_px": 120, "camera.exposure_s": 0.00025}
    with_carrier = []
    for cycles in (0, 16):
        scene = vocc.Scene("day", **{**small, "link.carrier_cycles": cycles})
        renderer = vocc.Renderer(scene, level="fast")
        receiver = vocc.Receiver(fps=100, symbol_rate=90)
        panels = vocc.transmit(MESSAGE, count=80)
        # Each frame shows the symbol at its time, so that one panel a frame is close enough here.
        readings = [receiver.feed(renderer.render(panels[int(k * 0.9)], frame=k)).readings for k in range(80)]
        with_carrier.append(any(reading.has_carrier for of_frame in readings for reading in of_frame))
    assert with_carrier == [False, True]
