# SPDX-License-Identifier: Apache-2.0
"""Full or failing disks, and killed runs: results are the old or the new ones, never partial."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from any_call import Words, contents, is_warning, run

# A call of every command that writes files, and what a result of an earlier run is called.
WRITERS: dict[Words, tuple[str, ...]] = {
    ("views", "grey.png", "-M", "5", "--out", "out"): ("view_04_04.png",),
    ("mosaic", "grey.png", "-M", "5", "--out", "out/old.png"): ("old.png",),
    ("quilt", "grey.png", "-M", "5", "--out", "out/old"): ("old_qs5x1a0.75.png",),
    ("compose", "views", "--out", "out/old.png"): ("old.png",),
    ("refocus", "grey.png", "-M", "5", "-a", "1", "--out", "out/old.png"): ("old.png",),
    ("stack", "grey.png", "-M", "5", "-a", "0,1", "--out", "out"): ("refocused_2_a1.png",),
    ("depth-map", "grey.png", "-M", "5", "--camera", "f193-mla2", "--ply", "--out", "out"): (
        "depth.png",
        "disparity.npy",
        "points.ply",
    ),
    ("calibrate", "white.png", "--out", "out/old.json", "--picture", "out/old.png"): ("old.json",),
    ("decode", "white.png", "--calib", "known.json", "-M", "9", "--out", "out/old.png"): (
        "old.png",
    ),
    ("decode", "capture.lfp", "--out", "out/old.png"): ("old.png",),
    ("distance", "--camera", "f193-mla2", "-a", "1", "--plot", "out/old.png"): ("old.png",),
    ("configure", "rgb-480p", "--out", "out"): ("atlys_top.vhd", "plan.json"),
}


@pytest.fixture
def folder(stock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Working folder with a file of each kind."""
    shutil.copytree(stock, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@contextmanager
def limited(size: int) -> Iterator[None]:
    """Files of this process cannot grow beyond a size."""
    old, cached = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    # Python's compiled files would be truncated too, and break the next run.
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
        sys.dont_write_bytecode = cached


@contextmanager
def without_rights() -> Iterator[None]:
    """Root ignores permissions, so it becomes nobody."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


def old_results(out: Path, names: tuple[str, ...]) -> None:
    out.mkdir(exist_ok=True)
    for name in names:
        (out / name).write_text("old")


@pytest.mark.parametrize("words", WRITERS, ids=lambda words: words[0])
def test_files_that_cannot_grow_or_be_used(folder: Path, words: Words) -> None:
    old_results(folder / "out", WRITERS[words])
    before = contents(folder)
    with limited(40):
        code, _, err = run(words, {})
    assert code == 2
    assert "cannot be written (File too large); raise the limit for files" in err
    assert err.count("\n") == 1
    assert contents(folder) == before
    code, _, err = run(words, {})
    assert code == 0
    assert not err or is_warning(err)
    after = contents(folder)
    assert all(after[f"out/{name}"] != b"old" for name in WRITERS[words])
    # All modules are loaded before, as root's cannot be read without its rights.
    for path, mode in ((folder / "out", 0o555), (folder, 0o600)):
        folder.chmod(0o755)
        path.chmod(mode)
        with without_rights():
            code, _, err = run(words, {})
        path.chmod(0o755)
        assert code == 2
        assert "Permission denied" in err
        assert err.count("\n") == 1
        assert contents(folder) == after


@pytest.fixture
def full_disk(folder: Path) -> Iterator[Path]:
    """Folder `out` on a disk of 64 KiB that has old results and no room."""
    out = folder / "out"
    out.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(out)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("only root can make a small disk")
    try:
        yield out
    finally:
        subprocess.run(["umount", str(out)], check=True)


@pytest.mark.parametrize("words", WRITERS, ids=lambda words: words[0])
def test_a_full_disk(full_disk: Path, words: Words) -> None:
    old_results(full_disk, WRITERS[words])
    with pytest.raises(OSError, match="No space"):
        (full_disk / "filler").write_bytes(bytes(100_000))
    before = contents(full_disk)
    code, _, err = run(words, {})
    assert code == 2
    assert "No space left on device" in err
    assert "make room on the disk" in err
    assert err.count("\n") == 1
    assert contents(full_disk) == before


@pytest.mark.slow
@pytest.mark.parametrize("words", WRITERS, ids=lambda words: words[0])
def test_killed_at_any_moment(folder: Path, words: Words) -> None:
    program = [str(Path(sys.executable).with_name("plenofir")), *words]
    (folder / "out").mkdir()
    began = time.monotonic()
    subprocess.run(program, check=True, stdout=subprocess.DEVNULL)
    whole = time.monotonic() - began
    new = contents(folder / "out")
    seed = random.randrange(1 << 32)
    print(f"seed {seed}")
    rng = random.Random(seed)
    for _ in range(8):
        for name in new:
            (folder / "out" / name).write_text("old")
        done = subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # Most of them late, where results are written.
        time.sleep(whole * rng.uniform(0.6, 1.05))
        done.send_signal(signal.SIGKILL)
        done.wait()
        for name, content in contents(folder / "out").items():
            if not name.startswith(".plenofir-"):
                assert content in (b"old", new[name])
    # The next run is right, whatever was left.
    subprocess.run(program, check=True, stdout=subprocess.DEVNULL)
    after = contents(folder / "out")
    assert {name: after[name] for name in new} == new
