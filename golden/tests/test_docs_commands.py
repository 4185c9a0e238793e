# SPDX-License-Identifier: Apache-2.0
"""Commands in the documentation exist and run, and so does its Python."""

import os
import re
import shlex
import shutil
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
from core_words import RefocuserWords
from docs_stock import make_docs_stock
from in_process import plenofir

from plenofir.commands.app import command_line
from plenofir.commands.option_names import VARIABLES
from plenofir.ground import project

ROOT = project.root()
PAGES = sorted(
    path.relative_to(ROOT)
    for path in (*ROOT.glob("*.md"), ROOT / "hdl/README.md", *ROOT.glob("docs/**/*.md"))
)
COMMAND = re.compile(r"(?:\.venv/bin/)?((?:plenofir|make) [^\n]+)")
# Of make itself, or of a script that a target calls.
OTHER_VARIABLES = {"JOBS", "SIM", "SCENE", "RECORD", "SEED", "CASE", "BARE", "ISE"}
# Placeholders for the reader's names.
EXAMPLES = {
    "--camera NAME": "--camera f197-mla2",
    "--device DEVICE": "--device lfe5u-85f",
    "FILE": "white.tif",
    "SCENE": "scenes/grey-microscope.toml",
    "my-scene.toml": "scenes/rgb-480p.toml",
    "CAMERA": "f197-mla2",
    "MM": "3000",
    "M": "11",
    "NAME": "quilt",
}
# Commands that are not run, and why.
NOT_RUN = {
    r"make (?!sim\b)": "tests, builds and long runs of the checkout itself; the target exists",
    r"plenofir report": "minutes each; their numbers have tests of their own",
    r"plenofir view (?!.*--export)": "serves until Ctrl-C; the tests of the viewer drive it",
    r"plenofir design .*--page": "serves until Ctrl-C, too; the test of its page drives it",
    r"plenofir (synth|bitstream)": "minutes of Yosys, and ISE; tests of their own",
    r"make sim.*CHAIN=hdmi": "minutes; the tests of the board run it",
    r"make sim SCENE=": "frames of megapixels; the tests of scenes run smaller ones",
    r"plenofir board load": "needs a board; tests of the load port type it to a simulated one",
    r"make sim (CHAIN=csi )?RAW=golden/": "a whole capture; tests of captures run smaller ones",
}


def commands_of(text: str) -> Iterator[str]:
    """Commands in the code blocks and between the backticks of a page, without comments."""
    found = re.findall(r"^    (.*)$", text, flags=re.M)
    for block in re.findall(r"^```(?:sh|console|)\n(.*?)^```", text, flags=re.S | re.M):
        found += block.splitlines()
    found += re.findall(r"`([^`\n]+)`", text)
    for line in found:
        match = COMMAND.fullmatch(line.replace("\\|", "|").strip())
        if match and not re.match(r"\w+ (or|and|is|as|on|in|has|to|with)\b|\w+:", match[1]):
            yield re.split(r"\s+(?:#|\|) ", match[1])[0].strip()


def is_synopsis(command: str) -> bool:
    """Whether it is a synopsis: parts in brackets, dots, or only the command's name."""
    return bool(re.search(r"\[|\.\.\.|=\s*$|= ", command))


def unknown(command: str) -> list[str]:
    """Unknown words of a command: commands, options, targets, variables."""
    tool, *words = shlex.split(re.sub(r"[][]|\.\.\.", " ", command).replace("|", " "))
    if tool == "make":
        makefile = (ROOT / "Makefile").read_text()
        targets = [word for word in words if re.fullmatch(r"[a-z-]+", word)]
        variables = [word.split("=")[0] for word in words if re.match(r"[A-Z_]+=", word)]
        known = {*VARIABLES, *OTHER_VARIABLES, *re.findall(r"\b([A-Z_]+)=", makefile)}
        return [
            *(t for t in targets if not re.search(rf"^{t}:", makefile, flags=re.M)),
            *(v for v in variables if v not in known),
        ]
    command_of: Any = command_line()
    for word in list(words):
        if word not in getattr(command_of, "commands", {}):
            break
        command_of = command_of.commands[words.pop(0)]
    if getattr(command_of, "commands", None):
        return [f"{tool} {' '.join(words[:1])}"] if words[:1] != ["--version"] else []
    options = {flag for p in command_of.params for flag in (*p.opts, *p.secondary_opts)}
    given = [w.split("=")[0] for w in words if re.match(r"--?[A-Za-z]", w)]
    return [flag for flag in given if flag not in options and flag != "--help"]


