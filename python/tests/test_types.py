"""The stubs match the module, and two strict type checkers accept correct code and reject wrong code."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent


def check(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=FOLDER)


CHECKERS = {"mypy": ("mypy", "--strict"), "pyright": ("pyright", "--pythonpath", sys.executable)}


def test_stubs_are_of_what_there_is() -> None:
    done = check("mypy.stubtest", "vocc._vocc")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("checker", CHECKERS)
def test_right_code_passes_and_wrong_code_is_rejected(checker: str, tmp_path: Path) -> None:
    strict = "# pyright: strict\n" if checker == "pyright" else ""
    right = tmp_path / "right.py"
    right.write_text(strict + (FOLDER / "typed_example.py").read_text())
    done = check(*CHECKERS[checker], right)
    assert done.returncode == 0, done.stdout
    wrong = tmp_path / "wrong.py"
    faults = ["vocc.evaluate('paper', detector='guess')", "vocc.evaluate('paper', detector=len)", "vocc.Receiver().feed('text')", "vocc.Scene('day').plan()[0].bound"]
    wrong.write_text("\n".join(["import vocc", *faults]))
    done = check(*CHECKERS[checker], wrong)
    lines = {line.split(":")[1] for line in done.stdout.splitlines() if "error:" in line}
    assert lines == {"2", "3", "4", "5"}, done.stdout
