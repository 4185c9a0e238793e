# SPDX-License-Identifier: Apache-2.0
"""Fit of a grid to the centroids of all micro images."""

from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.centroids import (
    Image32,
    core_brightness,
    reach,
)
from plenofir.camera.calibration.checks import (
    cell_margin,
    check_alike,
    check_classes,
    check_outliers,
    check_touching,
)
from plenofir.camera.calibration.evidence import Evidence
from plenofir.camera.calibration.frames import equalised
from plenofir.camera.calibration.grid import (
    Flags,
    Floats,
    Grid,
    Layout,
    polynomial_terms,
)
from plenofir.camera.calibration.growing import GrowingFit
from plenofir.camera.calibration.lattice import (
    guess,
    lattices,
    layout_misfits,
    no_grid,
    primitive_vectors,
)
from plenofir.camera.calibration.light import fitted_light
from plenofir.camera.calibration.models import BENT, EVEN, MODELS
from plenofir.camera.calibration.shading import (
    extents,
    lens_indices,
    shading_at,
    within,
)
from plenofir.camera.calibration.white import DARK, DIMMEST, enough
from plenofir.ground.errors import InputError

# In pitches: over so few lenses a guess that is off by less than a tenth of a pitch counts rightly.
_FIRST_RADIUS = 5.0
_GROWTH = 1.6
# Below this share of the brightness around it, a micro image counts as missing.
_MISSING = 0.05
# Largest scatter of centroids, in pitches; beyond it there is no grid.
_LARGEST_SCATTER = 0.12
_FEWEST_USED = 0.5
# Light and centres are fitted in turn until no centre moves by more than the first number of
# pixels; if one still moves by more than the second after `_MOST_ROUNDS`, there is no grid.
_SETTLED, _RESTLESS = 0.01, 0.1
_MOST_ROUNDS = 10
_FEWEST_LENSES = 14
_LARGEST_MISSING = 0.45
# Largest standard error of a centre in pixels.
_LARGEST_CENTRE_ERROR = 0.15
# All centres are measured again in this share of the window. Light, neighbours and saturation bias
# both measurements, but not equally, so the grid may be wrong by this many times what it moves. The
# second is of large micro images, whose borders a narrower window misses.
_NARROWER, _REPEATED, _REPEATED_LARGE = 0.85, 1.5, 0.75
# The variance of centres grows by this times the share of outliers.
_HARMED = 8.0
# Standard errors of the standard error that are added to it.
_SURE = 1.0
_SMALLEST_CELL_MARGIN = 0.4
# Each costs a whole fit, and the error of the first is told if all fail.
_CANDIDATES = 4
# Lattices that score less than this share of the best one are not tried.
_LIKELY = 0.5
# Lens vectors may differ from those of a square or hexagonal array by this share of a pitch.
_LARGEST_MISFIT = 0.04


@dataclass(frozen=True)
class Fit:
    """A grid and how well it fits.

    Attributes
    ----------
    grid
        The grid, lens (0, 0) at the top left.
    shape
        Rows and columns of lenses whose centres lie in the image somewhere.
    present
        Whether the lens is in the image and lit, shape `shape`.
    brightness
        Brightness of each lens's middle over that of the brightest part, nan where it is outside;
        shape `shape`.
    shading
        Coefficients of the logarithm of the smooth part of the brightness, see `shading_at`.
    residual_px
        Robust standard deviation of single centroids from the grid (each of y and x).
    used
        Number of micro images whose centroids were used.
    evidence
        What speaks for this grid.
    """

    grid: Grid
    shape: tuple[int, int]
    present: Flags
    brightness: Floats
    shading: Floats
    residual_px: float
    used: int
    evidence: Evidence


def fit_grid(
    image: Image32,
    *,
    layout: Layout | None = None,
    order: int | None = None,
    clipped: float | None = None,
) -> Fit:
    """Find the grid of a white image and fit it to all its micro images.

    The first guess is the lattice of shifts that map the image to itself. From the middle the grid
    grows: it predicts the lenses around the known ones, their centroids are measured, and it is
    fitted to all of them again, without outliers. A grid that does not fit its lenses is refused.

    Raises `InputError` if there is no grid, or too little speaks for it.

    Parameters
    ----------
    image
        White image, dark frame subtracted, shape (rows, columns).
    layout
        Arrangement of the micro lenses, None to find out.
    order
        Order of the grid's polynomial, None for what its lenses bear out.
    clipped
        Level at which many pixels clip, None if there are few.
    """
    if layout is not None and layout not in get_args(Layout):
        raise InputError(
            f"there is no layout {layout!r}; choose from {', '.join(get_args(Layout))}"
        )
    image = equalised(image)
    candidates = lattices(image, layout)
    first: InputError | None = None
    strongest = max((lattice.score for lattice in candidates), default=0.0)
    likely = [lattice for lattice in candidates if lattice.score > _LIKELY * strongest]
    for lattice in likely[:_CANDIDATES]:
        others = [other.score for other in candidates if other is not lattice]
        try:
            fitter = GrowingFit(image, guess(image, lattice.vectors, layout), clipped)
            return _fit(fitter, lattice.score, max(others, default=0.0), layout, order)
        except InputError as error:
            first = first or error
        except np.linalg.LinAlgError:
            first = first or no_grid("no regular grid")
    raise first or no_grid("no grid of micro images")


