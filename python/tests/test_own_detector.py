"""User-defined detectors read the frames of evaluate and are counted like the others."""

import subprocess
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import vocc

HARD = vocc.Scene("night", distance_m=65, interval=0.5)
OPTIONS = ["night", "--set", "pose.distance_m=65", "--set", "panel.interval=0.5"]


def kmeans(frames: vocc.DetectorInput) -> np.ndarray:
    """The paper's detector, applied to pictures and corners."""
    read = [vocc.decode(image, corners=corners, detector="kmeans") for image, corners in zip(frames.images, frames.corners_px)]
    return np.stack([one.bits for one in read])


def agr(frames: vocc.DetectorInput) -> np.ndarray:
    return frames.features[..., 0] - 1


def same(one: vocc.Evaluation, other: vocc.Evaluation) -> None:
    one, other = one.to_dict(), other.to_dict()
    for key in one.keys() - {"detector", "seconds", "errors_by_frame"}:
        assert one[key] == other[key], key


@pytest.mark.parametrize("batch", [1, 100, 1024])
@pytest.mark.parametrize("random_reflectance", [False, True])
def test_a_function_that_does_what_kmeans_does_has_its_errors_bit_for_bit(batch: int, random_reflectance: bool) -> None:
    settings: dict[str, Any] = {"frames": 300, "seed": 4, "random_reflectance": random_reflectance, "threads": 2}
    own = vocc.evaluate(HARD, detector=kmeans, batch=batch, by_frame=True, **settings)
    theirs = vocc.evaluate(HARD, detector="kmeans", **settings)
    assert own.bit_errors > 100 and own.detector == "kmeans"
    same(own, theirs)
    pairs = vocc.evaluate(HARD, detector="kmeans", by_frame=True, **settings)
    same(pairs, theirs)
    assert own.errors_by_frame.dtype == np.uint8 and np.array_equal(own.errors_by_frame, pairs.errors_by_frame)
    assert theirs.errors_by_frame is None


@pytest.mark.parametrize("detector", ["ml", "fisher", "genie"])
def test_counting_by_frame_changes_no_count(detector: Any) -> None:
    settings: dict[str, Any] = {"frames": 64, "detector": detector, "threads": 2}
    told: list[int] = []
    by_frame = vocc.evaluate(HARD, by_frame=True, progress=told.append, **settings)
    same(by_frame, vocc.evaluate(HARD, **settings))
    assert sum(told) == 64
    assert by_frame.errors_by_frame.sum() == by_frame.bit_errors
    assert np.count_nonzero(by_frame.errors_by_frame) == by_frame.panel_errors


def test_it_gets_the_frames_of_evaluate_in_order_and_not_the_truth() -> None:
    seen: list[vocc.DetectorInput] = []

    def keep(frames: vocc.DetectorInput) -> np.ndarray:
        seen.append(frames)
        return agr(frames)

    told: list[int] = []
    found = vocc.evaluate(HARD, frames=250, seed=9, detector=keep, batch=100, by_frame=True, progress=told.append)
    [batch] = vocc.frames(HARD, 250, seed=9, batch=250, features=True)
    assert [frames.first for frames in seen] == [0, 100, 200] and told == [100, 100, 50]
    for name in ("images", "corners_px", "features"):
        assert np.array_equal(np.concatenate([getattr(frames, name) for frames in seen]), getattr(batch, name)), name
    assert sorted(seen[0].to_dict()) == ["corners_px", "features", "first", "images"]
    wrong = (batch.features[..., 0] > 1) != batch.bits
    assert found.errors_by_frame.tolist() == wrong.sum(axis=(1, 2)).tolist()
    assert found.bit_errors == wrong.sum() > 0
    assert found.bit_errors_across == wrong[batch.across].sum() > 0


@pytest.mark.parametrize(
    "answer",
    [
        lambda soft: soft > 0,
        lambda soft: (soft > 0).reshape(-1, 64),
        lambda soft: soft.reshape(-1, 64).astype(np.float64),
        lambda soft: (soft * 100).astype(np.float16),
        lambda soft: soft.astype(">f4"),
        lambda soft: np.asfortranarray(soft),
        lambda soft: ((soft > 0).astype(np.uint8) * 255).view(bool),
        lambda soft: np.asfortranarray(((soft > 0).astype(np.uint8) * 2).view(bool)),
        lambda soft: np.where(soft > 0, np.inf, -np.inf),
        lambda soft: np.where(soft > 0, soft, 0.0),
        lambda soft: np.repeat(soft, 2, axis=2)[:, :, ::2],
    ],
)
def test_bits_and_soft_values_of_any_kind_and_layout_say_the_same(answer: Any) -> None:
    expected = vocc.evaluate(HARD, frames=100, detector=agr)
    same(vocc.evaluate(HARD, frames=100, detector=lambda frames: answer(agr(frames))), expected)
    turned = vocc.evaluate(HARD, frames=100, detector=lambda frames: -agr(frames))
    assert turned.bit_errors == expected.bits - expected.bit_errors


