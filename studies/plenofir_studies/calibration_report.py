# SPDX-License-Identifier: Apache-2.0
"""The report on calibration, refocusing and depth: Markdown with figures."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.grid import Grid, Layout
from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import read_image
from plenofir.ground.project import DATA
from plenofir.refocus import best_picture, refocus
from plenofir.refocus.operator import Image
from plenofir_studies.drawn_calibration import DRAWS, drawn
from plenofir_studies.experiments import model_of, take
from plenofir_studies.experiments_report import STEPS, experiments
from plenofir_studies.fourier import fourier_slice, shifted_views
from plenofir_studies.report_parts import Progress, Report
from plenofir_studies.synthetic.pattern import centres_within, regular_grid, white_image
from plenofir_studies.thesis_calibration import rotated, thesis_calibration

Floats = npt.NDArray[np.float64]
_Truth = tuple[str, Image, Floats, float]
"""Name, white image, true centres, pitch."""

MICROSCOPE = DATA / "microscope"
"""Folder of the microscope capture: raw.png, white.png, dark.png."""
MICROSCOPE_M = 13
_SEED = 1


@dataclass(frozen=True)
class Accuracy:
    """Errors of centres found, and how long that took."""

    # distance from found to true centres in pixels, over all found ones
    mean: float
    largest: float
    missed: int  # true centres in the image without one found within half a pitch
    seconds: float  # wall time


def accuracy(centres: Floats, truth: Floats, pitch: float, seconds: float) -> Accuracy:
    """Compare centres found with true ones."""
    distance = cKDTree(centres).query(truth)[0] if len(centres) else np.full(len(truth), np.inf)
    near = distance < pitch / 2
    return Accuracy(
        float(distance[near].mean()) if near.any() else float("nan"),
        float(distance[near].max()) if near.any() else float("nan"),
        int((~near).sum()),
        seconds,
    )


def both_methods(image: Image, truth: Floats, pitch: float) -> tuple[Accuracy, Accuracy]:
    """Calibrate with the grid fit (all missed where it refuses) and with the thesis's method."""
    start = time.perf_counter()
    try:
        centres = calibrate(image).centres.reshape(-1, 2)
    except InputError:
        centres = np.full((1, 2), np.nan)
    middle = time.perf_counter()
    text = thesis_calibration(grey(image))
    end = time.perf_counter()
    present = centres[~np.isnan(centres[:, 0])]
    return (
        accuracy(present, truth, pitch, middle - start),
        accuracy(text.centroids, truth, pitch, end - middle),
    )


def tilted(shape: tuple[int, int], pitch: float) -> Grid:
    """Grid of a micro lens array that is tilted against the sensor: the pitch changes by 4 %."""
    flat = regular_grid(shape, pitch, rotation_degrees=2.0)
    centre, down, right = flat.coefficients
    bend = 0.02 * pitch**2 / shape[0]
    return Grid(
        layout="rectangular",
        order=2,
        middle=(0.0, 0.0),
        scale=1.0,
        coefficients=(centre, down, right, (0.0, bend), (bend, 0.0), (0.0, bend)),
    )


def _white_images() -> Iterator[_Truth]:
    def regular(
        name: str,
        size: int,
        pitch: float,
        rotation: float = 0.1,
        layout: Layout = "rectangular",
        **options: float | str,
    ) -> _Truth:
        shape = size, size
        grid = regular_grid(shape, pitch, rotation_degrees=rotation, layout=layout)
        image = white_image(shape, grid, **options)  # type: ignore[arg-type]
        return name, image, centres_within(grid, shape), pitch

    yield regular("pitch 11.03, 0.1 degree, 1100 x 1100", 1100, 11.03)
    yield regular("the same, hexagonal", 1100, 11.03, layout="hexagonal-rows")
    yield regular("the same, 10 % noise, 8 bit", 1100, 11.03, noise=0.1, level=0.5, bits=8)
    yield regular("the same, square micro images", 1100, 11.03, form="square", radius=0.46)
    yield regular("spots, pitch 15.4, 1 degree", 720, 15.4, 1.0, form="spot", radius=0.2)
    yield regular("spots, pitch 7.7, hexagonal", 720, 7.7, 1.0, "hexagonal-rows", form="spot")
    shape = 720, 720
    grid = tilted(shape, 7.69)
    yield "tilted array, pitch 7.69", white_image(shape, grid), centres_within(grid, shape), 7.69
    yield regular("pitch 11, 3201 x 3201", 3201, 11.0, 0.0)
    for pitch in (5.0, 3.0):
        yield regular(f"pitch {pitch}, 0.1 degree, 360 x 360", 360, pitch)
        yield regular(f"pitch {pitch}, 0.3 degree, 360 x 360", 360, pitch, 0.3)


