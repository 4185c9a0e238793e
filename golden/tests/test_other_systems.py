# SPDX-License-Identifier: Apache-2.0
"""The package without simulators needs nothing that only POSIX systems have.

Windows and macOS themselves were not at hand.
"""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import plenofir
from plenofir.camera.calibration import load_calibration
from plenofir.ground.images import read_image, write_png
from plenofir.ground.locks import lock_file
from plenofir.refocus import refocus
from plenofir_studies.synthetic import regular_grid, white_image

PACKAGE = Path(plenofir.__file__).parent
# Modules and names that Windows lacks (Python's documentation, "Availability").
MODULES = {
    *("fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"),
}
OF_OS = {
    *("O_CLOEXEC", "O_DIRECTORY", "O_NOCTTY", "O_NOFOLLOW", "O_NONBLOCK", "O_SYNC", "WEXITSTATUS"),
    *("WIFEXITED", "WIFSIGNALED", "WNOHANG", "WTERMSIG", "chown", "chroot", "confstr", "ctermid"),
    *("fchdir", "fchmod", "fchown", "fdatasync", "fork", "forkpty", "fpathconf", "fstatvfs"),
    *("getegid", "geteuid", "getgid", "getgroups", "getloadavg", "getpgid", "getpgrp"),
    *("getpriority", "getrandom", "getuid", "getxattr", "kill", "killpg", "lchown", "listxattr"),
    *("lockf", "major", "makedev", "memfd_create", "minor", "mkfifo", "mknod", "nice", "openpty"),
    *("pathconf", "pidfd_open", "pipe2", "posix_fadvise", "posix_fallocate", "posix_spawn"),
    *("pread", "preadv", "pwrite", "pwritev", "readv", "register_at_fork", "sched_getaffinity"),
    *("sched_setaffinity", "sched_yield", "sendfile", "setpgid", "setpriority", "setsid", "setuid"),
    *("setxattr", "splice", "statvfs", "sync", "sysconf", "tcgetpgrp", "ttyname", "uname", "wait"),
    *("wait3", "wait4", "waitid", "writev"),
}
OF_SIGNAL = {
    *("SIGALRM", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGSTOP", "SIGUSR1", "SIGUSR2", "alarm"),
    *("pthread_sigmask", "setitimer", "sigwait", "siginterrupt"),
}
# The driver opens devices that Linux makes.
OF_LINUX = {"accesses.py"}
# These rooms run tools for Linux, with files of their own.
TOOLS = {"bitstream", "simulate", "synthesis", "tools"}


def guarded(tree: ast.AST) -> set[ast.AST]:
    """What runs only where the system has it: below `hasattr`, or a question for the platform."""
    inside: set[ast.AST] = set()
    for node in ast.walk(tree):
        conditional = isinstance(node, ast.If | ast.IfExp)
        if conditional and re.search("sys.platform|hasattr", ast.unparse(node.test)):
            inside |= set(ast.walk(node))
    return inside


def only_posix(path: Path) -> list[str]:
    tree = ast.parse(path.read_text())
    inside, places = guarded(tree), list[str]()
    for node in ast.walk(tree):
        names: set[str] = set()
        if isinstance(node, ast.Import):
            names = {alias.name for alias in node.names} & MODULES
        elif isinstance(node, ast.ImportFrom):
            names = {str(node.module)} & MODULES
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            lacking = {"os": OF_OS, "signal": OF_SIGNAL}.get(node.value.id, set())
            names = {node.attr} & lacking
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            # Windows' own encoding is cp1252; the encoding is the first or the second argument.
            place = {"read_text": 1, "write_text": 2}.get(node.func.attr, 0)
            if len(node.args) < place and "encoding" not in {word.arg for word in node.keywords}:
                names = {f"encoding of {node.func.attr}"}
        if names and node not in inside:
            places.append(f"{path.name}:{node.lineno}: {', '.join(names)}")
    return places


def test_nothing_of_posix_alone() -> None:
    files = [path for path in PACKAGE.rglob("*.py") if path.name not in OF_LINUX]
    places = [(path.parent.name, place) for path in files for place in only_posix(path)]
    assert [p for room, p in places if room not in TOOLS or ": encoding of" not in p] == []


def test_what_is_of_posix_alone_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_text(
        "import fcntl\nimport os, signal, sys\nos.fork()\n"
        "if hasattr(os, 'fork'):\n    os.fork()\nsignal.signal(signal.SIGHUP, print)\n"
        "path.read_text()\npath.read_text('utf-8')\npath.write_text('a', encoding='utf-8')\n"
    )
    places = ["a.py:1: fcntl", "a.py:3: fork", "a.py:6: SIGHUP", "a.py:7: encoding of read_text"]
    assert sorted(only_posix(path)) == places


LACKING = """
import os, signal, sys, warnings
# These modules choose by the system, and take another way on Windows.
import asyncio, multiprocessing.util, numpy, platform, subprocess, tempfile, uuid
import pkgutil, plenofir
from importlib import import_module
for name in {modules}:
    sys.modules[name] = None
for module, names in ((os, {of_os}), (signal, {of_signal})):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
# Windows writes text as cp1252.
warnings.filterwarnings("error", category=EncodingWarning, module="plenofir")
for module in pkgutil.walk_packages(plenofir.__path__, "plenofir."):
    if module.name != "plenofir.__main__" and "_project" not in module.name:
        import_module(module.name)
from plenofir.commands.app import run
sys.exit(any([run(words.split()) for words in {commands}]))
"""


def test_commands_where_posix_is_missing(tmp_path: Path) -> None:
    shape = (180, 160)
    white = white_image(shape, regular_grid(shape, 10.2))
    generator = np.random.default_rng(3)
    raw = np.rint(white * generator.uniform(0.2, 1.0, shape)).astype(np.uint16)
    aligned = generator.integers(0, 256, (60, 70), np.uint8)
    for name, picture in (("white", white), ("raw", raw), ("aligned", aligned)):
        write_png(tmp_path / f"{name}.png", picture)
    commands = [
        "calibrate white.png --out calib.json",
        "develop raw.png --calib calib.json -M 9 --slices 2 --out developed",
        "refocus aligned.png -M 5 -a 1/5 --interpolation nearest",
    ]
    code = LACKING.format(modules=MODULES, of_os=OF_OS, of_signal=OF_SIGNAL, commands=commands)
    words = [sys.executable, "-X", "warn_default_encoding", "-c", code]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert load_calibration(tmp_path / "calib.json").grid.layout == "rectangular"
    assert len([*(tmp_path / "developed").glob("refocused_*.png")]) == 2
    want = refocus(aligned, 5, "1/5", border="normalise")
    assert np.array_equal(read_image(tmp_path / "refocused.png"), want)


def test_locks_end_with_their_file(tmp_path: Path) -> None:
    files = [os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT) for _ in range(2)]
    lock_file(files[0], wait=False)
    with pytest.raises(BlockingIOError):
        lock_file(files[1], wait=False)
    os.close(files[0])
    lock_file(files[1], wait=True)
    os.close(files[1])