def _grow(fitter: GrowingFit, largest: float, order: int | None) -> None:
    """Fit from the middle outwards, then light and centres in turn until both are settled."""
    radius = _FIRST_RADIUS * max(extents(fitter.grid))
    fitter.refine(min(radius, largest), 3, (EVEN,))
    while radius < largest:
        radius *= _GROWTH
        fitter.refine(min(radius, largest), 1, (BENT,))
    for n in range(_MOST_ROUNDS):
        t, s, before = fitter.whole_lenses(largest)
        fitter.flatten()
        fitter.refine(largest, 2, MODELS, order, last=n > 0)
        moved = float(np.abs(fitter.grid.centres(t, s) - before).max())
        if n and moved < _SETTLED:
            break
    if moved > _RESTLESS:
        of_order = "" if order is None else f"no regular grid of order {order}: "
        raise no_grid(
            f"{of_order}centres uncertain by {moved:.2f} pixels (between rounds of the fit)"
        )
    fitter.fit_pixels()


def _regular_lenses(fitter: GrowingFit, pitch: float) -> int:
    """Number of lenses that fit the grid; refused if they scatter or are too few."""
    used = int((fitter.weights > 0).sum())
    if fitter.scatter > _LARGEST_SCATTER * pitch:
        raise no_grid(
            f"no regular grid (micro images of {pitch:.1f} pixels off by {fitter.scatter:.2f})"
        )
    if used < _FEWEST_USED * len(fitter.weights):
        raise no_grid(f"{used} of {len(fitter.weights)} micro images on a regular grid")
    if used < _FEWEST_LENSES:
        raise no_grid(f"{used} regular micro images only")
    return used


def _fit(
    fitter: GrowingFit, score: float, next_score: float, layout: Layout | None, order: int | None
) -> Fit:
    """Fit one lattice; refuse it if too little speaks for it."""
    largest = max(fitter.shape) / 2
    pitch = max(extents(fitter.grid))
    _grow(fitter, largest, order)
    used = _regular_lenses(fitter, pitch)
    check_touching(fitter)
    if order is None:
        check_outliers(fitter)
    t, s, centres = fitter.whole_lenses(largest)
    few = enough(len(t))
    t, s, centres = t[few], s[few], centres[few]
    level = fitter.core(centres)
    bright = level > DIMMEST * float(np.percentile(level, 80))
    check_classes(fitter.grid, t, s, level)
    # Checked without flattening too: the smooth brightness fitted to a grid that is too fine is
    # wrong.
    smooth = fitter.smooth()
    raw = ndimage.map_coordinates(smooth, centres.T, order=1, mode="nearest")
    check_classes(fitter.grid, t, s, raw - float(np.percentile(smooth[::3, ::3], 1)))
    margin = cell_margin(fitter, centres[bright])
    if margin < _SMALLEST_CELL_MARGIN:
        raise no_grid("more than one micro image in each cell of the grid")
    check_alike(fitter, t[bright], s[bright], centres[bright])
    misfits = sorted(layout_misfits(primitive_vectors(fitter.grid)))
    if layout is None and misfits[0] > _LARGEST_MISFIT:
        raise no_grid("lenses neither square nor hexagonal")
    times = _REPEATED_LARGE if fitter.large else _REPEATED
    again = times * fitter.repeated(_NARROWER)
    together = np.concatenate([fitter.followed(fitter.shared_moves()), again], axis=-1)
    evidence = Evidence(
        missing_share=0.0,
        scatter_share=fitter.scatter / pitch,
        centre_error_px=0.0,
        periodicity=score,
        next_periodicity=next_score,
        layout_margin=misfits[1] - misfits[0],
        cell_margin=margin,
        order_gains_px=fitter.bent.gains,
        untried_orders=fitter.bent.untried,
        pitch_error_px=pitch_error(fitter, together),
    )
    fit = _finish(fitter, used, evidence)
    inside = ~np.isnan(fit.brightness)
    t, s = np.nonzero(inside)
    points = (fit.grid.lattice(t, s) - fit.grid.middle) / fit.grid.scale
    terms = polynomial_terms(points, fitter.bent.covariance_order)
    shifts = np.einsum("nc,cak->nak", polynomial_terms(points, fitter.grid.order), together)
    shared = (shifts**2).sum(axis=(1, 2))
    # With few lenses the standard error itself is uncertain.
    freedom = max(1.0, 2 * float((fitter.weights > 0).sum()) - len(fitter.bent.factors))
    sure = 1 + _SURE / np.sqrt(2 * freedom)
    # So it is with outliers: other lenses may be off by too little to be outliers.
    sure *= np.sqrt(1 + _HARMED * float((fitter.weights == 0).mean()))
    every, alone = (
        sure**2 * (shared + np.einsum("ni,aiaj,nj->n", terms, covariance, terms))
        for covariance in (fitter.covariance, fitter.own)
    )
    error, certain = (float(np.sqrt(squares.max())) for squares in (every, alone))
    if certain > _LARGEST_CENTRE_ERROR:
        raise no_grid(f"centres uncertain by {certain:.2f} pixels (standard error)")
    if order is None and error > _LARGEST_CENTRE_ERROR:
        raise no_grid(
            f"{used} micro images cannot tell the distortion: centres uncertain by "
            f"{error:.2f} pixels (standard error)"
        )
    lit = ndimage.binary_closing(np.pad(fit.present, 2), np.ones((3, 3)))[2:-2, 2:-2] & inside
    missing = 1 - float(fit.present[lit].mean()) if lit.any() else 1.0
    if missing > _LARGEST_MISSING:
        raise no_grid(f"{100 * missing:.0f} % of the micro images missing")
    complete = evidence.model_copy(
        update={
            "missing_share": missing,
            "centre_error_px": error,
            "mean_error_px": float(np.sqrt(every.mean())),
        }
    )
    return replace(fit, evidence=complete)