def _spot_images(folder: Path) -> Iterator[_Truth]:
    """Images NAME.png with true centres NAME.txt, one (y, x) a line."""
    files = sorted(folder.glob("*.txt"))
    if not files:
        raise InputError("has no NAME.txt; each NAME.png needs one", where=str(folder))
    rng = np.random.default_rng(_SEED)
    for file in files:
        image = read_image(file.with_suffix(".png"))
        try:
            truth = np.atleast_2d(np.loadtxt(input_file(file)))
        except ValueError:
            truth = np.empty((0, 0))
        if truth.shape[1:] != (2,) or len(truth) < 2:
            raise InputError("has no centres; write y and x on each line", where=str(file))
        inside = ((truth >= 0) & (truth <= np.array(image.shape[:2]) - 1)).all(axis=1)
        full = np.iinfo(image.dtype).max
        noisy = np.clip(np.rint(image + rng.normal(0, 0.01 * full, image.shape)), 0, full)
        pitch = float(np.median(cKDTree(truth).query(truth, 2)[0][:, 1]))
        yield f"{file.stem}.png, 1 % noise", noisy.astype(image.dtype), truth[inside], pitch


def _accuracy(report: Report, images: Iterable[_Truth]) -> None:
    report.say(
        "## Micro image centres",
        "Distance from true to found centres in pixels, centres in the image that were missed, "
        "and seconds on this machine; 1 % noise unless said otherwise. *Grid*: `plenofir "
        "calibrate`. *Thesis*: threshold, labels and a centroid for each region (Eqs. 4.1-4.3).",
    )
    rows = []
    for name, image, truth, pitch in images:
        row = [name, str(len(truth))]
        for result in both_methods(image, truth, pitch):
            row += [f"{result.mean:.4f}", f"{result.largest:.4f}", str(result.missed)]
            row.append(f"{result.seconds:.2f}")
        rows.append(row)
        report.step()
    heads = ["mean", "largest", "missed", "s"]
    ways = [f"{way}: {head}" for way in ("grid", "thesis") for head in heads]
    report.table(["image", "lenses", *ways], rows)


def _rotation(report: Report) -> None:
    report.say(
        "## Rotation",
        "Error in degrees of the rotation from the central row (Eqs. 4.4-4.6) and from all lenses, "
        "and the largest error of a centre after rotating all back by it (Eqs. 4.7-4.10): white "
        "images of 600 x 600 pixels, pitch 13.889, 1 % noise.",
    )
    rows = []
    for degrees in (-3.0, -0.5, 0.05, 0.3, 1.0, 2.0):
        shape = 600, 600
        grid = regular_grid(shape, 13.889, rotation_degrees=degrees)
        image = white_image(shape, grid)
        truth = centres_within(grid, shape)
        straight = rotated(truth, -degrees, shape)
        row = [f"{degrees:g}"]
        for angle in (
            thesis_calibration(grey(image)).rotation_degrees,
            calibrate(image).grid.rotation_degrees,
        ):
            off = np.linalg.norm(rotated(truth, -angle, shape) - straight, axis=1).max()
            row += [f"{abs(angle - degrees):.5f}", f"{off:.3f}"]
        rows.append(row)
    report.step()
    heads = ["rotation", "central row", "largest error / px", "all lenses", "largest error / px"]
    report.table(heads, rows)


