"""Any input leads to a result, or to an exception with the fault, the range and the way out; never to a panic."""

import itertools
import os
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import vocc

# The exceptions for Python users; PanicException is not among them.
REFUSALS = (vocc.VoccError, TypeError, OverflowError)
# The gate's cases are the same in each run; VOCC_TEST_CASES=all draws others.
relaxed = settings(
    max_examples=150, deadline=None, derandomize=os.environ.get("VOCC_TEST_CASES") != "all", suppress_health_check=list(HealthCheck)
)


@pytest.mark.parametrize(
    ("image", "kind", "words"),
    [
        (None, TypeError, "of type NoneType: give a NumPy array of shape (height, width)"),
        ([[1, 2], [3, 4]], TypeError, "of type list"),
        (np.zeros(9, np.uint8), vocc.VoccError, "shape [9]"),
        (np.zeros((4, 4, 4), np.uint8), vocc.VoccError, "shape [4, 4, 4]"),
        (np.zeros((0, 4), np.uint8), vocc.VoccError, "shape [0, 4]"),
        (np.zeros((1, 8193), np.uint8), vocc.VoccError, "8192"),
        (np.zeros((8, 8), np.float64), TypeError, "type float64: give"),
        (np.zeros((8, 8), np.int8), TypeError, "type int8"),
        (np.zeros((8, 8), ">u2"), TypeError, "type >u2"),
        (np.zeros((8, 8, 3), np.float32), TypeError, "type float32"),
        (np.zeros((16, 16), np.uint8)[::2], vocc.VoccError, "give numpy.ascontiguousarray(image)"),
        (np.zeros((16, 16), np.uint8)[:, :8], vocc.VoccError, "numpy.ascontiguousarray"),
        (np.zeros((16, 8), np.uint8, order="F"), vocc.VoccError, "numpy.ascontiguousarray"),
        (np.full((8, 8), np.nan, np.float32), vocc.VoccError, "light of NaN in row 0, column 0: it is a number from 0 up"),
        (np.full((8, 8), -1, np.float32), vocc.VoccError, "light of -1 in row 0"),
        (np.full((8, 8), np.inf, np.float32), vocc.VoccError, "light of inf"),
    ],
)
def test_images_that_are_none_are_refused(image: Any, kind: type[Exception], words: str) -> None:
    for look in (vocc.decode, vocc.Receiver().feed):
        with pytest.raises(kind) as fault:
            look(image)
        assert words in str(fault.value)


def test_a_refused_image_leaves_the_receiver_as_it_was() -> None:
    receiver = vocc.Receiver()
    with pytest.raises(vocc.VoccError, match="light of NaN"):
        receiver.feed(np.full((8, 8), np.nan, np.float32))
    assert receiver.next_frame == 0
    receiver.feed(np.zeros((16, 16), np.uint8))
    with pytest.raises(vocc.VoccError, match="it has 8 × 16 pixels, and those before have 16 × 16"):
        receiver.feed(np.zeros((16, 8), np.uint8))
    assert receiver.next_frame == 1
    receiver.feed(np.zeros((16, 16), np.uint8), frame=5)
    with pytest.raises(vocc.VoccError, match="frame = 5 comes after frame 5: numbers rise"):
        receiver.feed(np.zeros((16, 16), np.uint8), frame=5)
    with pytest.raises(vocc.VoccError, match="late = NaN"):
        receiver.feed(np.zeros((16, 16), np.uint8), late=float("nan"))
    with pytest.raises(vocc.VoccError, match="frame = 18446744073709551615: give a smaller number"):
        receiver.feed(np.zeros((16, 16), np.uint8), frame=2**64 - 1)
    receiver.feed(np.zeros((16, 16), np.uint8), frame=2**64 - 2)
    with pytest.raises(vocc.VoccError, match="give a smaller number"):
        receiver.feed(np.zeros((16, 16), np.uint8))


def test_images_of_another_depth_are_refused_and_the_rest_is_read() -> None:
    plain = vocc.Renderer("paper", level="fast", crop=True).render("8142241818244281")
    light = (plain / 118.0) ** 2.2
    kinds = {
        "levels of 8 bits": plain,
        "levels of more than 8 bits": np.round(light * 900).astype(np.uint16),
        "numbers in proportion to light": light.astype(np.float32),
    }
    for first, other in itertools.permutations(kinds, 2):
        receiver = vocc.Receiver(symbol_rate=100)
        receiver.feed(kinds[first])
        with pytest.raises(vocc.VoccError, match=f"its samples are {other}, those of the frames before are {first}"):
            receiver.feed(kinds[other])
        assert receiver.next_frame == 1
        assert vocc.as_hex(receiver.feed(kinds[first]).readings[0].bits) == "8142241818244281"
    with pytest.raises(vocc.VoccError, match="its samples are levels of more than 8 bits"):
        list(vocc.receive([plain, kinds["levels of more than 8 bits"]]))
    # Colours are 8 bits too.
    receiver = vocc.Receiver(symbol_rate=100)
    for image in (plain, np.repeat(plain[..., None], 3, axis=2)):
        assert len(receiver.feed(image).readings) == 1


