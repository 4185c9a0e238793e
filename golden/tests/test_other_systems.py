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
from plenofir.ground.images import read_image, write_png
from plenofir.ground.locks import lock_file
from plenofir.refocus import refocus

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
        if names and node not in inside:
            places.append(f"{path.name}:{node.lineno}: {', '.join(names)}")
    return places


def test_nothing_of_posix_alone() -> None:
    files = [path for path in PACKAGE.rglob("*.py") if path.name not in OF_LINUX]
    assert [place for path in files for place in only_posix(path)] == []


def test_what_is_of_posix_alone_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_text(
        "import fcntl\nimport os, signal, sys\nos.fork()\n"
        "if hasattr(os, 'fork'):\n    os.fork()\nsignal.signal(signal.SIGHUP, print)\n"
    )
    assert only_posix(path) == ["a.py:1: fcntl", "a.py:3: fork", "a.py:6: SIGHUP"]


LACKING = """
import os, signal, sys
for name in {modules}:
    sys.modules[name] = None
for module, names in ((os, {of_os}), (signal, {of_signal})):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
import pkgutil, plenofir
from importlib import import_module
for module in pkgutil.walk_packages(plenofir.__path__, "plenofir."):
    if module.name != "plenofir.__main__" and "_project" not in module.name:
        import_module(module.name)
from plenofir.__main__ import main
sys.argv = ["plenofir", "refocus", "raw.png", "-M", "5", "-a", "1/5", "--interpolation", "nearest"]
main()
"""


def test_commands_where_posix_is_missing(tmp_path: Path) -> None:
    raw = np.random.default_rng(3).integers(0, 256, (60, 70), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    # What Python's own modules take on a POSIX system.
    modules = sorted(MODULES - {"posix"})
    code = LACKING.format(modules=modules, of_os={"fork", "register_at_fork"}, of_signal=OF_SIGNAL)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    want = refocus(raw, 5, "1/5", border="normalise")
    assert np.array_equal(read_image(tmp_path / "refocused.png"), want)


def test_locks_end_with_their_file(tmp_path: Path) -> None:
    files = [os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT) for _ in range(2)]
    lock_file(files[0], wait=False)
    with pytest.raises(BlockingIOError):
        lock_file(files[1], wait=False)
    os.close(files[0])
    lock_file(files[1], wait=True)
    os.close(files[1])