def _ways_to_refocus(report: Report) -> None:
    report.say(
        "## Refocusing: error against run time",
        "Refocusing to a = 3/11, M = 11, one sample a micro lens. The error is the root mean "
        "square distance in grey levels of 65535 from views shifted in the frequency domain "
        "(Eq. 3.50, exact for band-limited views), away from the borders. Shift and integration "
        "gives 11 x 11 samples a micro lens (nearest neighbour); its means are compared.",
    )
    model = model_of(11)
    raster = take(model, [float(model.distance(k / 11).mm) for k in (3, 6)]).raster
    want = shifted_views(raster, 11, 3 / 11)
    inside = (slice(4, -4), slice(4, -4))

    def means() -> Floats:
        image = refocus(raster, 11, Fraction(3, 11))
        rows, columns = (n // 11 for n in image.shape[:2])
        blocks = image.reshape(rows, 11, columns, 11).mean(axis=(1, 3))
        return np.asarray(blocks, dtype=np.float64)

    ways: dict[str, Callable[[], Floats]] = {
        "shift and integration": means,
        "shifted views": lambda: shifted_views(raster, 11, 3 / 11),
    }
    for width in (2.0, 3.5, 5.0):
        ways[f"Fourier slice, window {width:g}"] = partial(
            fourier_slice, raster, 11, 3 / 11, width=width
        )
    rows = []
    for name, way in ways.items():
        seconds = []
        for _ in range(3):
            start = time.perf_counter()
            picture = way()
            seconds.append(time.perf_counter() - start)
        error = float(np.sqrt(np.mean((picture - want)[inside] ** 2)))
        rows.append((name, f"{error:.3g}", f"{1000 * min(seconds):.1f}"))
    report.step()
    report.table(["way", "error", "ms"], rows)


def microscope_raster() -> Image:
    """Aligned raster of the microscope capture that the package ships, M = 13."""
    raw, white, dark = (read_image(MICROSCOPE / f"{n}.png") for n in ("raw", "white", "dark"))
    return decode(raw, calibrate(white, dark), MICROSCOPE_M, dark=dark)


def microscope_picture(shifts: tuple[int, ...] = (-8, -4, 0, 4, 8)) -> Image:
    """The microscope capture, refocused, side by side."""
    raster = microscope_raster()
    slices = [best_picture(raster, MICROSCOPE_M, k / MICROSCOPE_M) for k in shifts]
    gap = np.full((raster.shape[0], 6), np.iinfo(raster.dtype).max, dtype=raster.dtype)
    parts = [part for image in slices for part in (gap, image)][1:]
    line = np.concatenate(parts, axis=1).astype(np.float64)
    top = float(np.percentile(np.concatenate(slices), 99.7))
    return np.clip(line / top * 255, 0, 255).astype(np.uint8)


def write_report(folder: Path, spots: Path | None, progress: Progress) -> Path:
    """Write ``report.md`` and its figures, all or none."""
    spot_images = [] if spots is None else list(_spot_images(spots))
    report = Report(folder, "report.md", 12 + len(spot_images) + DRAWS + STEPS + 3, progress)
    if spots is not None and folder.resolve() == spots.resolve():
        # A spot image may have the name of one of the figures.
        raise InputError(
            "is the folder of the spots; name another one for the report", where=str(folder)
        )
    report.say("# Calibration, focus and depth")
    _accuracy(report, chain(_white_images(), spot_images))
    drawn(report)
    _rotation(report)
    experiments(report)
    _ways_to_refocus(report)
    report.say(
        "## A real capture",
        "A vesicle under a light-field microscope, calibrated with its white and dark frames, "
        f"decoded with M = {MICROSCOPE_M}, refocused to a = -8/13, -4/13, 0, 4/13, 8/13.",
    )
    report.picture("microscope", microscope_picture(), "Microscope capture, refocused")
    report.step()
    return report.write()