def test_a_closed_receiver_says_so() -> None:
    with vocc.Receiver() as receiver:
        assert not receiver.closed
    for closed in (receiver, ended := vocc.Receiver()):
        if closed is ended:
            assert closed.finish() == []
        assert closed.closed
        with pytest.raises(vocc.VoccError, match="the receiver is closed: make another one"):
            closed.feed(np.zeros((16, 16), np.uint8))
        with pytest.raises(vocc.VoccError, match="closed"):
            closed.finish()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"fps": 0}, "fps = 0: give the camera's frames a second, above 0"),
        ({"fps": float("nan")}, "fps = NaN"),
        ({"symbol_rate": 1000}, "symbol"),
        ({"panels": 5}, "panels = 5: give 1 to 4"),
        ({"detector": "fisher"}, "choose ml, kmeans, kmeans-raw or otsu, or call evaluate"),
        ({"channel": "violet"}, 'no channel "violet": choose brightest, red, green, blue or grey'),
        ({"depth": 8}, "depth = 8: give 9 to 16 bits"),
        ({"interval": -1}, "an LED interval of -1 is not 0 to 100"),
        ({"camera": {"focal_px": 0}}, "focal"),
        ({"camera": {"distortion": [1, 2, 3]}}, "3 distortion coefficients: give k1, k2"),
        ({"camera": {"line_delay_exposures": 3}}, "a line_delay_exposures of 3 is not -2 to 2: give the time from one line to the next"),
        ({"camera": {"line_delay_exposures": float("nan")}}, "a line_delay_exposures of NaN is not -2 to 2"),
        ({"camera": {"encoding": "log"}}, "'log' is not an encoding: give linear, srgb, rec709, or a gamma of 1 to 4"),
    ],
)
def test_a_receiver_that_cannot_be_is_refused(settings: dict, words: str) -> None:
    with pytest.raises(vocc.VoccError) as fault:
        vocc.Receiver(**settings)
    assert words in str(fault.value)


@pytest.mark.parametrize(
    ("message", "kind", "words"),
    [
        ("", vocc.VoccError, "the message is empty: give 1 to 1024 bytes"),
        ("x" * 1025, vocc.VoccError, "the message has 1025 bytes, at most 1024 are allowed"),
        (None, TypeError, "a message is a str or bytes"),
        (3, TypeError, "a message is a str or bytes"),
    ],
)
def test_messages_that_cannot_be_sent_are_refused(message: Any, kind: type[Exception], words: str) -> None:
    for raw in (False, True):
        with pytest.raises(kind) as fault:
            vocc.transmit(message, raw=raw)
        assert words in str(fault.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"carrier_cycles": 1}, "1 cycles"),
        ({"carrier_cycles": 334}, "2 to 333"),
        ({"carrier_cycles": 40}, "3000"),
        ({"symbol_rate_hz": 1000.0}, "9 to 300"),
        ({"message": ""}, "the message is empty"),
    ],
)
def test_light_that_no_transmitter_shows_has_no_flicker(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(vocc.VoccError) as fault:
        vocc.flicker(**settings)
    assert words in str(fault.value)


@pytest.mark.parametrize(
    ("bits", "kind"),
    [
        (-1, vocc.VoccError),
        (2**64, vocc.VoccError),
        ("123", vocc.VoccError),
        ("+123456789abcdef", vocc.VoccError),
        (np.zeros((8, 7), bool), vocc.VoccError),
        (np.zeros((8, 8), np.uint8), TypeError),
        (np.zeros((1, 8, 8), bool), TypeError),
        (1.5, TypeError),
        (True, TypeError),
        (None, TypeError),
    ],
)
def test_bits_that_are_none_are_refused(bits: Any, kind: type[Exception]) -> None:
    with pytest.raises(kind, match="give an int from 0"):
        vocc.as_hex(bits)


def test_tables_that_no_transmitter_takes_are_refused(tmp_path) -> None:
    for text, words in (("]", "TOML"), ("illuminance_lx = [1]\ninterval = [1]\nl2a = [[9]]", "it must be 0.2 to 4")):
        with pytest.raises(vocc.VoccError, match=words):
            vocc.Table.from_toml(text)
    with pytest.raises(vocc.VoccError, match="cannot read it"):
        vocc.Table(tmp_path / "none.toml")
    for light, interval in ((-1, 1), (float("nan"), 1), (1, float("inf"))):
        with pytest.raises(vocc.VoccError, match="give a number from 0 up"):
            vocc.Table().l2a(light, interval)


def cyclic_list() -> list:
    values: list = []
    values.append(values)
    return values


def cyclic_dict() -> dict:
    values: dict = {}
    values["pose"] = values
    return values


def deep_list() -> list:
    values: list = []
    for _ in range(100_000):
        values = [values]
    return values


class Endless:
    """An object whose list is the object itself."""

    def tolist(self) -> "Endless":
        return self


@pytest.mark.parametrize("make", [cyclic_list, cyclic_dict, deep_list, Mock, Endless])
def test_what_never_gets_to_the_bottom_is_refused(make: Any) -> None:
    endless = make()
    with pytest.raises(vocc.VoccError, match="lists or dicts more than 8 deep, the limit for a scene: check whether one contains itself"):
        vocc.Scene("paper", distance_m=endless)
    with pytest.raises(vocc.VoccError, match="more than 8 deep"):
        vocc.Scene({"pose": endless})
    with pytest.raises(vocc.VoccError, match="more than 8 deep"):
        vocc.Scene({"panel": [{"pose": {"velocity_m_s": endless}}]})


def test_what_never_ends_is_refused() -> None:
    words = "is one of more than 1048576 values: the limit for a scene"
    with pytest.raises(vocc.VoccError, match=f"panel.dead_leds {words}"):
        vocc.Scene("paper", dead_leds=itertools.count())
    with pytest.raises(vocc.VoccError, match=words):
        vocc.Scene({"pose": itertools.repeat({})})
    wide = [0]
    for _ in range(6):
        wide = [wide] * 100
    with pytest.raises(vocc.VoccError, match=words):
        vocc.Scene("paper", distance_m=wide)


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20) | st.binary(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=12), inner, max_size=4),
    max_leaves=12,
)
any_array = arrays.arrays(
    dtype=arrays.scalar_dtypes(),
    shape=arrays.array_shapes(max_dims=4, max_side=40, min_side=0),
)


