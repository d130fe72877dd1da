"""Evaluations and searches are bit for bit those of the program, on any number of threads; they report progress and can be stopped."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas
import pytest
from tqdm import tqdm

import vocc


@pytest.mark.parametrize(
    ("scene", "settings", "options"),
    [
        ("paper", {"random_reflectance": True, "seed": 5}, ["--random-reflectance", "--seed", 5]),
        ("night", {"detector": "best", "frames": 300}, ["--detector", "best", "--frames", 300]),
        ("dusk", {"detector": "fisher", "level": "fine"}, ["--detector", "fisher", "--level", "fine"]),
        ("night", {"detector": "genie", "frames": 64}, ["--detector", "genie", "--frames", 64]),
    ],
)
def test_an_evaluation_is_that_of_the_program(scene: str, settings: dict, options: list, vocc_json) -> None:
    [printed] = vocc_json("evaluate", scene, *options)
    for threads in (1, 2):
        found = vocc.evaluate(scene, threads=threads, **settings).to_dict()
        same = (found.keys() & printed.keys()) - {"seconds", "plan"}
        assert same >= {"frames", "bits", "bit_errors", "ber", "ber_95", "bvar", "wvar", "b2w"}
        for key in same:
            expected = printed[key]
            assert found[key] == (tuple(expected) if isinstance(expected, list) else expected), key
        assert [row["effect"] for row in found["plan"]] == [row["effect"] for row in printed["plan"]]


def test_rare_events_are_reached_as_by_the_program(vocc_json) -> None:
    overrides = {"pose.distance_m": 50, "effects.noise": "on"}
    options = [part for key, value in overrides.items() for part in ("--set", f"{key}={value}")]
    [printed] = vocc_json("evaluate", "paper", "--rare-events", "--frames", 256, *options)
    found = vocc.evaluate(vocc.Scene("paper", **overrides), rare_events=True, frames=256)
    assert (found.ber, list(found.ber_95), found.frames) == (printed["ber"], printed["ber_95"], printed["frames"])
    assert found.bvar is None


def test_a_search_is_that_of_the_program(vocc_json, tmp_path: Path) -> None:
    table = tmp_path / "table.toml"
    options = ["--intervals", "0.5,1", "--distances", "50", "--frames", 1024, "--tolerance", 0.05, "-o", table]
    printed = vocc_json("optimize", "night", *options)
    done: list[int] = []
    found = vocc.optimize(
        "night", intervals=[0.5, 1], distances=[50], frames=1024, tolerance=0.05, threads=2, progress=done.append
    )
    assert found.to_toml() == table.read_text()
    cells = [row for row in printed if "distance_m" in row]
    assert [f"{cell.l2a:.4e}" for cell in found.optima] == [f"{row['l2a']:.4e}" for row in cells]
    assert [entry.interval for entry in found.entries] == [0.5, 1]
    assert len(done) > 2 and min(done) > 0
    carried = vocc.Table(table)
    assert carried.ratios.tolist() == found.table.ratios.tolist() == vocc.Table.from_toml(found.to_toml()).ratios.tolist()
    assert carried.l2a(50, 1) == carried.ratios[0, 1]
    frame = pandas.DataFrame(found.to_dict()["optima"])
    assert list(frame["interval"]) == [0.5, 1]


def test_the_shipped_table_is_that_of_the_program(vocc_json) -> None:
    [printed] = vocc_json("table", "show")
    shipped = vocc.Table()
    assert shipped.illuminance_lx.tolist() == printed["illuminance_lx"]
    assert shipped.interval.tolist() == printed["interval"]
    assert shipped.ratios.tolist() == printed["l2a"]
    assert vocc.Table.from_toml(shipped.to_toml()).ratios.tolist() == printed["l2a"]
    for row, light in enumerate(shipped.illuminance_lx):
        assert shipped.l2a(light, 1.0) == pytest.approx(shipped.ratios[row, list(shipped.interval).index(1.0)], abs=1 / 8192)


def test_progress_fits_tqdm_and_adds_up() -> None:
    with tqdm(total=20_000, disable=True) as bar:
        told: list[int] = []
        vocc.evaluate("paper", frames=20_000, threads=2, progress=lambda more: (told.append(more), bar.update(more)))
    assert sum(told) == 20_000
    assert len(told) >= 2


def test_what_progress_raises_ends_the_call_and_comes_out() -> None:
    def full(_more: int) -> None:
        raise LookupError("enough")

    begun = time.monotonic()
    with pytest.raises(LookupError, match="enough"):
        vocc.evaluate("night", frames=10**9, threads=2, progress=full)
    assert time.monotonic() - begun < 30


@pytest.mark.parametrize(
    "call",
    [
        "vocc.evaluate('night', frames=10**10, detector='best', threads=2)",
        "vocc.optimize('night', frames=10**8, tolerance=0, threads=2)",
        "next(vocc.frames('paper', 10**6, batch=10**6, threads=2))",
        "vocc.evaluate('night', frames=10**10, detector=lambda frames: frames.features[..., 0] - 1, threads=2)",
        "vocc.evaluate('night', frames=10**9, detector=lambda frames: time.sleep(60), threads=2)",
        "vocc.evaluate('night', frames=10**9, detector='ml', by_frame=True, threads=2)",
    ],
)
def test_control_c_ends_a_long_call(call: str) -> None:
    # A test runner in the background may have disabled Ctrl-C.
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heard}\nimport time, vocc; print('begun', flush=True)\ntry:\n    {call}\nexcept KeyboardInterrupt:\n    print('interrupted')"
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "begun\n"
    time.sleep(1.5)
    os.kill(child.pid, signal.SIGINT)
    begun = time.monotonic()
    said, _ = child.communicate(timeout=60)
    assert "interrupted" in said
    assert time.monotonic() - begun < 10


def test_other_threads_run_while_a_call_works() -> None:
    code = """
