# SPDX-License-Identifier: Apache-2.0
"""The outermost layer of the command line: whatever happens, one line and an exit code."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from plenofir.commands import app, rays
from plenofir.ground.errors import InputError, ToolError

PLENOFIR = Path(sys.executable).with_name("plenofir")

FAULTS = [
    (MemoryError(), 2, "not enough memory; use smaller images or ranges"),
    (RecursionError(), 2, "the input is nested too deeply"),
    (OverflowError("int too large"), 2, "a number in the input is too large (int too large)"),
    (OSError(errno.EACCES, "Permission denied", "/a/b"), 2, "/a/b: Permission denied; does it"),
    (OSError(errno.ENAMETOOLONG, "File name too long", "x" * 300), 2, "x" * 300 + ": File name"),
    (OSError(errno.ENOSPC, "No space left on device"), 2, "the system: No space left on device;"),
    (
        ModuleNotFoundError(name="distributed"),
        2,
        "the package distributed is missing; pip install",
    ),
    (ZeroDivisionError("a\nb"), 2, "internal error (ZeroDivisionError: a); run again with --debug"),
    (InputError("two\nlines", where="a\x1b[2J"), 2, r"a\x1b[2J: two\nlines"),
    (ToolError("ghdl failed"), 3, "ghdl failed"),
    (KeyboardInterrupt(), 130, "interrupted"),
]


@pytest.mark.parametrize(("error", "code", "text"), FAULTS, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("debug", [False, True])
def test_every_error_is_one_line(monkeypatch, capfd, error, code: int, text: str, debug) -> None:
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr(rays, "_model", fails)
    arguments = ["plenofir", "distance", "--camera", "f193-mla2", "-a", "1"]
    monkeypatch.setattr(sys, "argv", [*arguments, *(["--debug"] if debug else [])])
    with pytest.raises(SystemExit) as done:
        app.main()
    out, err = capfd.readouterr()
    assert (done.value.code, out) == (code, "")
    *before, last = err.splitlines()
    assert last.startswith(f"plenofir: {text}")
    if debug:
        assert before[0].startswith("Traceback")
        assert "in fails" in err
    else:
        assert not before


def run(*arguments: str, **settings: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PLENOFIR, *arguments], stderr=subprocess.PIPE, text=True, check=False, **settings
    )


@pytest.mark.parametrize("arguments", [("cameras",), ("cameras", "--json"), ("--version",)])
def test_standard_output_that_is_full(arguments: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        done = run(*arguments, stdout=full)
    assert done.returncode == 2
    assert done.stderr.startswith("plenofir: ")
    assert "No space left on device; make room" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("command", ["cameras", "--help"])
def test_a_reader_that_has_seen_enough(command: str) -> None:
    """Before a line, and before what Rich prints: tables and help."""
    read, write = os.pipe()
    os.close(read)
    done = run(command, stdout=write)
    os.close(write)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, "")


def test_names_that_are_no_text(tmp_path: Path) -> None:
    done = run("plan", os.fsdecode(b"\xff.toml"), stdout=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stderr.startswith(r"plenofir: \udcff.toml: no such scene; give ")
    done = run("refocus", os.fsdecode(b"\xff.png"), "-M", "5", "-a", "1", env={"LC_ALL": "POSIX"})
    assert done.returncode == 2
    assert done.stderr.startswith(r"plenofir: \udcff.png: no such file or folder")


@pytest.mark.parametrize(
    ("number", "code", "text"),
    [(signal.SIGINT, 130, "plenofir: interrupted\n"), (signal.SIGTERM, 143, "")],
)
def test_signals_leave_nothing_behind(tmp_path: Path, number: int, code: int, text: str) -> None:
    waiting = (
        "import sys, time; from pathlib import Path\n"
        "from plenofir.commands import app, rays; from plenofir.ground.files import Results\n"
        "def wait(*_):\n"
        "    with Results(Path('out')) as results:\n"
        "        results.write('a', 'x'); time.sleep(60)\n"
        "rays._model = wait; sys.argv[1:] = ['baseline', '--camera', 'x']; app.main()\n"
    )
    done = subprocess.Popen(
        [sys.executable, "-c", waiting], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    while not list(tmp_path.glob("out/.plenofir-*/a")):
        time.sleep(0.02)
    done.send_signal(number)
    _, errors = done.communicate(timeout=60)
    assert (done.returncode, errors) == (code, text)
    assert not list((tmp_path / "out").iterdir())


def test_an_interrupt_while_it_is_loaded() -> None:
    code = (
        "import sys\n"
        "class Interrupt:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'typer': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupt())\n"
        "import runpy; runpy.run_module('plenofir', run_name='__main__')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "plenofir: interrupted\n")


# What each library warns of where someone brings odd data, and what it logs.
_WARNINGS = {
    "numpy": "import numpy as n; n.ones(1) / n.zeros(1)",
    "scipy": "import scipy.linalg as s; s.solve([[1, 1], [1, 1 + 3e-16]], [1, 2])",
    "numba": "import warnings, numba.core.errors as e; warnings.warn(e.NumbaWarning('slow'))",
    "skimage": "import numpy as n, skimage.io as s; s.imsave('a.png', n.zeros((9, 9), 'uint8'))",
    "imageio": "import imageio; imageio.imread('a.png')",
    "log": "import logging; logging.getLogger('imageio').warning('a frame was resized')",
}


@pytest.fixture(scope="module")
def warned(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, list[str]]:
    """Standard error of the command, with and without --debug, cut at the end of each library."""
    lines = "\n".join(
        f"    {work}\n    print('end', file=sys.stderr)" for work in _WARNINGS.values()
    )
    script = (
        "import sys\nfrom plenofir import __main__\nfrom plenofir.commands import app\n"
        f"def run(_):\n{lines}\n    return 0\napp.run = run\n__main__.main()\n"
    )
    texts = {}
    for debug in (False, True):
        arguments = [sys.executable, "-c", script, *(["--debug"] if debug else [])]
        done = subprocess.run(
            arguments,
            cwd=tmp_path_factory.mktemp("warned"),
            stderr=subprocess.PIPE,
            text=True,
            check=True,
        )
        texts[debug] = done.stderr.split("end\n")
    return texts


@pytest.mark.parametrize("library", _WARNINGS)
def test_warnings_of_libraries_do_not_reach_the_user(warned, library: str) -> None:
    place = list(_WARNINGS).index(library)
    assert warned[False][place] == ""
    assert warned[True][place] != ""
