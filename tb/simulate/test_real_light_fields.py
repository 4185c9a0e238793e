# SPDX-License-Identifier: Apache-2.0
"""Real captures of light-field microscopes: from the capture through the VHDL, bit for bit."""

import json
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.calibration import calibrate, decode, largest_odd_size
from plenofir.camera.recognise import recognise
from plenofir.commands.app import run
from plenofir.ground.images import read_image, write_png
from plenofir.ground.project import DATA
from plenofir.refocus import refocus


@dataclass(frozen=True)
class Capture:
    """A capture, and what is known of it."""

    name: str
    files: tuple[str, str, str]  # raw, white, dark of the whole one
    whole_lenses: tuple[int, int]
    pitch: float
    m: int


CAPTURES = [
    Capture(
        "antleg",
        ("light_field.png", "radiometry_frame.png", "dark_frame.tif"),
        (79, 95),
        27.57,
        25,
    ),
    Capture(
        "seaurchin",
        ("light_field.tif", "radiometry_frame.tif", "dark_frame.tif"),
        (120, 119),
        17.20,
        15,
    ),
]
captures = pytest.mark.parametrize("capture", CAPTURES, ids=lambda one: one.name)


def chain(capture: Capture, files: list[Path], out: Path, lenses: int) -> None:
    """Recognise, calibrate, decode; then some lenses through the VHDL, and the same in software."""
    raw, white, dark = files
    assert recognise(raw).kind == "raw capture"
    assert recognise(white).kind == "white image"
    found = calibrate(read_image(white), read_image(dark))
    assert np.mean(found.grid.pitch) == pytest.approx(capture.pitch, rel=0.002)
    m = largest_odd_size(found)
    assert m == capture.m
    aligned = decode(read_image(raw), found, m, dark=read_image(dark))
    side = lenses * m
    starts = [n // m // 2 * m - lenses // 2 * m for n in aligned.shape]
    part = aligned[starts[0] : starts[0] + side, starts[1] : starts[1] + side]
    out.mkdir()
    write_png(out / "aligned.png", part)
    a = (f"-8/{m}", "0")
    words = ["--raw", str(out / "aligned.png"), "-M", str(m), "-a", " ".join(a)]
    engine = ["--engine", "moving_sum", "--simulator", "ghdl"]
    assert run(["sim", *words, *engine, "--out", str(out / "sim")]) == 0
    report = json.loads((out / "sim" / "report.json").read_text())
    assert (report["mismatches"], report["pixels_compared"]) == (0, 2 * side**2)
    for one in a:
        got = read_image(out / "sim" / f"refocused_{one.replace('/', '_')}.png")
        assert np.array_equal(got, refocus(part, m, one))
        assert got.max() > got.min()


@pytest.mark.slow
@captures
def test_parts_that_are_shipped(tmp_path: Path, capture: Capture) -> None:
    files = [DATA / capture.name / f"{kind}.png" for kind in ("raw", "white", "dark")]
    chain(capture, files, tmp_path / "out", 8)


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The examples of napari-LF 0.1.7, from the package index that pip knows."""
    folder = tmp_path_factory.mktemp("napari")
    words = ["download", "--no-deps", "--quiet", "--dest", str(folder), "napari-LF==0.1.7"]
    done = subprocess.run(
        [sys.executable, "-m", "pip", *words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["pip failed"]
        pytest.skip(f"napari-LF 0.1.7 cannot be fetched: {lines[-1]}")
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(folder)
    return folder / "napari_lf" / "examples"


@pytest.mark.slow
@captures
def test_whole_captures(tmp_path: Path, examples: Path, capture: Capture) -> None:
    files = [examples / capture.name / name for name in capture.files]
    assert calibrate(*map(read_image, files[1:])).lenses == capture.whole_lenses
    chain(capture, files, tmp_path / "out", 8)
    # The shipped capture is a part of it.
    for path, kind in zip(files, ("raw", "white", "dark"), strict=True):
        part, whole = read_image(DATA / capture.name / f"{kind}.png"), read_image(path)
        top, left = {"antleg": (170, 225), "seaurchin": (620, 555)}[capture.name]
        cut = whole[top : top + part.shape[0], left : left + part.shape[1]]
        assert np.array_equal(part, cut)
