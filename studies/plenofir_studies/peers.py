# SPDX-License-Identifier: Apache-2.0
"""Other open software beside this one: refocused pictures, depth and centres, errors and time.

plenopticam (with its ``depthy``), plenpy and pyolaf run in an environment of their own, because
they need older libraries; `plenofir_studies.peers_side` calls them there. All get the same arrays.
"""

import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration import Grid, calibrate
from plenofir.camera.lightfield import views
from plenofir.ground.errors import InputError
from plenofir.refocus import best_picture, refocus
from plenofir.refocus.operator import Image
from plenofir_studies import peers_side
from plenofir_studies.depth_methods import BAD, by_disparity, score
from plenofir_studies.depth_trials import trial
from plenofir_studies.report_parts import Progress, Report, machine
from plenofir_studies.sharpening import TEXTURES, Plane, decibels, plane
from plenofir_studies.synthetic import regular_grid, white_image

Floats = npt.NDArray[np.float64]

# M and a' of textured planes in focus; drawn scenes and their noise; size of the timed frame.
PLANES = ((5, 5), (5, 3), (9, 3))
SCENES = (("planes", 0.01), ("bars", 0.02), ("twigs", 0.0), ("tiles", 0.02))
SIZE, M = 3201, 11
# Size of the white images, pitch and rotation of their lenses.
_WHITE, _PITCH, _TURN = (550, 550), 11.03, 0.1
_RUNS = 3


@dataclass(frozen=True)
class Answer:
    """What a peer made of its input."""

    result: Floats
    seconds: float  # of processor time
    version: str


Ask = Callable[..., Answer | str]
"""A task of `peers_side` and its arrays to the answer, or to the last line of its error."""


def asked(python: Path) -> Ask:
    """Peers behind an interpreter in whose environment they are installed."""

    def ask(task: str, runs: int = 1, **arrays: Any) -> Answer | str:
        with tempfile.TemporaryDirectory(prefix="plenofir-") as name:
            source, target = Path(name) / "in.npz", Path(name) / "out.npz"
            np.savez(source, runs=runs, **arrays)
            command = [str(python), peers_side.__file__, task, str(source), str(target)]
            try:
                process = subprocess.run(command, capture_output=True, text=True, check=False)
            except OSError as error:
                raise InputError(
                    f"{python}: cannot be run: {error.strerror}", where="--python"
                ) from None
            if process.returncode:
                return (process.stderr.strip().splitlines() or ["no message"])[-1]
            answer = np.load(target)
            return Answer(answer["result"], float(answer["seconds"]), str(answer["version"]))

    return ask


def _timed(work: Callable[[], Any], runs: int = 1) -> tuple[Any, float]:
    """A result, and the least processor time of some runs behind a first one, in seconds."""
    result, seconds = work(), []
    for _ in range(runs):
        start = time.process_time()
        result = work()
        seconds.append(time.process_time() - start)
    return result, min(seconds)


def _enlarged(lenses: Floats, m: int, order: int) -> Floats:
    """Values of lenses at each pixel: linear (order 1), or by cubic splines (3)."""
    places = [(np.arange(n * m) - (m - 1) / 2) / m for n in lenses.shape]
    grid = np.meshgrid(*places, indexing="ij")
    return np.asarray(ndimage.map_coordinates(lenses, grid, order=order, mode="nearest"))