import threading, time, vocc
counted = 0
ended = threading.Event()
def count():
    global counted
    while not ended.is_set():
        counted += 1
        time.sleep(0.001)
counter = threading.Thread(target=count)
counter.start()
vocc.evaluate("night", frames=1000, detector="best", threads=1)
seen = counted
ended.set(); counter.join()
print(seen)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(done.stdout) > 20


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"frames": 0}, "frames = 0: give 1 to"),
        ({"threads": 0}, "threads = 0: give 1 to 1024"),
        ({"detector": "guess"}, 'no detector "guess": choose one of best, ml, kmeans'),
        ({"level": "reference"}, "the reference level is for single frames"),
        ({"camera": {"encoding": 9}}, "a gamma of 9 is not 1 to 4"),
        ({"camera": {"blur_sigma_px": 99}}, "a blur of 99 px is not 0.3 to 4 px"),
        ({"rare_events": True}, "this scene simulates no noise"),
        ({"rare_events": True, "by_frame": True}, "rare_events counts no errors of frames"),
        ({"frames": 2**32 + 1, "by_frame": True}, "give at most 4294967296 with by_frame"),
        ({"detector": len, "rare_events": True}, "rare_events and camera are for detectors by name"),
        ({"detector": len, "camera": {"encoding": 2.2}}, "rare_events and camera are for detectors by name"),
        ({"detector": len, "batch": 0}, "batch = 0: give 1 to"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(settings: dict, words: str) -> None:
    with pytest.raises(vocc.VoccError) as fault:
        vocc.evaluate("paper", **settings)
    assert words in str(fault.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"intervals": []}, "no interval to try"),
        ({"distances": [0]}, "distance_m = 0: must be"),
        ({"illuminances": [5, 1]}, "sort the axis"),
        ({"criterion": "reach"}, 'no criterion "reach": choose b2w, fisher or ber'),
        ({"rule": "median"}, 'no rule "median": choose mean or least-ber'),
        ({"range": (4, 0.2)}, "it must ascend"),
        ({"frames": 3, "distances": [50], "intervals": [1]}, "3 frames are too few"),
        ({"tolerance": -1, "distances": [50], "intervals": [1]}, "it must be 0"),
    ],
)
def test_what_cannot_be_searched_is_refused(settings: dict, words: str) -> None:
    with pytest.raises(vocc.VoccError) as fault:
        vocc.optimize("paper", **settings)
    assert words in str(fault.value)
