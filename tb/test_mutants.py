"""The mutation check: most small changes of the VHDL are noticed."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from plenofir import project

SCRIPT = project.root() / "scripts" / "mutate.py"


@pytest.mark.slow
def test_most_mutants_are_killed(tmp_path: Path) -> None:
    out = tmp_path / "mutants.json"
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--count", "120", "--out", str(out)],
        capture_output=True,
        text=True,
        check=True,
    )
    print(done.stdout)
    found = re.search(r"(\d+) of (\d+) mutants killed", done.stdout)
    assert found
    killed, counted = map(int, found.groups())
    assert counted >= 100
    assert killed / counted >= 0.8
    assert len(json.loads(out.read_text())) == 120
