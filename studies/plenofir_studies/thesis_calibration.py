# SPDX-License-Identifier: Apache-2.0
"""The thesis's own way to micro image centres and rotation, for comparison (section 4.2.1).

Normalisation (Eq. 4.1), threshold (Eq. 4.2), a centroid for each labelled region (Eq. 4.3), and the
rotation from a straight line through the central row (Eqs. 4.4-4.6); the image is then rotated
about its middle (Eqs. 4.7-4.9).
"""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Flags, Floats


@dataclass(frozen=True)
class ThesisCalibration:
    """Result of the thesis's method.

    Attributes
    ----------
    centroids
        (y, x) of each region, shape (regions, 2).
    row
        Indices into `centroids` of the central row, left to right.
    rotation_degrees
        Angle of that row against the image's rows; nan if there is no row.
    pitch
        Mean distance of centroids along that row in pixels; nan if there is no row.
    """

    centroids: Floats
    row: list[int]
    rotation_degrees: float
    pitch: float


def normalised(image: Image32, levels: int = 256) -> Image32:
    """Stretch grey levels to 1 ... L (Eq. 4.1)."""
    low, high = float(image.min()), float(image.max())
    if high == low:
        return np.ones_like(image)
    return (image - low) * np.float32((levels - 1) / (high - low)) + 1


def binary(image: Image32) -> Flags:
    """Threshold an image by Otsu's method (Eq. 4.2)."""
    return np.asarray(image >= _otsu(image))


def _otsu(image: Image32, bins: int = 256) -> float:
    """Threshold at which the means of the pixels below and above are farthest apart.

    Their distance is weighted by both numbers of pixels (Otsu, IEEE Trans. SMC 9, 1979).
    """
    counts, edges = np.histogram(image, bins)
    levels = (edges[:-1] + edges[1:]) / 2
    number, total = counts.cumsum()[:-1], (counts * levels).cumsum()
    above = image.size - number
    # One level alone leaves bins with no pixel below them.
    means = total[:-1] / np.maximum(number, 1), (total[-1] - total[:-1]) / np.maximum(above, 1)
    return float(levels[:-1][np.argmax(number * above * (means[0] - means[1]) ** 2)])


def region_centroids(regions: Flags) -> tuple[Floats, Floats]:
    """Centroid of each connected region (Eq. 4.3)."""
    from scipy import ndimage

    labels, _ = ndimage.label(regions)
    y, x = np.nonzero(labels)
    numbers = labels[y, x]
    areas = np.bincount(numbers)[1:].astype(np.float64)
    sums = [np.bincount(numbers, weights=values)[1:] for values in (y, x)]
    return np.stack(sums, axis=-1) / areas[:, np.newaxis], areas


def central_row(centroids: Floats, shape: tuple[int, int]) -> list[int]:
    """Regions of the row that passes the middle of the image, left to right."""
    from scipy.spatial import cKDTree

    tree = cKDTree(centroids)
    distances, _ = tree.query(centroids, 2)
    pitch = float(np.median(distances[:, 1]))
    middle = (np.array(shape) - 1) / 2
    row = [int(tree.query(middle)[1])]
    for sign in (1, -1):
        step = np.array([0.0, sign * pitch])
        at = row[-1] if sign == 1 else row[0]
        while True:
            distance, found = tree.query(centroids[at] + step)
            if distance > 0.35 * pitch:
                break
            step = 0.7 * step + 0.3 * (centroids[found] - centroids[at])
            at = int(found)
            row = [*row, at] if sign == 1 else [at, *row]
    return row


def regression(points: Floats) -> tuple[float, float]:
    """Straight line through centroids by least squares (Eqs. 4.4, 4.5)."""
    x = np.stack([np.ones(len(points)), points[:, 1]], axis=-1)
    offset, slope = np.linalg.solve(x.T @ x, x.T @ points[:, 0])
    return float(offset), float(slope)


def rotated(centroids: Floats, degrees: float, shape: tuple[int, int]) -> Floats:
    """Rotate centroids about the image's middle (Eqs. 4.7-4.9)."""
    angle = np.radians(degrees)
    middle = np.array(shape) / 2
    y, x = (centroids - middle).T
    turned = np.stack(
        [x * np.sin(angle) + y * np.cos(angle), x * np.cos(angle) - y * np.sin(angle)]
    )
    return np.asarray(turned.T + middle)


def thesis_calibration(image: Image32) -> ThesisCalibration:
    """Calibrate by the thesis's method.

    `image`: white image in grey levels, shape (rows, columns).
    """
    centroids, _ = region_centroids(binary(normalised(image)))
    row = central_row(centroids, (image.shape[0], image.shape[1]))
    nothing = float("nan")
    if len(row) < 2:
        # Noise can break regions up, so that no row is found.
        return ThesisCalibration(centroids, row, nothing, nothing)
    _, slope = regression(centroids[row])
    steps = np.diff(centroids[row], axis=0)
    return ThesisCalibration(
        centroids=centroids,
        row=row,
        rotation_degrees=float(np.degrees(np.arctan(slope))),
        pitch=float(np.hypot(*steps.T).mean()),
    )
