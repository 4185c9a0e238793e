# SPDX-License-Identifier: Apache-2.0
"""What speaks against a grid: accepted just inside the limits, refused just outside."""

from contextlib import nullcontext

import numpy as np
import pytest
from test_lattice import LAYOUTS

from plenofir.camera.calibration.checks import (
    cell_margin,
    check_alike,
    check_classes,
    check_outliers,
    check_touching,
    primitive_indices,
    unlikeness,
)
from plenofir.camera.calibration.growing import GrowingFit
from plenofir.camera.calibration.lattice import primitive_vectors
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import regular_grid, white_image

SHAPE = (90, 96)
T, S = (n.ravel() for n in np.mgrid[-4:5, -4:5])


def verdict(is_refused: bool, message: str):
    return pytest.raises(InputError, match=message) if is_refused else nullcontext()


@pytest.mark.parametrize(
    ("how", "is_refused"),
    [
        ({}, True),
        ({"count": 5}, True),
        ({"count": 4}, False),  # A twenty-fifth of the lenses, at least four.
        ({"off": 0.1}, True),  # More than a hundredth of the pitch.
        ({"off": 0.085}, False),
        ({"ratio": 1.9}, True),  # Of one size, to a factor of two.
        ({"ratio": 2.1}, False),
        ({"turn": 25.0}, True),  # Of one direction: cosines above 0.9.
        ({"turn": 27.0}, False),
        ({"level": 0.91}, True),  # As bright as usual, to a tenth.
        ({"level": 0.89}, False),
        ({"level": 1.09}, True),
        ({"level": 1.11}, False),
        ({"weight": 0.1}, False),  # No outliers.
        ({"apart": 2}, False),  # No neighbours.
    ],
)
def test_neighbours_that_are_off_together(how, is_refused) -> None:
    case = {
        "off": 0.5, "count": 8, "ratio": 1.0, "turn": 0.0, "level": 1.0, "weight": 0.0, "apart": 1,
        **how,
    }  # fmt: skip
    grid = regular_grid(SHAPE, 9.0)
    fitter = GrowingFit(np.full(SHAPE, 100, np.float32), grid)
    n = np.arange(case["count"]) * case["apart"] + 9
    odd = (np.arange(len(n)) % 2)[:, np.newaxis]
    turn = np.radians(case["turn"]) * odd[:, 0]
    moves = case["off"] * np.where(odd, case["ratio"], 1.0)
    fitter.fitted, fitter.measured = grid.lattice(T, S), grid.centres(T, S)
    fitter.measured[n] += moves * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    fitter.weights = np.ones(len(T))
    fitter.weights[n] = case["weight"]
    level = np.ones(len(T))
    level[n] = case["level"]
    fitter.core = lambda centres: level
    message = rf"{case['count']} neighbouring micro images are off the grid by 0\.\d+ pixels"
    with verdict(is_refused, message):
        check_outliers(fitter)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(("gap", "is_refused"), [(1.0, True), (0.9, True), (0.7, False)])
