# SPDX-License-Identifier: Apache-2.0
"""What the package needs, and what it works without."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import plenofir
from plenofir.ground import project
from plenofir.ground.extras import EXTRAS
from plenofir.ground.images import write_png

PACKAGE = Path(plenofir.__file__).parent
PROJECT = tomllib.loads((project.root() / "pyproject.toml").read_text())["project"]
# Their modules have other names than the distributions.
MODULES = {
    "cuda-core": "cuda",
    "edalize": "edalize",
    "opencv-python-headless": "cv2",
    "pillow": "PIL",
    "pyserial": "serial",
}
# Of users' own libraries.
IF_THERE = {"cupy", "torch"}
# Brought by numba and by typer.
BROUGHT = {"llvmlite", "rich"}


def modules(requirements: list[str]) -> set[str]:
    names = [re.match(r"[\w-]+", text)[0] for text in requirements]
    return {MODULES.get(name, name.replace("-", "_")) for name in names}


def imported(path: Path) -> set[str]:
    """Packages that a module imports, wherever in its text."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(str(node.module))
    return {name.partition(".")[0] for name in names} - {"plenofir"} - sys.stdlib_module_names


def test_nine_packages_are_required() -> None:
    assert len(PROJECT["dependencies"]) == 9


def test_every_import_is_required_or_an_extra() -> None:
    required = modules(PROJECT["dependencies"]) | BROUGHT
    others = {name for path in PACKAGE.rglob("*.py") for name in imported(path)} - required
    assert others - EXTRAS.keys() - IF_THERE == set()
    assert required - {"imagecodecs"} <= {n for p in PACKAGE.rglob("*.py") for n in imported(p)}


@pytest.mark.parametrize("module", EXTRAS)
def test_extras_bring_their_modules(module: str) -> None:
    assert module in modules(PROJECT["optional-dependencies"][EXTRAS[module]])


CALLS = """
import sys
for name in {names}:
    sys.modules[name] = None
from plenofir.__main__ import main
for words in {calls}:
    sys.argv = ["plenofir", *words]
    try:
        main()
    except SystemExit as done:
        print("exit", done.code, *words)
"""


def without_extras(folder: Path, *calls: str) -> tuple[list[str], list[str]]:
    """Exit codes with the calls, and lines on standard error, of an environment without extras."""
    names = sorted(EXTRAS.keys() | {"skimage", "mpmath"})
    code = CALLS.format(names=names, calls=[call.split() for call in calls])
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True
    )
    exits = [line for line in done.stdout.splitlines() if line.startswith("exit ")]
    errors = [line for line in done.stderr.splitlines() if "compiling" not in line]
    return exits, errors


@pytest.fixture
def raw(tmp_path: Path) -> Path:
    pixels = np.random.default_rng(3).integers(0, 256, (60, 70), np.uint8)
    write_png(tmp_path / "raw.png", pixels)
    (tmp_path / "raw.pgm").write_bytes(b"P5 70 60 255\n" + pixels.tobytes())
    return tmp_path


def test_commands_without_extras(raw: Path) -> None:
    calls = (
        "refocus raw.png -M 5 -a 1/5 --interpolation nearest",
        "views raw.png -M 5",
        "inspect raw.png",
        "distance --camera f193-mla2 --micro-image 9 -a 1",
        "design --camera f193-mla2",
        "plan rgb-480p",
        "cameras",
    )
    exits, errors = without_extras(raw, *calls)
    assert exits == [f"exit 0 {call}" for call in calls], errors


@pytest.mark.parametrize(
    ("call", "extra"),
    [
        ("distance --camera f193-mla2 --micro-image 9 -a 1 --plot a.png", "plots"),
        ("design --camera f193-mla2 --page", "plots"),
        ("view raw.png -M 5 --no-browser", "view"),
        ("refocus raw.pgm -M 5 -a 1/5", "pnm"),
    ],
)
def test_commands_name_the_extra(raw: Path, call: str, extra: str) -> None:
    exits, errors = without_extras(raw, call)
    assert exits == [f"exit 2 {call}"]
    assert len(errors) == 1
    assert errors[0].endswith(f"pip install 'plenofir[{extra}]'")
    assert {path.name for path in raw.iterdir()} == {"raw.png", "raw.pgm"}
