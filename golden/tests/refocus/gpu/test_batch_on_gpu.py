# SPDX-License-Identifier: Apache-2.0
"""Frames of ``batch --gpu``: made on a GPU where there is one, and by the processor otherwise."""

from fractions import Fraction

import array_api_strict
import numpy as np
import pytest

from plenofir.commands import app
from plenofir.ground import compiling
from plenofir.ground.errors import InputError
from plenofir.ground.images import encode_png, read_picture
from plenofir.refocus.batch import Made, Settings, refocus_frame
from plenofir.refocus.gpu import frames, program

SETTINGS = Settings(5, (Fraction(1, 5), Fraction(-3, 5)), sharpen="auto", gpu=True)


@pytest.fixture
def frame(tmp_path):
    """File of a frame of noise."""
    file = tmp_path / "frame.png"
    file.write_bytes(encode_png(np.random.default_rng(7).integers(0, 256, (45, 37), np.uint8)))
    return file


def pictures(made: Made) -> list[np.ndarray]:
    return [read_picture(path).pixels for path, _ in made.results]


def test_a_gpu_makes_the_pictures_of_the_cpu(frame, gpu_on_cpu, monkeypatch):
    monkeypatch.setattr(frames, "_LIBRARIES", {"strict": array_api_strict.asarray})
    by_gpu = refocus_frame(frame, SETTINGS, frame.parent)
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 2
    assert by_gpu.notes == ()
    by_cpu = refocus_frame(frame, Settings(5, SETTINGS.a, sharpen="auto"), frame.parent)
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 2
    assert [content for _, content in by_gpu.results] == [content for _, content in by_cpu.results]


@pytest.mark.parametrize("fails", ["to get there", "to refocus"])
def test_without_a_gpu_the_processor_makes_them_and_one_line_says_so(
    fails, frame, gpu_on_cpu, monkeypatch
):
    def no_memory(*_: object) -> None:
        raise RuntimeError("out of memory\nmore")

    libraries = {"strict": no_memory if fails == "to get there" else array_api_strict.asarray}
    monkeypatch.setattr(frames, "_LIBRARIES", libraries)
    if fails == "to refocus":
        # Neither the GPU's code nor the library's operations find memory.
        monkeypatch.setattr(program, "run_tiles", no_memory)
        monkeypatch.setattr(array_api_strict, "cumulative_sum", no_memory)
    first, second = (refocus_frame(frame, SETTINGS, frame.parent) for _ in range(2))
    (line,) = first.notes
    assert "out of memory" in line
    assert "\n" not in line
    assert second.notes == ()
    want = refocus_frame(frame, Settings(5, SETTINGS.a, sharpen="auto"), frame.parent)
    for made in (first, second):
        assert made.failure == ""
        for one, other in zip(pictures(made), pictures(want), strict=True):
            assert np.array_equal(one, other)
    # Workers tell the run, which tells the user.
    assert not gpu_on_cpu.told
    assert compiling.tell == gpu_on_cpu.told.append


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["-M", "5"], "--gpu: makes the operator's pictures; give --interpolation"),
        (["-M", "5", "--out", "volume.tif"], "--gpu: is for a folder of results"),
        (["--calib", "none.json"], "--gpu: is for frames, not for captures"),
    ],
)
def test_where_no_gpu_works_the_option_is_refused(words, reason, frame):
    with pytest.raises(InputError, match=reason):
        app.run(["batch", str(frame), "--gpu", *words])


def test_here_is_a_gpu_or_a_line():
    told: list[str] = []
    raw = np.zeros((9, 9), np.uint8)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiling, "tell", told.append)
        patch.setattr(compiling, "_announced", set())
        there = [frames.to_gpu(raw) for _ in range(2)]
    assert len(told) == (there[0] is raw)
    assert np.array_equal(frames.to_host(there[1]), raw)