@pytest.mark.parametrize(
    ("answer", "kind", "words"),
    [
        (None, TypeError, "the detector returned NoneType: return a NumPy array of bool"),
        ([[True] * 64] * 10, TypeError, "the detector returned list"),
        (np.zeros((10, 64), np.uint8), TypeError, "of shape [10, 64] and type uint8: return a NumPy array of bool"),
        (np.zeros((10, 64), complex), TypeError, "type complex128"),
        (np.full((10, 64), "x"), TypeError, "type <U1"),
        (np.zeros((10, 64), object), TypeError, "type object"),
        (np.zeros((9, 64), bool), vocc.VoccError, "of shape [9, 64] and type bool for 10 frames"),
        (np.zeros((10, 63), bool), vocc.VoccError, "of shape [10, 63]"),
        (np.zeros((10, 8, 8, 1), bool), vocc.VoccError, "of shape [10, 8, 8, 1]"),
        (np.zeros(640), vocc.VoccError, "of shape [640] and type float64"),
        (np.ma.masked_array(np.zeros((10, 64), bool), True), TypeError, "a masked array"),
        (np.ma.masked_array(np.zeros((10, 64))), TypeError, "give its filled(False), or filled(0.0) for soft values"),
        (np.array(True), vocc.VoccError, "of shape [] and type bool"),
        (np.where(np.arange(640) == 135, np.nan, 1).reshape(10, 64), vocc.VoccError, "NaN for LED 7 of frame 2: return a number"),
    ],
)
def test_what_is_no_reading_is_refused_by_name(answer: Any, kind: type[Exception], words: str) -> None:
    with pytest.raises(kind) as fault:
        vocc.evaluate("night", frames=10, detector=lambda frames: answer)
    assert type(fault.value) is kind and words in str(fault.value)


def test_what_is_no_detector_is_refused() -> None:
    for detector, kind in [(3, "int"), (["ml"], "list"), (np.zeros(3), "ndarray")]:
        with pytest.raises(TypeError, match=f"detector is of type {kind}: give a name, such as 'ml', or a function"):
            vocc.evaluate("night", frames=10, detector=detector)


def test_no_frames_at_a_time_are_refused_for_all_detectors() -> None:
    for detector in ("kmeans", agr):
        with pytest.raises(vocc.VoccError, match="batch = 0: give 1"):
            vocc.evaluate("night", frames=10, detector=detector, batch=0)


def test_what_it_raises_comes_out_at_once() -> None:
    calls = 0

    def fail(frames: vocc.DetectorInput) -> np.ndarray:
        nonlocal calls
        calls += 1
        if frames.first >= 20:
            raise LookupError(f"no model for frame {frames.first}")
        return agr(frames)

    begun = time.monotonic()
    with pytest.raises(LookupError, match="no model for frame 20"):
        vocc.evaluate("night", frames=10**9, detector=fail, batch=10)
    assert calls == 3 and time.monotonic() - begun < 10
    with pytest.raises(KeyboardInterrupt):
        vocc.evaluate("night", frames=10, detector=lambda frames: (_ for _ in ()).throw(KeyboardInterrupt))


def test_an_object_that_can_be_called_is_one() -> None:
    class Threshold:
        def __init__(self, at: float) -> None:
            self.at = at

        def __call__(self, frames: vocc.DetectorInput) -> np.ndarray:
            # Evaluating inside a detector is allowed.
            assert vocc.evaluate("paper", frames=1).frames == 1
            return frames.features[..., 0] > self.at

    found = vocc.evaluate(HARD, frames=100, detector=Threshold(1))
    assert found.detector == "Threshold"
    same(found, vocc.evaluate(HARD, frames=100, detector=agr))


@pytest.mark.parametrize("name", ["set", "set.npz"])
def test_frames_of_the_program_are_the_same(name: str, vocc_json, tmp_path: Path) -> None:
    out = tmp_path / name
    options = ["--count", 200, "--first", 50, "--seed", 9, "--features", "--detector", "ml", "--out", out]
    [report] = vocc_json("frames", *OPTIONS, *options)
    if out.is_dir():
        written = {path.stem: np.load(path) for path in out.glob("*.npy")}
    else:
        with np.load(out) as archive:
            written = dict(archive)
    [batch] = vocc.frames(HARD, 200, seed=9, first=50, batch=200, features=True)
    assert sorted(written) == ["across", "corners", "features", "frames", "read", "truth"]
    assert written["frames"].dtype == np.uint8 and np.array_equal(written["frames"], batch.images)
    assert written["truth"].dtype == bool and np.array_equal(written["truth"], batch.bits.reshape(200, 64))
    assert written["corners"].dtype == np.float32 and np.array_equal(written["corners"], batch.corners_px)
    assert np.array_equal(written["across"], batch.across)
    assert np.array_equal(written["features"], batch.features.reshape(200, 64, 3))
    ml = vocc.evaluate(HARD, frames=250, seed=9, detector="ml", by_frame=True)
    wrong = (written["read"] != written["truth"]).sum(axis=1)
    assert wrong.tolist() == ml.errors_by_frame[50:].tolist()
    assert report["bit_errors"] == wrong.sum() > 0
    assert report["size_px"][::-1] == list(batch.images.shape[1:])


def test_pictures_of_the_program_are_the_same(program: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    subprocess.run([program, "frames", *OPTIONS, "--count", "20", "--format", "png", "--out", out], check=True, capture_output=True)
    lines = [line.split(",") for line in (out / "truth.csv").read_text().splitlines()[1:]]
    for line, frame in zip(lines, vocc.frames(HARD, 20), strict=True):
        assert np.array_equal(cv2.imread(str(out / line[1]), cv2.IMREAD_UNCHANGED), frame.image)
        assert (line[2], line[3]) == (vocc.as_hex(frame.bits), str(int(frame.across)))
        assert np.array_equal(np.array(line[4:], np.float32).reshape(4, 2), frame.corners_px)