def run(command: str) -> str:
    """Run a command in the working folder; result: its complaint, if any."""
    for name, example in EXAMPLES.items():
        command = re.sub(rf"(?<!\S){name}(?!\S)", example, command)
    tool, *words = shlex.split(command)
    if tool == "make":
        target, *variables = words
        set_here = dict(variable.split("=", 1) for variable in variables)
        with mock.patch.dict(os.environ, {**set_here, "MAKEFLAGS": f" -- {shlex.join(variables)}"}):
            done = plenofir("--make", target)
    else:
        done = plenofir(*words)
    return "" if done.returncode == 0 else f"{command}: {done.stderr.strip()}"


def on_page(page: Path) -> list[str]:
    return list(dict.fromkeys(commands_of((ROOT / page).read_text())))


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_commands_exist(page: Path) -> None:
    assert {c: unknown(c) for c in on_page(page) if unknown(c)} == {}


def test_what_does_not_exist_is_found() -> None:
    page = "Type `make sims` or `plenofir refocuss x` or\n\n    plenofir refocus x --ax 1  # why\n"
    commands = list(commands_of(page))
    assert commands == ["plenofir refocus x --ax 1", "make sims", "plenofir refocuss x"]
    assert [unknown(c) for c in commands] == [["--ax"], ["sims"], ["plenofir refocuss"]]
    assert unknown("make sim RAV=1") == ["RAV"]


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs")
    make_docs_stock(folder)
    return folder


def to_run(page: Path) -> list[str]:
    """Commands with all arguments, except those of the changelog, which may have been renamed."""
    return [
        command
        for command in on_page(page)
        if re.search(r"\s\S*[./]\S|\s(--a|-a|--gap|folder|FILE|SCENE)(\s|$)|plan [a-z]", command)
        and page.name != "CHANGELOG.md"
        and not is_synopsis(command)
        and not any(re.match(why, command) for why in NOT_RUN)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if to_run(p)], ids=str)
def test_commands_run(
    stock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, page: Path
) -> None:
    """In the order of the page, each with the files that those before it left."""
    folder = tmp_path / "here"
    shutil.copytree(stock, folder, symlinks=True)
    monkeypatch.chdir(folder)
    ready = ["plenofir calibrate white.tif --dark dark.tif --out calib.json"]
    assert [complaint for c in (*ready, *to_run(page)) if (complaint := run(c))] == []


# Names that the pages' Python presupposes.
GIVEN = """
import numpy as np
from plenofir.camera.rays import RayModel, load_camera
raw = np.arange(66 * 77, dtype=np.uint8).reshape(66, 77)
model = RayModel.focused(load_camera("f193-mla2"), 3000.0, 11)
picture = np.random.default_rng(1).random((30, 40))
"""


def python_of(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), flags=re.S | re.M)


@pytest.mark.parametrize("page", [p for p in PAGES if python_of(p)], ids=str)
def test_python_runs(stock: Path, tmp_path: Path, page: Path, monkeypatch: Any) -> None:
    """All blocks of a page, one after the other, where a reader has the files that they name."""
    monkeypatch.chdir(tmp_path)
    # A board with a core.
    monkeypatch.setattr("plenofir.driver.find_uio", lambda: "/dev/uio0")
    monkeypatch.setattr("plenofir.driver.Uio", RefocuserWords)
    pynq = types.SimpleNamespace(MMIO=RefocuserWords, Overlay=str)
    monkeypatch.setitem(sys.modules, "pynq", pynq)
    for name in ("white.tif", "raw.png"):
        shutil.copy(stock / name, tmp_path)
    assert run("plenofir calibrate white.tif --out calib.json") == ""
    names: dict[str, Any] = {}
    exec(GIVEN, names)
    for block in python_of(page):
        if "self." in block:  # A part of a class; the LiteX example is the whole.
            continue
        exec(block, names)
