# SPDX-License-Identifier: Apache-2.0
"""The bias of small micro images' centroids by the pixel raster.

Sharp micro images of a few pixels have details finer than a pixel. This biases (pulls) a centroid
by a little that depends on where the centre lies between pixels. Along each axis

    pull = b1 sin(2 pi centre) + b2 sin(4 pi centre)

with the same strengths b1, b2 for all micro images and both axes; by symmetry there are no cosines.
Pulls average out where centres take all positions between pixels. With an integer pitch and a small
rotation, the position drifts slowly over the image, and pulls look like another pitch and rotation.
So the strengths are fitted together with the grid (`plenofir.camera.calibration.bending`).
"""

import numpy as np

from plenofir.camera.calibration.grid import Floats

USUAL = np.array([0.2, 0.02])
"""Standard deviations of the strengths times the pitch, in square pixels: known beforehand."""


def waves(centres: Floats) -> tuple[Floats, Floats]:
    """Pulls of strength 1 and their derivatives, shape (..., strengths)."""
    turn = 2 * np.pi
    sine, cosine = np.sin(turn * centres), np.cos(turn * centres)
    pulls = np.stack([sine, 2 * sine * cosine], axis=-1)
    return pulls, np.stack([turn * cosine, 2 * turn * (1 - 2 * sine**2)], axis=-1)