@relaxed
@given(anything)
def test_anything_may_be_given_for_a_scene(thing: Any) -> None:
    for call in (vocc.Scene, lambda thing: vocc.Scene("paper", distance_m=thing), lambda thing: vocc.Scene("paper", panel_seed=thing)):
        try:
            call(thing)
        except REFUSALS as fault:
            assert str(fault)


@relaxed
@given(st.sampled_from(vocc.Scene.keys()), anything)
def test_any_key_may_be_given_anything(key: str, thing: Any) -> None:
    try:
        scene = vocc.Scene("day", **{key: thing})
        assert vocc.Scene(scene.to_dict()) == scene
        scene.plan()
    except REFUSALS as fault:
        assert str(fault)


@relaxed
@given(any_array | anything)
def test_anything_may_be_given_for_an_image(thing: Any) -> None:
    for call in (vocc.decode, vocc.Receiver(detector="kmeans").feed):
        try:
            call(thing)
        except REFUSALS as fault:
            assert str(fault)


@relaxed
@given(arrays.arrays(np.uint8, (40, 40)), st.lists(st.floats(width=32), min_size=8, max_size=8))
def test_any_corners_may_be_given(image: np.ndarray, corners: list[float]) -> None:
    try:
        decoded = vocc.decode(image, corners=np.array(corners).reshape(4, 2), detector="kmeans")
        assert decoded.found or decoded.why
    except REFUSALS as fault:
        assert str(fault)


@relaxed
@given(anything | any_array)
def test_anything_may_be_given_for_bits_cameras_and_messages(thing: Any) -> None:
    for call in (vocc.as_hex, vocc.as_bits, vocc.transmit, lambda thing: vocc.Receiver(camera=thing), vocc.Camera, vocc.Table.from_toml):
        try:
            call(thing)
        except REFUSALS as fault:
            assert str(fault)


@pytest.mark.parametrize("seconds", [-1.0, -1e-300, 1.1e10, 1e300, float("inf"), float("nan")])
def test_times_of_diagnostics_have_a_range(seconds: float) -> None:
    receiver = vocc.Receiver()
    for name, call in {
        "time_s": receiver.diagnose,
        "latency_s": lambda seconds: receiver.diagnose(0, latency_s=seconds),
        "since_s": receiver.diagnose_silence,
    }.items():
        with pytest.raises(vocc.VoccError, match=f"{name} = .*: give seconds from 0 to 10000000000"):
            call(seconds)
    for counts in ({"dropped": -1}, {"unusable": 2**64}):
        with pytest.raises(OverflowError):
            receiver.diagnose(0, **counts)
    most = receiver.diagnose(1e10, dropped=2**64 - 1, unusable=2**64 - 1)
    assert most is not None and most[0].level == 1
    receiver.close()
    assert receiver.diagnose_silence(1e10) is not None