def likeness(picture: Floats | Image, field: Plane) -> list[float]:
    """PSNR in dB at the lenses and at all pixels, of a picture at either resolution.

    One of the views' resolution is enlarged, linearly and by cubic splines. Borders that miss views
    are left out. The mean is that of the object: plenopticam's pictures are brighter than its
    views.
    """
    m, border = field.m, field.border
    values = np.asarray(picture, np.float64)
    if values.shape == field.pixels.shape:
        lenses, pixels = values[m // 2 :: m, m // 2 :: m], [values]
    else:
        lenses, pixels = values, [_enlarged(values, m, order) for order in (1, 3)]
    within = slice(border, -border), slice(border, -border)
    coarse = slice(border // m, -border // m), slice(border // m, -border // m)
    gain = field.pixels[within].mean() / pixels[0][within].mean()
    return [
        decibels(gain * lenses[coarse], field.lenses[coarse]),
        *(decibels(gain * each[within], field.pixels[within]) for each in pixels),
    ]


def pictures(ask: Ask) -> Iterator[tuple[str, ...]]:
    """Rows of a table: name; for each plane `likeness`."""
    fields = [plane(m, shift, TEXTURES[1]) for m, shift in PLANES]
    ours: dict[str, Callable[[Plane], Image]] = {
        "plenofir, the operator": lambda f: refocus(f.raw, f.m, f"{f.shift}/{f.m}"),
        "plenofir, as shown": lambda f: best_picture(f.raw, f.m, f.shift / f.m),
    }

    def cells(picture: Floats | Image, field: Plane) -> str:
        return " / ".join(f"{value:.1f}" for value in likeness(picture, field))

    for name, work in ours.items():
        yield name, *(cells(work(field), field) for field in fields)
    for name in ("plenopticam", "plenpy"):
        row = []
        for field in fields:
            exact = field.shift % field.m == 0
            answer = ask(
                f"{name} refocus", views=views(field.raw, field.m), shift=field.shift, exact=exact
            )
            row.append(answer if isinstance(answer, str) else cells(answer.result, field))
        yield name, *row


def times(ask: Ask, size: int = SIZE, m: int = M) -> Iterator[tuple[str, ...]]:
    """Rows of a table: name, processor time of one slice at a = 1 in seconds, pixels of it."""
    raw = np.random.default_rng(1).integers(0, 256, (size, size), np.uint8)
    ours: dict[str, Callable[[], Image]] = {
        "plenofir, the operator": lambda: refocus(raw, m, 1, threads=1),
        "plenofir, as shown": lambda: best_picture(raw, m, 1, threads=1),
    }
    for name, work in ours.items():
        picture, seconds = _timed(work, _RUNS)
        yield name, f"{seconds:.3f}", f"{picture.shape[1]} x {picture.shape[0]}"
    for name in ("plenopticam", "plenpy"):
        answer = ask(f"{name} refocus", views=views(raw, m), shift=m, exact=True, runs=_RUNS)
        if isinstance(answer, str):
            yield name, answer, ""
        else:
            rows, columns = answer.result.shape
            yield name, f"{answer.seconds:.3f}", f"{columns} x {rows}"


def depths(ask: Ask) -> Iterator[tuple[str, ...]]:
    """Rows of a table: name; for each scene the share of bad pixels, error and time."""
    truths = [trial(name, noise) for name, noise in SCENES]
    names = ("plenofir", "plenopticam", "plenpy")
    for name in names:
        row = []
        for truth in truths:
            if name == "plenofir":
                depth, seconds = _timed(lambda truth=truth: by_disparity(truth), 1)  # type: ignore[misc]
            else:
                answer = ask(f"{name} depth", views=views(truth.raw, truth.m))
                if isinstance(answer, str):
                    row.append(answer)
                    continue
                depth, seconds = answer.result, answer.seconds
            errors = score(depth, truth, seconds)
            row.append(f"{100 * errors.bad[-1]:.1f} %, {errors.mse:.2f}, {seconds:.2f} s")
        yield name, *row


def _spots(grid: Grid) -> npt.NDArray[np.uint8]:
    """A white image of Gaussian spots with dark gaps."""
    places = np.moveaxis(np.indices(_WHITE), 0, -1).astype(float)
    away = np.linalg.norm(grid.nearest(places)[2], axis=-1)
    return np.asarray(240 * np.exp(-((away / (0.2 * _PITCH)) ** 2) / 2)).astype(np.uint8)


def centres(ask: Ask) -> Iterator[tuple[str, ...]]:
    """Rows of a table: name; mean and largest error of centres in pixels, time, for two images."""
    grid = regular_grid(_WHITE, _PITCH, rotation_degrees=_TURN)
    whites: list[Image] = [_spots(grid), white_image(_WHITE, grid, seed=1)]

    def cell(places: Floats, seconds: float) -> str:
        inner = ((places > _PITCH) & (places < np.array(_WHITE) - _PITCH)).all(axis=1)
        if not inner.any():
            return "no centre in the picture"
        error = np.linalg.norm(grid.nearest(places[inner])[2], axis=-1)
        return f"{error.mean():.4f}, {error.max():.4f}, {seconds:.1f} s"

    row = []
    for white in whites:
        calibration, seconds = _timed(lambda white=white: calibrate(white), 1)  # type: ignore[misc]
        row.append(cell(calibration.model_centres.reshape(-1, 2), seconds))
    yield "plenofir", *row
    # pyolaf is told the pitch, as its users do.
    for name, hints in (("plenopticam", {}), ("pyolaf", {"pitch": round(_PITCH)})):
        row = []
        for white in whites:
            answer = ask(f"{name} centres", white=white, **hints)
            row.append(answer if isinstance(answer, str) else cell(answer.result, answer.seconds))
        yield name, *row


def write_report(folder: Path, python: Path, progress: Progress | None = None) -> Path:
    """Write ``peers.md``; `python` is the interpreter of the peers' environment.

    InputError if that cannot be run.
    """
    ask = asked(python)
    report = Report(folder, "peers.md", 4, progress)
    # An interpreter that cannot be run is refused before anything is measured.
    ask("plenpy depth", views=np.zeros((1, 1, 1, 1), np.uint8))
    report.say("# Beside other software", f"Measured on: {machine()}")
    report.say(
        "Textured planes in focus: PSNR in dB at the lenses / at all pixels. Pictures of the views'"
        " resolution are enlarged, linearly / by cubic splines. The texture itself is made of such"
        " splines, so these find it again for an integer a. All pictures get the object's mean."
    )
    heads = [f"M = {m}, a' = {shift}" for m, shift in PLANES]
    report.table(["software", *heads], pictures(ask))
    report.step()
    report.say(f"One slice at a = 1 of {SIZE} x {SIZE} pixels, M = {M}, grey, on one thread.")
    report.table(["software", "processor time, s", "pixels of the picture"], times(ask))
    report.step()
    report.say(
        f"Depth: share of pixels off by more than {BAD[-1]}, mean square error x 100, processor"
        " time of the second run of plenofir, of the first of the others."
    )
    heads = [f"{name}, {100 * noise:g} % noise" for name, noise in SCENES]
    report.table(["software", *heads], depths(ask))
    report.step()
    report.say(
        f"Centres in white images of {_WHITE[1]} x {_WHITE[0]} pixels, pitch {_PITCH}, rotated by "
        f"{_TURN} degree: mean and largest error in pixels, processor"
        " time of the second run of plenofir, of the first of the others."
    )
    report.table(["software", "Gaussian spots, dark gaps", "discs, 1 % noise"], centres(ask))
    report.step()
    return report.write()
