# SPDX-License-Identifier: Apache-2.0
"""What pixels do to the centroids of small micro images.

Sharp micro images of a few pixels have details finer than a pixel. So a centroid is pulled a
little, depending on where the centre lies between pixels. Along each axis

    pull = b1 sin(2 pi centre) + b2 sin(4 pi centre)

with the same strengths b1, b2 for all micro images and both axes; by symmetry there are no cosines.
Pulls cancel out where centres lie everywhere between pixels. At an integer pitch and a small
rotation they drift by little, and pulls look like another pitch and another rotation. So the
strengths are fitted together with the grid (`plenofir.camera.calibration.bending`).
"""

import numpy as np

from plenofir.camera.calibration.grid import Floats

USUAL = np.array([0.2, 0.02])
"""Standard deviations of the strengths times the pitch, in square pixels: known beforehand."""


def waves(centres: Floats) -> tuple[Floats, Floats]:
    """Pulls of strength 1 and their slopes, shape (..., strengths)."""
    turn = 2 * np.pi
    sine, cosine = np.sin(turn * centres), np.cos(turn * centres)
    pulls = np.stack([sine, 2 * sine * cosine], axis=-1)
    return pulls, np.stack([turn * cosine, 2 * turn * (1 - 2 * sine**2)], axis=-1)
