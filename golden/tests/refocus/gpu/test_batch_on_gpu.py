# SPDX-License-Identifier: Apache-2.0
"""Frames of ``batch --gpu``: made on a GPU where there is one, and by the processor otherwise."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import streams_on_cpu

from plenofir.commands import app
from plenofir.ground.errors import InputError
from plenofir.ground.images import encode_png, read_picture
from plenofir.refocus import batch
from plenofir.refocus.batch_frames import Made, Settings, refocus_frames
from plenofir.refocus.gpu import program

SETTINGS = Settings(5, (Fraction(1, 5), Fraction(-3, 5)), sharpen="auto", gpu=True)
BY_CPU = replace(SETTINGS, gpu=False)


@pytest.fixture
def files(tmp_path):
    """Files of frames of noise, of two sizes, the second one damaged."""
    rng = np.random.default_rng(7)
    paths = [tmp_path / f"frame_{number}.png" for number in range(6)]
    for path, width in zip(paths, (37, 37, 38, 37, 38, 38), strict=True):
        path.write_bytes(encode_png(rng.integers(0, 256, (45, width), np.uint8)))
    paths[1].write_bytes(b"no picture")
    return paths


def pictures(made: Sequence[Made]) -> list[list[np.ndarray]]:
    return [[read_picture(path).pixels for path, _ in each.results] for each in made]


def check_pictures(made: Sequence[Made], files: Sequence[Path]) -> None:
    """They are those of the processor."""
    want = refocus_frames(files, BY_CPU, files[0].parent)
    assert [each.failure for each in made] == [each.failure for each in want]
    assert made[1].failure
    for ones, others in zip(pictures(made), pictures(want), strict=True):
        for one, other in zip(ones, others, strict=True):
            assert np.array_equal(one, other)


def test_a_gpu_makes_the_pictures_of_the_cpu_while_others_are_on_their_way(
    files, gpu_on_cpu, monkeypatch
):
    monkeypatch.setattr(program, "MOST_SLICES", 1)
    made = refocus_frames(files, SETTINGS, files[0].parent)
    check_pictures(made, files)
    assert not any(each.notes for each in made)
    # A job is a setting of a frame. Two more are queued before the first one is waited for.
    jobs = ["upload", "kernel", "download"]
    assert [name for name, _ in gpu_on_cpu.queued[:12]] == [*jobs * 3, "wait", *jobs][:12]
    lanes = [lane for name, lane in gpu_on_cpu.queued if name == "wait"]
    assert lanes == [1, 2, 3] * 3 + [1]
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 10


def test_a_lane_waits_for_a_frame_that_did_not_fit(files, gpu_on_cpu, monkeypatch):
    run_tiles, calls = program.run_tiles, count()
    monkeypatch.setattr(
        program, "run_tiles", lambda *given: next(calls) % 2 == 0 and run_tiles(*given)
    )
    made = refocus_frames(files, SETTINGS, files[0].parent)
    check_pictures(made, files)
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 3
    assert not any(each.notes for each in made)


@pytest.mark.parametrize("fails", ["to be there", "to take a frame", "on the way"])
def test_without_a_gpu_the_processor_makes_them_and_one_line_says_so(
    fails, files, gpu_on_cpu, monkeypatch
):
    def fault(*_: object) -> None:
        raise RuntimeError("out of memory\nmore")

    if fails == "to be there":
        monkeypatch.setattr(sys.modules["cuda.core"], "Device", fault)
    elif fails == "to take a frame":
        monkeypatch.setattr(program, "run_tiles", fault)
    else:
        monkeypatch.setattr(
            streams_on_cpu.Buffer, "copy_to", lambda *_, stream: stream.queue("", fault)
        )
    made = refocus_frames(files, SETTINGS, files[0].parent)
    check_pictures(made, files)
    (line,) = {line for each in made for line in each.notes}
    assert "out of memory" in line
    assert "\n" not in line


def test_frames_of_a_worker_that_died_are_made_alone(files, monkeypatch):
    class Running(list):
        add = list.append

        def __iter__(self):
            while self:
                yield self.pop(0)

    tried = []

    def submit(work, paths, settings, folder, pure):
        def result():
            if files[2] in paths:
                raise RuntimeError("died")
            return work(paths, settings, folder)

        tried.append(len(paths))
        return SimpleNamespace(key=len(tried), result=result)

    monkeypatch.setattr("distributed.as_completed", Running)
    client = SimpleNamespace(submit=submit)
    made = dict(batch._made(files, BY_CPU, files[0].parent, client, 4))
    assert tried == [4, 2, 1, 1, 1, 1]
    assert [bool(made[number].failure) for number in range(6)] == [n in (1, 2) for n in range(6)]
    assert made[2].failure == f"{files[2]}: RuntimeError died"


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["-M", "5"], "--gpu: makes the operator's pictures; give --interpolation"),
        (["-M", "5", "--out", "volume.tif"], "--gpu: is for a folder of results"),
        (["--calib", "none.json"], "--gpu: is for frames, not for captures"),
    ],
)
def test_where_no_gpu_works_the_option_is_refused(words, reason, files):
    with pytest.raises(InputError, match=reason):
        app.run(["batch", str(files[0]), "--gpu", *words])


def test_here_is_a_gpu_or_a_line(files):
    made = refocus_frames(files, SETTINGS, files[0].parent)
    check_pictures(made, files)
    assert len({line for each in made for line in each.notes}) <= 1
