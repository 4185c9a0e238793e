# SPDX-License-Identifier: Apache-2.0
"""A grid from elsewhere, moved to where the micro images of a capture agree.

Pixels beyond the border of a micro image are its neighbour's: laid over each other they disagree at
any depth. A move that is common to all lenses changes nothing else, so it is found by that alone.
"""

from collections.abc import Callable
from typing import cast

import numpy as np

from plenofir.camera.calibration.moving import PixelMap, mapped
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.focused.capture import FocusedCapture
from plenofir.camera.focused.depth import Floats, differences, search_depth

# First and last step of the search, in pitches and pixels; a move explains at least this share.
_FIRST, _LAST, _WORTH = 0.1, 0.25, 0.03
# Depths that are tried, and side of the capture's middle that is looked at, in pitches.
_DEPTHS, _MIDDLE = 10, 30.0
_AROUND, _PLACES = 0.3, 6.0
# Depths of the scene at first: those that are sure, as many at least; percentiles from - to.
_SURE, _FEWEST, _SHARE = 0.5, 100, (5, 90)


def moved_to_agree(
    calibration: Calibration, capture_of: Callable[[Calibration], FocusedCapture]
) -> tuple[Calibration, tuple[float, float]]:
    """The calibration where micro images agree best, and by how many pixels (y, x) it was moved.

    `capture_of` makes the capture with a calibration.
    """
    pitch = calibration.grid.lens_pitch
    depth = search_depth(capture_of(calibration))
    sure = depth.inverse[depth.confidence >= _SURE]
    if sure.size < _FEWEST:
        return calibration, (0.0, 0.0)
    # Few micro images show a place at small depths: they agree by chance.
    far, near = np.percentile(sure, _SHARE)
    inverses = np.linspace(far, near, _DEPTHS)
    place, step = (0.0, 0.0), _FIRST * pitch
    tried: dict[tuple[float, float], float] = {}

    def cost(move: tuple[float, float]) -> float:
        if move not in tried:
            tried[move] = _disagreement(capture_of(_moved(calibration, move)), inverses)
        return tried[move]

    while step > _LAST:
        y, x = place
        around = [place, (y - step, x), (y + step, x), (y, x - step), (y, x + step)]
        best = min(around, key=cost)
        if best == place:
            step /= 2
        place = best
        if max(map(abs, place)) > pitch / 2:
            break
    if cost(place) > (1 - _WORTH) * cost((0.0, 0.0)) or max(map(abs, place)) > pitch / 2:
        return calibration, (0.0, 0.0)
    return _moved(calibration, place), place


def _moved(calibration: Calibration, move: tuple[float, float]) -> Calibration:
    shift = PixelMap(np.eye(2), np.array(move), calibration.image_shape)
    return mapped(calibration, shift)


def _disagreement(capture: FocusedCapture, inverses: Floats) -> float:
    """Differences of the micro images in the middle of a capture, each place at its best depth."""
    step = capture.pitch / _PLACES
    shape = capture.shape(step)
    side = int(_MIDDLE * _PLACES)
    part = cast(
        "tuple[slice, slice]",
        tuple(slice(max(0, (n - side) // 2), (n + side) // 2) for n in shape),
    )
    lenses = capture.lenses()
    grey = capture.pixels.mean(axis=2)
    costs = []
    for inverse in inverses:
        everywhere = np.full(shape, np.nan)
        everywhere[part] = inverse
        off, free = differences(capture, everywhere, step, grey, lenses, _AROUND)
        costs.append((off / np.maximum(free, 0.1))[part])
    least = np.array(costs).min(axis=0)
    return float(np.mean(least))
