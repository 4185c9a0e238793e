# SPDX-License-Identifier: Apache-2.0
"""Runs and workers that are killed at random moments: the next run ends with every result right."""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest
from test_batch import check_results

from plenofir.ground.images import write_png
from plenofir.refocus.batch import find_frames
from plenofir.refocus.batch_record import RECORD

OPTIONS = ("--interpolation", "nearest")
COMMAND = ("batch", "in/*.png", "-M", "5", "-a", "1 1/5", *OPTIONS, "--out", "out", "--workers")

FRAMES = 24
REFUSED = "another run is writing here; let it end first"


@pytest.fixture
def frames(tmp_path: Path) -> Path:
    rng = np.random.default_rng(0)
    (tmp_path / "in").mkdir()
    for number in range(FRAMES):
        raw = rng.integers(0, 256, (400, 500, 3), dtype=np.uint8)
        write_png(tmp_path / "in" / f"{number}.png", raw)
    return tmp_path


@pytest.fixture
def draw() -> random.Random:
    seed = random.SystemRandom().randrange(1 << 31)
    print(f"seed {seed}")
    return random.Random(seed)


def start(folder: Path, workers: int = 2) -> subprocess.Popen[str]:
    # Its own process group, as in a shell, so that Ctrl-C reaches all of it.
    return subprocess.Popen(
        [
            sys.executable,
            "-c",
            # Lines of steps are told after some seconds, which a loaded machine needs.
            "from plenofir.commands import app, console; console.QUIET_SECONDS = 1e6; app.main()",
            *COMMAND,
            f"{workers}",
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def lines(folder: Path) -> int:
    record = folder / "out" / RECORD
    return record.read_bytes().count(b"\n") if record.exists() else 0


def wait_for_lines(folder: Path, count: int, run: subprocess.Popen[str]) -> None:
    while run.poll() is None and lines(folder) < count:
        time.sleep(0.002)


def kill_a_worker(run: subprocess.Popen[str], draw: random.Random) -> None:
    """Kill one as soon as there is one, if the run is not over before."""
    while run.poll() is None:
        with suppress(psutil.NoSuchProcess):
            below = psutil.Process(run.pid).children(recursive=True)
            workers = [process for process in below if "spawn_main" in str(process.cmdline())]
            if workers:
                draw.choice(workers).kill()
                return
        time.sleep(0.01)


def kill_run(folder: Path, draw: random.Random, workers: int = 2) -> None:
    """Kill a run somewhere in what is left, now and then while something is being written."""
    run = start(folder, workers)
    wait_for_lines(folder, lines(folder) + draw.randrange(FRAMES), run)
    time.sleep(draw.uniform(0, 0.2))
    run.kill()
    run.communicate()


def finish(folder: Path, draw: random.Random, kills: int, workers: int = 2) -> str:
    """Let a run go to its end while its workers are killed; what it prints."""
    run = start(folder, workers)
    first = lines(folder)
    for done in sorted(draw.randrange(1, FRAMES) for _ in range(kills)):
        wait_for_lines(folder, first + done, run)
        kill_a_worker(run, draw)
    text, errors = run.communicate(timeout=300)
    assert (run.returncode, errors) == (0, "")
    check_results(find_frames([str(folder / "in" / "*.png")]), folder / "out")
    return text


def test_interrupted_killed_robbed_of_a_worker(frames: Path, draw: random.Random) -> None:
    # Each process takes a second to start: with one worker these are seven.
    run = start(frames, 1)
    wait_for_lines(frames, 2, run)
    os.killpg(run.pid, signal.SIGINT)
    text, errors = run.communicate(timeout=60)
    assert run.returncode == 130
    assert (text, errors) == ("", "plenofir: stopped; the same command goes on from here\n")
    assert not list((frames / "out").glob(".*"))
    for path in list((frames / "out").glob("*.png"))[:4]:
        path.unlink()
    kill_run(frames, draw, 1)
    assert ", 0 failed" in finish(frames, draw, 1, 1)


@pytest.mark.slow
def test_killed_runs(frames: Path, draw: random.Random) -> None:
    for _ in range(30):
        kill_run(frames, draw)
        if lines(frames) > FRAMES - 3:
            # From the beginning, among results of the run before, one of them emptied.
            draw.choice(sorted((frames / "out").glob("*.png"))).write_bytes(b"")
            (frames / "out" / RECORD).unlink()
    assert ", 0 failed" in finish(frames, draw, 0)


@pytest.mark.slow
def test_killed_workers(frames: Path, draw: random.Random) -> None:
    text = finish(frames, draw, 6)
    assert f"{FRAMES} frames refocused, 0 there already, 0 failed" in text


@pytest.mark.slow
def test_many_runs_at_once(frames: Path) -> None:
    """One of them works, the others are refused in one line."""
    runs = [start(frames) for _ in range(3)]
    ends = [(*run.communicate(timeout=120), run.returncode) for run in runs]
    codes = [code for *_, code in ends]
    assert 0 in codes
    for _, errors, code in ends:
        assert errors == ("" if code == 0 else f"plenofir: --out: {REFUSED}\n")
    check_results(find_frames([str(frames / "in" / "*.png")]), frames / "out")
