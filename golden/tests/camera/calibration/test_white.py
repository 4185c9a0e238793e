# SPDX-License-Identifier: Apache-2.0
"""A white image with a known grid: which lenses are in it, and how much each counts in a fit."""

import numpy as np
import pytest
from test_recorded import patched

from plenofir.camera.calibration.fit import pitch_error
from plenofir.camera.calibration.grid import Grid
from plenofir.camera.calibration.growing import GrowingFit
from plenofir.camera.calibration.lattice import primitive_vectors
from plenofir.camera.calibration.models import EVEN
from plenofir.camera.calibration.pixels import pixel_fit
from plenofir.camera.calibration.white import WhiteImage, enough
from plenofir_studies.synthetic import regular_grid, white_image

SHAPE, PITCH = (121, 301), 10.0


def test_lenses_up_to_the_last_pixel() -> None:
    """Of centres at 0, 10, ..., 300 the last is in 301 columns, of 0.5, 10.5, ... it is not."""
    for offset, columns in ((0.0, 31), (0.5, 30)):
        white = WhiteImage(
            np.zeros(SHAPE, dtype=np.float32), regular_grid(SHAPE, PITCH, offset=(0.0, offset))
        )
        assert len(white.lenses(max(SHAPE), 0.0)[0]) == 13 * columns


def test_dim_lenses_and_those_unlike_their_neighbours_count_less() -> None:
    grid = regular_grid(SHAPE, PITCH + 0.3)
    image = white_image(SHAPE, grid, noise=0) * np.geomspace(1, 0.05, SHAPE[1])
    image[58:63, 58:66] *= 0.3
    fitter = GrowingFit(image.astype(np.float32), grid)
    fitter.flatten()
    fitter.refine(max(SHAPE), 1, (EVEN,), last=True)
    centres = grid.positions(fitter.fitted)
    damaged = np.linalg.norm(centres - 60, axis=1).argmin()
    alike = fitter.as_drawn(centres)
    assert alike[damaged] < 0.01 < 0.95 < np.median(alike) < alike.max() <= 1
    bright, dim = (fitter.weights[part].max() for part in (centres[:, 1] < 60, centres[:, 1] > 270))
    assert dim < 0.25 < 0.85 < bright < 1


def squares(levels: np.ndarray) -> WhiteImage:
    """Lenses of ten pixels, each evenly lit to the borders of its cell."""
    image = np.kron(1000 * levels, np.ones((10, 10))).astype(np.float32)
    return WhiteImage(image, regular_grid(image.shape, 10.0, offset=(5.0, 5.0)))


def lit(white: WhiteImage, levels: np.ndarray) -> np.ndarray:
    """Which lenses count as lit, by row and column."""
    t, s, centres = white.lenses(max(white.shape), 0.0)
    result = np.zeros(levels.shape, dtype=bool)
    y, x = np.rint((centres - 4.5) / 10).astype(int).T
    result[y, x] = white.lit(t, s, centres)
    return result


