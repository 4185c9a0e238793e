# SPDX-License-Identifier: Apache-2.0
"""Error of the calibration over pitch, damage and noise, from white images drawn at random."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from plenofir.camera.calibration import calibrate
from plenofir.ground.errors import InputError
from plenofir_studies.drawn_micro_images import DrawnWhite, drawn_white
from plenofir_studies.report_parts import Report

DRAWS = 200
_LARGEST_PIXELS = 200_000
# Drawn quantity, its factor and its classes.
_AXES = (
    ("pitch / pixels", 1, (3, 5, 10, 20, 50, 150)),
    ("missing, dim or merged / %", 100, (0, 10, 20, 30)),
    ("noise / %", 100, (0, 5, 10, 15)),
)


@dataclass(frozen=True)
class Tried:
    """Result for a drawn white image."""

    values: tuple[float, float, float]  # pitch in pixels, share damaged, noise
    must_be_found: bool
    accepted: bool
    mean: float = np.nan  # error of the centres in pixels
    largest: float = np.nan
    missed: int = 0  # lenses without a centre within half a pitch

    @property
    def wrong(self) -> bool:
        """Whether a grid was accepted that is not the true one."""
        return self.accepted and (self.largest > 0.5 or self.missed > 0)


def tried(drawn: DrawnWhite) -> Tried:
    values = drawn.pitch, drawn.damaged, drawn.noise
    try:
        calibration = calibrate(drawn.image)
    except InputError:
        return Tried(values, drawn.must_be_found, accepted=False)
    errors = drawn.errors(calibration.centres)
    return Tried(
        values,
        drawn.must_be_found,
        accepted=True,
        mean=float(errors.mean()),
        largest=float(errors.max()),
        missed=drawn.missed(calibration.model_centres[calibration.inside]),
    )


def drawn(report: Report) -> None:
    """Calibrate white images of the seeds 0, 1, ...: a section of the report."""
    results = []
    for seed in range(DRAWS):
        results.append(tried(drawn_white(seed, _LARGEST_PIXELS)))
        report.step()
    rows = []
    for axis, (name, factor, limits) in enumerate(_AXES):
        for low, high in pairwise(limits):
            part = [r for r in results if low <= factor * r.values[axis] < high]
            good = [r for r in part if r.accepted]
            must = [r for r in part if r.must_be_found]
            rows.append(
                (
                    f"{name.replace(' /', f' {low} to {high}')}",
                    len(part),
                    f"{sum(r.accepted for r in must)} of {len(must)}",
                    len(good),
                    f"{np.median([r.mean for r in good]):.4f}" if good else "",
                    f"{max(r.largest for r in good):.3f}" if good else "",
                    sum(r.wrong for r in part),
                )
            )
    report.say(
        "## White images drawn at random",
        f"{len(results)} white images of up to {_LARGEST_PIXELS} pixels: 3 x 3 lenses or more, "
        "all layouts, rotations of -45 to 45 degrees, image circles, vignetting up to 95 %, "
        "8 to 16 bits. To be found are those with at least 5 x 5 lenses, at most 20 % of them "
        "missing, dim or merged. Wrong: a centre more than 0.5 pixels off, or a lens without a "
        "centre. Errors in pixels.",
    )
    heads = ["drawn", "images", "accepted of those to be found", "accepted", "median of mean error"]
    report.table([*heads, "largest error", "wrong"], rows)
    report.picture("drawn", _picture(results), "Error over pitch, damage and noise")


def _picture(results: Sequence[Tried]) -> Figure:
    figure, parts = plt.subplots(
        1, len(_AXES), figsize=(11, 3.5), sharey=True, constrained_layout=True
    )
    good = [r for r in results if r.accepted]
    for axis, (axes, (name, factor, _)) in enumerate(zip(parts, _AXES, strict=True)):
        places = [factor * r.values[axis] for r in good]
        axes.plot(places, [r.largest for r in good], ".", color="0.7", label="largest")
        axes.plot(places, [r.mean for r in good], ".", label="mean")
        axes.set(yscale="log", xlabel=name)
        axes.grid(alpha=0.3)
    parts[0].set(xscale="log", ylabel="error of the centres / pixels")
    parts[0].legend(fontsize=8)
    return figure