def pitch_error(fitter: GrowingFit, together: Floats) -> float:
    """Standard error of `Grid.lens_pitch`.

    The covariance of the grid's linear terms, and what errors of all lenses `together` change of
    them.
    """
    vectors = fitter.grid.vectors
    (down_y, down_x), (right_y, right_x) = vectors
    # Derivatives of a cell's area with respect to the vectors' components along y and x.
    slopes = np.array([[right_x, -down_x], [-right_y, down_y]])
    linear = fitter.covariance[:, 1:3, :, 1:3] / fitter.grid.scale**2
    variance = float(np.einsum("ai,aibj,bj->", slopes, linear, slopes))
    shifts = np.einsum("ai,iak->k", slopes, together[1:3] / fitter.grid.scale)
    variance += float((shifts**2).sum())
    area = abs(float(np.linalg.det(vectors)))
    return float(fitter.grid.lens_pitch * np.sqrt(max(variance, 0.0)) / (2 * area))


def _shading(fitter: GrowingFit) -> Floats:
    """Smooth part of the image's brightness, from the middles of the micro images."""
    _, _, centres = fitter.whole_lenses(max(fitter.shape))
    centres = centres[enough(len(centres))]
    level = core_brightness(fitter.raw, centres + fitter.margin, extents(fitter.grid))
    lit = level > DARK * np.percentile(level, 95)
    return fitted_light(centres[lit], level[lit], np.zeros(int(lit.sum())), fitter.shape)[0]


def _finish(fitter: GrowingFit, used: int, evidence: Evidence) -> Fit:
    """Number the lenses from the top left and find which are present."""
    shape = fitter.shape
    t, s = lens_indices(fitter.grid, shape)
    centres = fitter.grid.centres(t, s)
    inside = within(centres, shape)
    rows, columns = np.nonzero(inside.any(axis=1))[0], np.nonzero(inside.any(axis=0))[0]
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    grid = fitter.grid.moved(int(t[rows[0], 0]), int(s[0, columns[0]]))
    inside, centres = inside[part], centres[part]
    pitch = extents(grid)
    if reach(max(pitch)) > fitter.margin:
        raise no_grid("micro images of another pitch than the image repeats with")
    level = core_brightness(fitter.raw, centres[inside] + fitter.margin, pitch)
    base = max(fitter.base(), float(np.percentile(fitter.image[::3, ::3], 0.5)))
    shading = _shading(fitter)
    smooth = shading_at(shading, centres[inside], shape)
    lit = level - base > np.maximum(
        _MISSING * (smooth - base), DARK * (np.percentile(level, 95) - base)
    )
    present = np.zeros(inside.shape, dtype=bool)
    present[inside] = lit
    brightness = np.full(inside.shape, np.nan)
    brightness[inside] = level
    return Fit(
        grid=grid,
        shape=(inside.shape[0], inside.shape[1]),
        present=present,
        brightness=brightness,
        shading=shading,
        residual_px=fitter.scatter,
        used=used,
        evidence=evidence,
    )
