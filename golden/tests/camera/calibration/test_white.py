# SPDX-License-Identifier: Apache-2.0
"""A white image with a known grid: which lenses are in it, and how much each counts in a fit."""

import numpy as np

from plenofir.camera.calibration.growing import GrowingFit
from plenofir.camera.calibration.models import EVEN
from plenofir.camera.calibration.white import WhiteImage
from plenofir.camera.synthetic import regular_grid, white_image

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
