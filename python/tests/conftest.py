"""The program that the package is compared with: $VOCC, or the one that `cargo test --workspace` has built."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from recorded import Recorded

ROOT = Path(__file__).parents[2]
# The package for ROS 2, which colcon would install.
sys.path.insert(0, str(ROOT / "python" / "ros2"))


@pytest.fixture(scope="session")
def program() -> Path:
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    path = Path(os.environ.get("VOCC", target / "debug" / "vocc"))
    assert path.exists(), f"{path} is not there: build it with `cargo build -p vocc`, or name another one in VOCC"
    return path


@pytest.fixture(scope="session")
def vocc_json(program: Path) -> Callable[..., list[dict[str, Any]]]:
    """Runs the program and returns its JSON output. Exit status 1, which means no, is a valid result."""

    def run(*arguments: object) -> list[dict[str, Any]]:
        done = subprocess.run([program, *map(str, arguments), "--json"], capture_output=True, text=True, check=False)
        assert done.returncode in (0, 1), done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()]

    return run


@pytest.fixture(scope="session")
def recorded(program: Path, tmp_path_factory: pytest.TempPathFactory, vocc_json: Callable[..., list[dict[str, Any]]]) -> Recorded:
    return Recorded(tmp_path_factory.mktemp("recording"), program, vocc_json)
