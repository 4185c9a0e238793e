# SPDX-License-Identifier: Apache-2.0
"""Results appear whole or not at all, whatever fails."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from plenofir.ground.errors import InputError
from plenofir.ground.files import (
    Results,
    check_folder,
    checksum,
    publish,
    publish_files,
    publish_run,
    write_file,
)

pytestmark = pytest.mark.quick


@contextmanager
def file_limit(size: int) -> Iterator[None]:
    """Files of this process cannot grow beyond a size, as on a full disk."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
        signal.signal(signal.SIGXFSZ, handler)


def listing(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_files_replace_their_predecessors(tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    publish({"a": "first", "b": b"\0"}, out)
    publish({"a": "ä"}, out)
    write_file(out / "c", b"one")
    assert listing(out) == {"a": "ä".encode(), "b": b"\0", "c": b"one"}


WRITERS: dict[str, Callable[[Path, Path], None]] = {
    "texts": lambda _, out: publish({"a": "x", "b": "x" * 9999}, out),
    "file": lambda _, out: write_file(out / "a", b"x" * 9999),
    "copies": publish_files,
}


@pytest.mark.parametrize("writer", WRITERS)
def test_a_full_disk_leaves_the_old_files(tmp_path: Path, writer: str) -> None:
    out = tmp_path / "out"
    publish({"a": "old"}, out)
    source = tmp_path / "source"
    publish({"a": b"x" * 9999}, source)
    with (
        file_limit(4096),
        pytest.raises(InputError, match=r"cannot be written \(File too large\)"),
    ):
        WRITERS[writer](source, out)
    assert listing(out) == {"a": b"old"}


def test_no_room_is_named_with_its_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    # The last flush is where a full disk shows itself on some file systems.
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"No space left.*make room on the disk"):
        write_file(tmp_path / "a", b"x")
    assert listing(tmp_path) == {}


def test_an_error_in_the_block_leaves_nothing(tmp_path: Path) -> None:
    def fails() -> None:
        with Results(tmp_path / "out") as results:
            results.write("a", b"x")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert listing(tmp_path / "out") == {}


def test_a_folder_in_the_place_of_one_file_keeps_them_all_away(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    with pytest.raises(InputError, match=r"b is a folder"):
        publish({"a": "x", "b": "y"}, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def test_long_names_and_files_for_folders(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a shorter name"):
        write_file(tmp_path / ("x" * 300), b"")
    (tmp_path / "file").write_bytes(b"")
    for folder in ("file", "none"):
        with pytest.raises(InputError, match="no folder"):
            write_file(tmp_path / folder / "a", b"")
    with pytest.raises(InputError, match="not a folder"):
        check_folder(tmp_path / "file" / "a", "OUT")


def test_killed_at_any_moment_a_file_is_old_or_new(tmp_path: Path) -> None:
    path = tmp_path / "a"
    program = (
        "import sys; from pathlib import Path; from plenofir.ground.files import write_file\n"
        "for n in range(10**9): write_file(Path(sys.argv[1]), bytes([n % 256]) * 300000)"
    )
    for number in range(4):
        run = subprocess.Popen([sys.executable, "-c", program, str(path)])
        while not path.exists():
            time.sleep(0.01)
        time.sleep(0.05 + 0.017 * number)
        run.kill()
        run.wait()
        content = path.read_bytes()
        assert content == content[:1] * 300000


def test_a_run_takes_the_place_of_an_earlier_one(tmp_path: Path) -> None:
    """Files listed in its report are removed; paths elsewhere, folders and other files stay."""
    work, out = tmp_path / "work", tmp_path / "out"
    for folder in (work, out, out / "folder"):
        folder.mkdir()
    elsewhere = tmp_path / "elsewhere"
    for path in (elsewhere, out / "old", out / "own", out / "same", work / "new", work / "same"):
        path.write_text(path.parent.name)
    names = ["old", "same", "folder", "report", "gone", "", ".", "..", "../elsewhere", 5]
    for listed in (names[:-1], names, "old", None):
        (out / "old").write_text("")
        (out / "report").write_text(json.dumps({"files": listed}))
        (work / "report").write_text("{}")
        publish_run(work, out, "report")
        assert (out / "old").exists() == (listed != names[:-1])
        assert elsewhere.exists()
        assert (out / "own").read_text() == "out"
        assert (out / "same").read_text() == "work"
        told = json.loads((out / "report").read_text())
        assert told["files"] == ["new", "report", "same"]
        assert told["sha256"] == {name: checksum(out / name) for name in ("new", "same")}