def test_lenses_count_by_their_brightness() -> None:
    """From 2 % of the brightest; once the light is known, from a quarter to 1.8 of the usual."""
    levels = np.ones((14, 16))
    shares = (0.018, 0.022, 0.24, 0.26, 1.78, 1.82)
    for n, share in enumerate(shares):
        levels[4 + 5 * (n % 2), 2 + 5 * (n // 2)] = share
    white = squares(levels)
    places = [(4 + 5 * (n % 2), 2 + 5 * (n // 2)) for n in range(6)]
    assert [lit(white, levels)[place] for place in places] == [False, *[True] * 5]
    white.shading = np.zeros(1)
    assert [lit(white, levels)[p] for p in places] == [False, False, False, True, True, False]
    assert lit(white, levels).sum() == levels.size - 4


def test_lenses_at_the_border_of_the_image_circle_do_not_count() -> None:
    """Of eight neighbours three or more are unlit; beyond the image all count as lit."""
    levels = np.ones((12, 16))
    levels[:, :5] = 0.1
    levels[5, 9] = levels[6, 9] = 0.1
    white = squares(levels)
    white.shading = np.zeros(1)
    expected = levels > 0.25
    expected[1:-1, 5] = False
    assert np.array_equal(lit(white, levels), expected)
    # Where that would leave too few, they count all.
    rows = np.where(np.arange(12) % 2, 1.0, 0.1)[:, np.newaxis] * np.ones((12, 16))
    white = squares(rows)
    white.shading = np.zeros(1)
    assert np.array_equal(lit(white, rows), rows > 0.25)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows"])
@pytest.mark.parametrize(("pitch", "form"), [(9.3, "disc"), (18.2, "disc"), (18.2, "spot")])
def test_a_flattened_image_is_evenly_lit_and_can_be_redrawn(pitch, form, layout) -> None:
    shape, dark = (150, 170), 900.0
    grid = regular_grid(shape, pitch, rotation_degrees=1, layout=layout)
    radius = 0.42 if form == "disc" else 0.15
    light = white_image(shape, grid, noise=0.0, shading=0.6, form=form, radius=radius, level=0.6)
    white = WhiteImage((light + dark).astype(np.float32), grid)
    white.flatten()
    _, _, centres = white.whole_lenses(max(shape))
    # The dark level is told by lenses of different light.
    assert white.dark == pytest.approx(dark, abs=250)
    middle, half = (np.array(shape) - 1) / 2, (np.array(shape) - 1) / 2
    truth = 1 - 0.6 * (((centres - middle) / half) ** 2).sum(axis=1) / 2
    share = white.light(centres) / truth
    assert np.ptp(share) < 0.05 * share.mean()
    assert white.light(centres).max() == pytest.approx(1, abs=0.05)
    level = white.core(centres)
    assert np.abs(level / level.mean() - 1).max() < 0.03
    assert white.large == (pitch > 8 and form == "disc")
    if form == "spot":
        assert np.abs(white.redrawn - white.padded).mean() < 0.02 * level.mean()
    assert white.as_drawn(centres).min() > 0.2
    # Edges are repeated beyond the image.
    m = white.margin
    assert np.array_equal(white.padded[: m + 1, m:-m], white.padded[[m] * (m + 1), m:-m])
    assert np.array_equal(white.padded[m:-m, -m - 1 :], white.padded[m:-m, [-m - 1] * (m + 1)])


def test_evenly_lit_lenses_tell_of_no_dark_level() -> None:
    grid = regular_grid(SHAPE, PITCH + 0.3)
    image = white_image(SHAPE, grid, shading=0.0, level=0.5) + 5000
    assert WhiteImage(image.astype(np.float32), grid).base() == 0


def test_a_dark_level_takes_light_that_varies() -> None:
    """By 15 % of the median, from the lowest tenth of the lenses to the highest."""
    shape, dark = (100, 240), 200.0
    grid = regular_grid(shape, 10.0, offset=(5.0, 5.0))
    y, x = np.indices(shape)
    middle = (np.abs(y % 10 - 4.5) < 3) & (np.abs(x % 10 - 4.5) < 3)
    _, _, centres = WhiteImage(np.zeros(shape, np.float32), grid).whole_lenses(max(shape))
    # All lenses differ, by the same step.
    number = np.rint((centres - 4.5) / 10) @ (1, 10)
    low, usual, high = np.percentile(number, [10, 50, 90])
    for share, told in ((0.149, False), (0.151, True)):
        slope = share * (1000 + dark) / (high - low) / 1000
        gains = 1 + slope * (y // 10 + x // 10 * 10 - usual)
        white = WhiteImage((dark + 1000 * gains * middle).astype(np.float32), grid)
        assert white.base() == pytest.approx(dark if told else 0.0, abs=20)
    # Below a dark frame, by noise, there is no light either.
    below = WhiteImage((1000 * gains * middle - 0.5).astype(np.float32), grid)
    assert below.base() == 0


def test_clipped_micro_images_are_cut_off_and_tell_their_light_by_their_width() -> None:
    shape = (150, 170)
    grid = regular_grid(shape, 12.3)
    light = white_image(shape, grid, noise=0.0, shading=0.6, level=0.9) * 1.5
    white = WhiteImage(np.minimum(light, 40000).astype(np.float32), grid, 40000.0)
    white.flatten()
    _, _, centres = white.whole_lenses(max(shape))
    assert white.padded.max() == pytest.approx(0.85 * (40000 - white.dark), rel=1e-3)
    truth = 1 - 0.6 * (((centres * 2 / (np.array(shape) - 1)) - 1) ** 2).sum(axis=1) / 2
    share = white.light(centres) / truth
    assert np.ptp(share) < 0.2 * share.mean()


def test_windows_follow_the_smallest_cell() -> None:
    """Where distortion makes cells smaller, down to 0.8 of the pitch."""
    image = np.zeros(SHAPE, dtype=np.float32)
    even = regular_grid(SHAPE, PITCH)
    assert WhiteImage(image, even).windows() == pytest.approx((PITCH, PITCH))
    for bend, share in ((0.2, 0.9), (0.5, 0.8)):
        first, down, right = even.coefficients
        grid = Grid(
            layout="rectangular", order=2, middle=(0, 0), scale=1,
            coefficients=(first, down, right, (0, 0), (0, 0), (0, bend / 3)),
        )  # fmt: skip
        # At the narrow end a column is as wide as the slope there.
        end = max(0.8, np.sqrt(abs(np.linalg.det(grid.jacobian(grid.inverse(np.zeros(2))))) / 100))
        assert WhiteImage(image, grid).windows() == pytest.approx((end * PITCH,) * 2, rel=0.01)
        assert end == pytest.approx(share, abs=0.05)


def test_enough_lenses() -> None:
    assert enough(4000) == slice(None)
    some = enough(4001)
    assert len(np.unique(some)) == len(some) == 4000
    assert some.max() <= 4000


def test_centres_are_corrected_by_what_measuring_drawn_ones_shows() -> None:
    """Missing neighbours pull centroids; the drawn image has the same neighbours."""
    shape = (150, 170)
    grid = regular_grid(shape, 9.0, rotation_degrees=0.4)
    image = patched(white_image(shape, grid, noise=0.002, radius=0.5), 0.12)
    fitter = GrowingFit(image.astype(np.float32), grid)
    fitter.refine(max(shape), 2, (EVEN,))
    fitter.flatten()
    fitter.refine(max(shape), 2, (EVEN,), last=True)
    truth = grid.centres(*grid.nearest(fitter.measured)[:2])
    plain = fitter.measure(fitter.padded, truth)
    whole = fitter.as_drawn(truth) > 0.5
    before, after = (np.abs(c - truth)[whole].mean() for c in (plain, fitter.measured))
    assert not fitter.as_measured
    assert after < 0.9 * before
    assert np.linalg.norm(fitter.grid.centres(0, 0) - grid.nearest(fitter.grid.centres(0, 0))[2]
        - fitter.grid.centres(0, 0)) < 0.02  # fmt: skip
    # The light's slope and the change of the pitch leave errors that the scatter does not show.
    errors = np.linalg.norm(fitter.shared_moves(), axis=2)
    assert errors.shape == fitter.measured.shape
    assert 0 < errors.max() < 0.05
    # A grid follows what moves all lenses alike, or stretches it, and nothing else.
    middle = fitter.end / 2
    moves = np.stack([np.ones_like(truth), truth - middle, ((truth - middle) / 50) ** 2], axis=-1)
    shift, stretch, bend = np.moveaxis(fitter.followed(0.01 * moves), -1, 0)
    assert shift == pytest.approx(0.01 * np.eye(3)[:, :1] * np.ones(2), abs=1e-6)
    known = 0.01 * np.array(fitter.grid.coefficients)
    assert stretch[1:] == pytest.approx(known[1:], abs=1e-4)
    assert np.abs(bend[1:]).max() < 0.03 * np.abs(stretch[1:]).max()
    fitter.shading = None
    assert not fitter.shared_moves().size


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows"])
def test_the_pitch_is_as_sure_as_the_size_of_the_grid(layout) -> None:
    """A grid that may grow by a share has a pitch that may; one that may turn has not."""
    grid = regular_grid(SHAPE, PITCH, rotation_degrees=20, layout=layout)
    fitter = GrowingFit(np.zeros(SHAPE, np.float32), grid)
    for moves, expected in ((grid.vectors, 1.0), (grid.vectors @ [[0, 1], [-1, 0]], 0.0)):
        terms = 1e-3 * np.vstack([np.zeros(2), moves])
        none, sure = np.zeros((3, 2, 1)), np.zeros((2, 3, 2, 3))
        fitter.covariance = np.einsum("ia,jb->aibj", terms, terms)
        error = 1e-3 * PITCH * expected
        assert pitch_error(fitter, none) == pytest.approx(error, abs=1e-9)
        fitter.covariance = sure
        assert pitch_error(fitter, terms[..., np.newaxis]) == pytest.approx(error, abs=1e-9)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows"])
def test_grids_fitted_to_pixels_of_small_micro_images(layout) -> None:
    """With an integer pitch, all centres alike between pixels, 0.05 pixels off before."""
    shape, margin = (60, 64), 6
    grid = regular_grid(shape, 4.0, rotation_degrees=0.5, layout=layout, offset=(0.3, -0.2))
    image = white_image(shape, grid, radius=0.4, noise=0.01, shading=0.3)
    lattice = grid.lattice(*(n.ravel() for n in np.mgrid[-5:6, -5:6]))
    # A shift, and steps of rows and columns, each along y and x.
    terms = np.zeros((len(lattice), 2, 6))
    for axis in (0, 1):
        terms[:, axis, axis] = 1.0
        terms[:, axis, 2 + axis], terms[:, axis, 4 + axis] = lattice.T
    off = np.array([0.05, -0.04, 0.003, -0.002, 0.002, 0.001])
    found = pixel_fit(
        np.pad(image.astype(np.float32) / 1000, margin, mode="edge"), margin,
        primitive_vectors(grid), grid.positions(lattice) + margin - terms @ off, terms,
        np.zeros(6), np.where(np.arange(len(lattice)) % 9 == 0, 0.0, 1.0),
        square=layout == "rectangular",
    )  # fmt: skip
    claims = np.sqrt(np.diagonal(found.covariance))
    assert np.abs(found.factors - off)[:2].max() < 0.006
    assert np.abs(found.factors - off)[2:].max() < 0.0015
    assert (np.abs(found.factors - off) < 4.5 * claims).all()
    assert (claims < [0.005] * 2 + [0.001] * 4).all()
