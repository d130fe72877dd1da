"""Pictures are bit for bit those of the program."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import vocc


@pytest.mark.parametrize(
    ("scene", "overrides", "level", "arguments"),
    [
        ("night", {"distance_m": 70}, "fine", {"bits": "8142241818244281", "frame": 3}),
        ("day", {}, "fast", {"seed": 9, "frame": 12}),
        ("paper", {"roll_deg": 7}, "reference", {"bits": 0x8040201008040201}),
    ],
)
def test_frames_and_light_are_those_of_the_program(
    scene: str, overrides: dict, level: str, arguments: dict, vocc_json, tmp_path: Path
) -> None:
    image, light = tmp_path / "frame.png", tmp_path / "light.npy"
    options = ["--level", level, "--crop", "--out", image, "--linear", light]
    for key, value in arguments.items():
        options += [f"--{key}", vocc.as_hex(value) if key == "bits" else value]
    full_names = {"distance_m": "pose.distance_m", "roll_deg": "pose.roll_deg"}
    for key, value in overrides.items():
        options += ["--set", f"{full_names[key]}={value}"]
    [report] = vocc_json("render", scene, *options)
    renderer = vocc.Renderer(vocc.Scene(scene, **overrides), level=level, crop=True)
    frame = renderer.render(**arguments)
    assert np.array_equal(frame, cv2.imread(str(image), cv2.IMREAD_UNCHANGED))
    linear = renderer.render(**arguments, linear=True)
    expected = np.load(light)
    assert linear.dtype == expected.dtype
    assert np.array_equal(linear, expected)
    assert list(renderer.origin_px) == report["origin_px"]
    assert list(renderer.shape) == report["size_px"][::-1]
    assert renderer.corners_px.tolist() == report["corners_px"]
    assert renderer.error_bound_grey == report["error_bound_grey"]
    if "bits" not in arguments:
        told = renderer.bits(frame=arguments["frame"], seed=arguments["seed"])
        assert vocc.as_hex(told) == report["bits"]


def test_the_whole_sensor_is_the_default_and_one_call_is_enough() -> None:
    scene = vocc.Scene("dusk")
    frame = vocc.render(scene, bits=5, frame=2, level="fast", seed=4)
    assert (frame.shape, frame.dtype) == ((1080, 1920), np.uint8)
    assert np.array_equal(frame, vocc.Renderer(scene, level="fast").render(5, frame=2, seed=4))
    assert frame.flags.c_contiguous and frame.flags.writeable


def test_bits_are_an_int_a_text_or_an_array() -> None:
    bits = np.zeros((8, 8), bool)
    bits[0, 1] = bits[7, 7] = True
    word = 1 << 63 | 2
    assert vocc.as_hex(bits) == vocc.as_hex(word) == "8000000000000002"
    assert np.array_equal(vocc.as_bits(word), bits)
    assert np.array_equal(vocc.as_bits("8000000000000002"), bits)
    renderer = vocc.Renderer("paper", level="fast", crop=True)
    assert np.array_equal(renderer.render(bits), renderer.render(word))
    # The result does not depend on the memory layout.
    assert vocc.as_hex(np.asfortranarray(bits)) == vocc.as_hex(bits)


def test_frames_are_those_that_evaluations_see_with_their_truth() -> None:
    scene = vocc.Scene("night", distance_m=60)
    [batch] = vocc.frames(scene, 300, seed=3, batch=300, features=True, threads=2)
    assert batch.images.shape == (300, *vocc.frames(scene).shape)
    for frame in vocc.frames(scene, 300, seed=3, features=True):
        k = frame.frame
        assert np.array_equal(frame.image, batch.images[k])
        assert np.array_equal(frame.bits, batch.bits[k])
        assert np.array_equal(frame.corners_px, batch.corners_px[k])
        assert np.array_equal(frame.features, batch.features[k])
        assert frame.across == batch.across[k]
    # A frame is the same alone, in another batch, or without features.
    later = list(vocc.frames(scene, 100, seed=3, first=250, batch=33))
    assert [len(part.images) for part in later] == [33, 33, 33, 1]
    assert [part.first for part in later] == [250, 283, 316, 349]
    assert np.array_equal(later[0].images, vocc.frames(scene, 33, seed=3, first=250, batch=33, threads=2).__next__().images)
    assert np.array_equal(later[0].images[:33], batch.images[250:283])
    assert not np.array_equal(batch.images, next(vocc.frames(scene, 300, seed=4, batch=300)).images)


def test_the_truth_is_what_a_decoder_reads() -> None:
    frames = vocc.frames(vocc.Scene("paper", distance_m=30), 20, seed=2)
    assert len(frames) == 20
    for frame in frames:
        decoded = vocc.decode(frame.image, corners=frame.corners_px, detector="kmeans")
        assert np.array_equal(decoded.bits, frame.bits)
    assert len(frames) == 0


def test_a_process_that_is_forked_goes_on_with_batches() -> None:
    code = """
import os, vocc
batches = vocc.frames("paper", 30, batch=10, threads=2)
next(batches)
child = os.fork()
images = next(batches).images
if child == 0:
    os._exit(images.shape[0])
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "10\n"


def test_threads_and_numbers_out_of_range_are_refused() -> None:
    with pytest.raises(vocc.VoccError, match=r"threads = 0: give 1 to 1024"):
        vocc.frames("paper", 10, batch=5, threads=0)
    with pytest.raises(vocc.VoccError, match=r"threads = 1025: give 1 to 1024"):
        vocc.frames("paper", 10, threads=1025)
    with pytest.raises(vocc.VoccError, match=r"batch = 0: give 1 to"):
        vocc.frames("paper", 10, batch=0)
    with pytest.raises(vocc.VoccError, match=r"more than 2\*\*64 - 1"):
        vocc.frames("paper", 10, first=2**64 - 5)
    with pytest.raises(vocc.VoccError, match="no level \"finest\": choose reference, fine or fast"):
        vocc.render("paper", level="finest")  # type: ignore[arg-type]
    with pytest.raises(vocc.VoccError, match="choose fine or fast"):
        vocc.frames("paper", level="reference")  # type: ignore[arg-type]
    with pytest.raises(OverflowError):
        vocc.render("paper", frame=-1)
