"""Scenes: presets, files, dicts and keys, and the errors about invalid ones."""

import copy
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import vocc


def test_a_scene_comes_from_a_preset_a_file_a_text_or_a_dict(program: Path, tmp_path: Path) -> None:
    night = vocc.Scene("night", distance_m=70)
    printed = subprocess.run([program, "scene", "night"], capture_output=True, text=True, check=True).stdout
    file = tmp_path / "night.toml"
    file.write_text(printed)
    assert vocc.Scene(str(file), distance_m=70) == night
    assert vocc.Scene(file, distance_m=70) == night
    assert vocc.Scene.from_toml(printed, distance_m=70) == night
    assert vocc.Scene.from_toml(night.to_toml()) == night
    assert vocc.Scene(night.to_dict()) == night
    assert vocc.Scene(night) == night
    assert vocc.Scene("night").with_(distance_m=70) == night
    assert vocc.Scene("night") != night
    assert vocc.Scene() == vocc.Scene("paper")
    assert set(vocc.Scene.presets()) >= {"paper", "day", "dusk", "night", "fog"}


def test_a_scene_can_be_copied_and_sent_to_other_processes() -> None:
    scene = vocc.Scene("dusk", dead_leds=[3, 17], board_reflectance=0.05)
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert copy.deepcopy(scene) == scene
    assert repr(vocc.Scene("paper", distance_m=60)) == "Scene(pose.distance_m=60.0)"


def test_values_are_read_back_under_their_names() -> None:
    scene = vocc.Scene("paper", distance_m=np.float32(62.5), velocity_m_s=np.array([1, 0, -3]), **{"panel.seed": np.int64(4)})
    assert scene["distance_m"] == scene["pose.distance_m"] == 62.5
    assert scene["velocity_m_s"] == [1, 0, -3]
    assert scene["panel.seed"] == 4
    assert scene["board_reflectance"] is None
    board = scene.with_(board_reflectance=0.1, noise="on")
    assert (board["board_reflectance"], board["effects.noise"]) == (0.1, "on")
    assert board.with_(board_reflectance=None, noise=None)["board_reflectance"] is None
    tilted = scene.with_(**{"panel.pose.yaw_deg": 20})
    assert tilted["panel.pose.yaw_deg"] == 20


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"distance_cm": 3}, 'scene key "distance_cm": there is no such key; the nearest is pose.distance_m'),
        ({"pose.distance": 3}, "the nearest is pose.distance_m"),
        ({"seed": 3}, "write camera.seed or panel.seed"),
        ({"distance_m": 0}, "pose.distance_m = 0: must be a number from 0.5 to 2000"),
        ({"distance_m": float("nan")}, "pose.distance_m = NaN: must be"),
        ({"distance_m": 10**300}, "must be a number from 0.5 to 2000"),
        ({"distance_m": "far"}, "far"),
        ({"blurr": "on"}, "the nearest is effects.blur"),
        ({"background_image": "two\nlines.png"}, "line"),
    ],
)
def test_what_cannot_be_is_refused_with_the_way_out(overrides: dict[str, object], words: str) -> None:
    with pytest.raises(vocc.VoccError, match=r"\S") as fault:
        vocc.Scene("paper", **overrides)
    assert words in str(fault.value)


def test_unknown_keys_of_dicts_and_texts_are_refused_with_the_nearest() -> None:
    for make in (
        lambda: vocc.Scene({"pose": {"distance": 3}}),
        lambda: vocc.Scene.from_toml("[pose]\ndistance = 3"),
        lambda: vocc.Scene({"poses": {"distance_m": 3}}),
        lambda: vocc.Scene({"distance_m": 3}),
    ):
        with pytest.raises(vocc.VoccError, match=r"nearest is pose\.distance_m"):
            make()
    with pytest.raises(vocc.VoccError, match=r"nearest is panel\.interval"):
        vocc.Scene({"panel": [{"intervall": 1}]})


def test_what_is_no_scene_is_refused() -> None:
    with pytest.raises(vocc.VoccError, match="no scene \"noon\".*paper-18mm"):
        vocc.Scene("noon")
    for wrong in (3, [1], b"paper", object()):
        with pytest.raises(TypeError, match="a scene is the name of a preset"):
            vocc.Scene(wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="pose.distance_m is of type"):
        vocc.Scene("paper", distance_m=object())
    with pytest.raises(vocc.VoccError):
        vocc.Scene.from_toml("]")


def test_the_plan_says_what_is_simulated_and_why(vocc_json) -> None:
    printed = vocc_json("plan", "night", "--set", "pose.distance_m=70")
    plan = vocc.Scene("night", distance_m=70).plan()
    for decision, row in zip(plan, printed, strict=True):
        told = decision.to_dict()
        same = told.keys() & row.keys()
        assert same >= {"effect", "bound_grey", "included", "why"}
        assert {key: told[key] for key in same - {"cost"}} == {key: row[key] for key in same - {"cost"}}


def test_a_scene_that_cannot_be_seen_is_refused_where_it_is_looked_at() -> None:
    beside = vocc.Scene("paper", x_m=40)
    for look in (beside.plan, lambda: vocc.render(beside), lambda: vocc.frames(beside), lambda: vocc.evaluate(beside)):
        with pytest.raises(vocc.VoccError, match="sensor"):
            look()
