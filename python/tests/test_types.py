"""The stubs match the module, and a strict type checker accepts correct code and rejects wrong code."""

import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parent


def check(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=FOLDER)


def test_stubs_are_of_what_there_is() -> None:
    done = check("mypy.stubtest", "vocc._vocc")
    assert done.returncode == 0, done.stdout


def test_right_code_passes_and_wrong_code_is_told(tmp_path: Path) -> None:
    right = check("mypy", "--strict", FOLDER / "typed_example.py")
    assert right.returncode == 0, right.stdout
    wrong = tmp_path / "wrong.py"
    faults = ["vocc.evaluate('paper', detector='guess')", "vocc.evaluate('paper', detector=len)", "vocc.Receiver().feed('text')", "vocc.Scene('day').plan()[0].bound"]
    wrong.write_text("\n".join(["import vocc", *faults]))
    done = check("mypy", "--strict", wrong)
    assert done.stdout.count("error:") == 4, done.stdout
