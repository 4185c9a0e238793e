# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of other projects' flows."""

from collections.abc import Callable
from pathlib import Path

from plenofir.ground import project

Run = Callable[..., str]
EXAMPLES = project.root() / "examples"


def icarus(run: Run, folders: list[Path], files: list[Path], program: Path, *defines: str) -> str:
    """Compile for Icarus Verilog and run; result: output of the bench."""
    includes = [f"-I{folder}" for folder in folders]
    warnings = run(
        "iverilog", "-g2005", "-Wall", "-Wno-timescale", "-o", program, *defines, *includes, *files
    )
    assert warnings == "", warnings
    return run("vvp", "-n", program)
