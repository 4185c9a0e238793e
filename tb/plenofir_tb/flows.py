# SPDX-License-Identifier: Apache-2.0
"""What the tests of other people's flows share."""

from collections.abc import Callable
from pathlib import Path

from plenofir.ground import project

Run = Callable[..., str]
EXAMPLES = project.root() / "examples"


def icarus(run: Run, folders: list[Path], files: list[Path], program: Path, *defines: str) -> str:
    """Compile for Icarus Verilog and run; what the bench prints."""
    includes = [f"-I{folder}" for folder in folders]
    warnings = run(
        "iverilog", "-g2005", "-Wall", "-Wno-timescale", "-o", program, *defines, *includes, *files
    )
    assert warnings == ""
    return run("vvp", "-n", program)