def test_micro_images_that_touch(layout, gap, is_refused) -> None:
    """In the upper third of the image gaps are as bright as micro images, or nearly."""
    grid = regular_grid(SHAPE, 9.0, layout=layout)
    image = white_image(SHAPE, grid, noise=0).astype(np.float32)
    fitter = GrowingFit(image, grid)
    fitter.measured = grid.centres(T, S)
    check_touching(fitter)
    inner = fitter.padded[: fitter.margin + SHAPE[0] // 3]
    inner += np.float32(gap) * (fitter.padded.max() - inner)
    with verdict(is_refused, r"no gaps between \d\d % of the micro images"):
        check_touching(fitter)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_rows_that_are_dark(layout) -> None:
    """Every second or third row, column or diagonal, mostly below 0.4 of the usual."""
    grid = regular_grid(SHAPE, 9.0, layout=layout)
    m, n = primitive_indices(grid, T, S)
    # Steps of one index lead along a vector to a neighbour.
    places = np.stack([m, n], axis=1) @ primitive_vectors(grid)
    assert np.ptp(grid.centres(T, S) - places, axis=0) == pytest.approx(0, abs=1e-9)
    for rows in (m % 2, n % 2, m % 3, n % 3, (m + n) % 3, (m - n) % 3, (m + n) % 2):
        for share in (0.38, 0.42):
            level = np.where(rows == 1, share, 1.0)
            with verdict(share < 0.4, "half the distance or darker ones in every second row"):
                check_classes(grid, T, S, level)
    # A quarter of a row's lenses may be brighter, and four lenses or more are a row.
    level = np.where(m % 2 == 1, 0.2, 1.0)
    brighter = level.copy()
    brighter[np.nonzero(m % 2 == 1)[0][::2]] = 1.0
    check_classes(grid, T, S, brighter)
    few = np.nonzero(m % 2 == 1)[0][:3]
    some = np.sort(np.concatenate([few, np.nonzero(m % 2 == 0)[0][:8]]))
    level[some] = np.where(m[some] % 2 == 1, 0.2, 1.0)
    check_classes(grid, T[few], S[few], level[few])


def spots(
    layout: str, second: float, moved: tuple[float, float], pitch: float = 10.0
) -> GrowingFit:
    """A fit to spots, with a second one in each cell, moved by shares of the pitch."""
    grid = regular_grid(SHAPE, pitch, layout=layout)
    image = white_image(SHAPE, grid, form="spot", radius=0.1, noise=0.0).astype(np.float32)
    y, x = np.rint(np.array(moved) * pitch).astype(int)
    return GrowingFit(image + np.float32(second) * np.roll(image, (y, x), (0, 1)), grid)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows"])
def test_cells_with_a_second_spot(layout) -> None:
    """The margin is 1 minus its brightness, from half a pitch away from all lenses on."""
    t, s = T[np.abs(T) < 4], S[np.abs(T) < 4]
    for second, moved, expected in (
        (0.0, (0.0, 0.0), 1.0), (0.5, (0.5, 0.5), 0.5), (0.3, (0.5, 0.0), 0.7),
        (0.5, (0.0, 0.4), 1.0),
    ):  # fmt: skip
        if layout != "rectangular" and moved[0]:
            continue
        fitter = spots(layout, second, moved)
        assert cell_margin(fitter, fitter.grid.centres(t, s)) == pytest.approx(expected, abs=0.12)


def overlaps(unlike: float, pitch: float = 9.0) -> GrowingFit:
    """Discs of which every second row has another shape."""
    grid = regular_grid(SHAPE, pitch)
    y, x = np.moveaxis(grid.nearest(np.moveaxis(np.indices(SHAPE), 0, -1).astype(float))[2], -1, 0)
    t = grid.nearest(np.moveaxis(np.indices(SHAPE), 0, -1).astype(float))[0]
    stretch = np.where(t % 2, 1 + unlike, 1 - unlike)
    light = np.exp(-((y / stretch) ** 2 + (x * stretch) ** 2) / (0.1 * pitch**2))
    return GrowingFit((500 * light).astype(np.float32), grid)


def test_micro_images_of_every_second_row_are_alike() -> None:
    for unlike, is_refused in ((0.0, False), (0.15, False), (0.4, True)):
        fitter = overlaps(unlike)
        centres = fitter.grid.centres(T, S)
        size = unlikeness(fitter, T, S, centres)
        assert (size > 0.06) == is_refused
        assert size < 0.02 or unlike
        with verdict(is_refused, "micro images overlap: those of every second row differ"):
            check_alike(fitter, T, S, centres)
    # The same from rows alone, none from one kind of rows, or from too few lenses or pixels.
    assert unlikeness(fitter, T, S, centres) > 0.06
    even = T % 2 == 0
    assert unlikeness(fitter, T[even], S[even], centres[even]) < 0.02
    assert unlikeness(fitter, T[:9], S[:9], centres[:9]) == 0
    small = overlaps(0.4, 3.9)
    assert unlikeness(small, T, S, small.grid.centres(T, S)) == 0


def test_a_colour_filter_does_not_make_micro_images_unlike() -> None:
    """With an odd pitch, its kinds of pixels change from row to row."""
    fitter = overlaps(0.0)
    y, x = np.indices(fitter.padded.shape)
    for gains in ((1.0, 0.6, 0.6, 0.2), (1.0, 0.5, 0.9, 0.3)):
        mosaic = fitter.padded * np.array(gains)[2 * (y % 2) + x % 2]
        coloured = GrowingFit(fitter.image, fitter.grid)
        coloured.padded = mosaic.astype(np.float32)
        assert unlikeness(coloured, T, S, fitter.grid.centres(T, S)) < 0.035


def test_noise_does_not_make_micro_images_unlike() -> None:
    fitter = overlaps(0.0)
    fitter.padded = fitter.padded + np.random.default_rng(0).normal(
        0, 100, fitter.padded.shape
    ).astype(np.float32)
    assert unlikeness(fitter, T, S, fitter.grid.centres(T, S)) < 0.06
