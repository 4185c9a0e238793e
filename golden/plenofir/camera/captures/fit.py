# SPDX-License-Identifier: Apache-2.0
"""Whether a calibration fits a capture, by the capture's own pixels.

Micro images are brighter in their middle, whatever the scene, so a capture shows where they are
(`plenofir.camera.patterns.match`). A calibration that lies elsewhere is of another camera, or the
camera was zoomed, remounted, turned, binned or cropped since.
"""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Floats, Grid
from plenofir.camera.calibration.moving import PixelMap, mapped, same_pixels, turning
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.patterns.lenslets import Lenslets, find_lenslets
from plenofir.camera.patterns.match import Match, match_capture
from plenofir.ground.errors import InputError

# A grid fits if it lies within so many pixels, or shares of the pitch, or if a move explains less
# than so many times what chance does.
_FITS_PX, _FITS_PITCHES, _CLEAR_GAIN = 0.5, 0.04, 8.0
# Agreement from which a grid that had to be moved, or was found anew, is trusted.
_TRUSTED = 0.7
# A grid is moved within these limits: share of the pitch, degrees.
_MOST_SCALE, _MOST_TURN = 0.05, 2.0
# Steps between lenses of one grid, measured twice, differ by less than this share.
_SAME_STEPS = 0.03
_BINNED = (2, 3, 4)
# Ways in which a capture's rows and columns may lie against a white image's, by EXIF's numbers.
_TURNS = {
    3: "turned by 180 degrees",
    2: "mirrored from left to right",
    4: "mirrored from top to bottom",
    6: "turned by 90 degrees to the right",
    8: "turned by 90 degrees to the left",
    5: "mirrored with rows and columns exchanged",
    7: "mirrored and turned by 90 degrees with rows and columns exchanged",
}
_OPPOSITE = {6: 8, 8: 6}
_TRANSPOSING = 5  # this number, and those above, exchange rows and columns


@dataclass(frozen=True)
class Fitted:
    """A calibration that fits a capture, and what was done to make it fit."""

    calibration: Calibration
    place: PixelMap  # where the white image's pixels are in the capture
    notes: tuple[str, ...]  # for people; none for a pair that fits

    @property
    def as_it_was(self) -> bool:
        """Whether the capture's pixels are the white image's."""
        return bool((self.place.matrix == np.eye(2)).all() and not self.place.shift.any())


def located(levels: Image32, grid: Grid, source: str, where: str) -> Match:
    """Where a grid lies in a capture's pixels.

    `levels`: grey levels; `source`: what the grid is of, for messages. The grid stays where micro
    images are not seen. Raises `InputError` if the pixels have another grid.
    """
    match = match_capture(levels, grid)
    other = None if match.fits else find_lenslets(levels)
    if other is not None:
        raise _another(other, grid, source, where)
    return match


def _another(other: Lenslets, grid: Grid, source: str, where: str) -> InputError:
    """Error of pixels that have another grid than a known one."""
    return InputError(
        f"the pixels have micro images {other.pitch:.2f} pixels apart ({other.layout}, rotated by "
        f"{other.rotation_degrees:.2f} degrees), {source} {grid.lens_pitch:.2f} ({grid.layout}, "
        f"{grid.rotation_degrees:.2f} degrees)",
        where=where,
    )


def fitted(
    levels: Image32,
    calibration: Calibration,
    *,
    roi: tuple[int, int] | None = None,
    orientation: int = 1,
    where: str = "raw capture",
) -> Fitted:
    """Check a calibration with a capture's pixels, and move it to where they have the grid.

    `levels`: grey levels of the capture as its file stores them, shape (rows, columns). `roi`:
    column and row of the white image at which the capture begins, if it is a part of the sensor.
    `orientation`: how the capture is to be turned to be looked at, as EXIF counts. A camera stores
    its sensor's rows whichever way it is held, so the pixels decide, and orientations that differ
    say only which turn is tried first. Result: the calibration as it is where it fits. Raises
    `InputError` if the capture cannot be of this camera as it was then.
    """
    shape = levels.shape[0], levels.shape[1]
    try:
        place, notes = _by_size(shape, calibration, roi, where)
    except InputError:
        turned = _turned(levels, calibration, roi, orientation, where)
        if turned is None:
            raise
        return turned
    moved = calibration if place is None else mapped(calibration, place)
    place = place or same_pixels(shape)
    match = match_capture(levels, moved.grid)
    if _fits(match, moved.grid):
        return Fitted(moved, place, notes)
    turned = _turned(levels, calibration, roi, orientation, where)
    if turned is not None:
        return turned
    # The content of a focused camera's micro images repeats nearly as its lenses do.
    lenses = None if calibration.lens_types is not None else find_lenslets(levels)
    # Phases alone may agree with a grid of another pitch whose waves fall on these; lenses that are
    # found anew decide.
    if match.fits and (lenses is None or _alike(lenses.grid, match.grid)):
        return _moved(levels, calibration, moved.grid, place, match, notes, where)
    if lenses is not None:
        raise _unfit(_another(lenses, moved.grid, "the calibration has", where).problem, where)
    note = (
        "micro images are not seen in its pixels, so it could not be checked whether the "
        "calibration fits"
    )
    return Fitted(moved, place, (*notes, note))


def _turned(
    levels: Image32,
    calibration: Calibration,
    roi: tuple[int, int] | None,
    orientation: int,
    where: str,
) -> Fitted | None:
    """A calibration that fits after a turn, what the orientations tell tried first."""
    shape = levels.shape[0], levels.shape[1]
    # Upright both look the same way: the white image's turn, then the capture's back.
    upright = turning(calibration.image_shape, calibration.orientation or 1)
    likely = upright.then(turning(upright.shape, _OPPOSITE.get(orientation, orientation)))

    def is_unlikely(way: int) -> bool:
        return bool((turning(calibration.image_shape, way).matrix != likely.matrix).any())

    for way in sorted(_TURNS, key=is_unlikely):
        before = shape[::-1] if way >= _TRANSPOSING else shape
        try:
            as_white, notes = _by_size(before, calibration, roi, where)
        except InputError:
            continue
        place = (as_white or same_pixels(before)).then(turning(before, way))
        other = mapped(calibration, place)
        if _fits(match_capture(levels, other.grid), other.grid, strict=True):
            verb = _TURNS[way].split()[0]
            note = f"it is {_TURNS[way]} against the calibration, which was {verb} with it"
            return Fitted(other, place, (*notes, note))
    return None


def _unfit(problem: str, where: str) -> InputError:
    """Error of a calibration that does not fit."""
    return InputError(f"{problem}; use a white image of this camera at this zoom", where=where)


def _alike(grid: Grid, other: Grid) -> bool:
    """Whether two grids have the same layout, pitch and direction, near enough to be one."""
    steps = grid.vectors @ np.linalg.inv(other.vectors)
    return grid.layout == other.layout and bool(np.abs(steps - np.eye(2)).max() < _SAME_STEPS)


def _by_size(
    shape: tuple[int, int],
    calibration: Calibration,
    roi: tuple[int, int] | None,
    where: str,
) -> tuple[PixelMap | None, tuple[str, ...]]:
    """Finding from the sizes of capture and white image; None if they are equal."""
    white = calibration.image_shape
    sizes = (
        f"has {shape[1]} x {shape[0]} pixels, the calibration's white image {white[1]} x {white[0]}"
    )
    if roi is not None:
        ends = roi[1] + shape[0], roi[0] + shape[1]
        if min(roi) < 0 or ends[0] > white[0] or ends[1] > white[1]:
            raise InputError(f"{sizes}, in which it does not lie at {roi[0]},{roi[1]}", where=where)
        return PixelMap(np.eye(2), np.array([-roi[1], -roi[0]], dtype=np.float64), shape), ()
    if shape == white:
        return None, ()
    for n in _BINNED:
        if shape == (white[0] // n, white[1] // n):
            # Pixel 0 of the capture is pixels 0 to n - 1.
            map_ = PixelMap(np.eye(2) / n, np.full(2, -(n - 1) / (2 * n)), shape)
            return map_, (f"{sizes}: taken as binned {n} x {n}",)
        if white == (shape[0] // n, shape[1] // n):
            map_ = PixelMap(np.eye(2) * n, np.full(2, (n - 1) / 2), shape)
            return map_, (f"{sizes}: the white image is taken as binned {n} x {n}",)
    if shape == white[::-1]:
        raise InputError(
            f"{sizes}: it is turned by 90 degrees, and its pixels do not tell which way; turn it "
            "back",
            where=where,
        )
    if shape[0] <= white[0] and shape[1] <= white[1]:
        middle = (white[1] - shape[1]) // 2, (white[0] - shape[0]) // 2
        raise InputError(
            f"{sizes}; if it is a part of the sensor (ROI), give the column and row at which it "
            f"begins, --roi {middle[0]},{middle[1]} for the middle; else use a white image of "
            "this camera and mode",
            where=where,
        )
    raise InputError(f"{sizes}; use a white image of the same camera and mode", where=where)


def _fits(match: Match, grid: Grid, *, strict: bool = False) -> bool:
    """Whether a grid lies where the pixels have it, as far as they tell."""
    near = match.moved_px <= max(_FITS_PX, _FITS_PITCHES * grid.lens_pitch)
    return match.fits and (near or (match.gain < _CLEAR_GAIN and not strict))


def _moved(
    levels: Image32,
    calibration: Calibration,
    grid: Grid,
    place: PixelMap,
    match: Match,
    notes: tuple[str, ...],
    where: str,
) -> Fitted:
    """The calibration moved to where the pixels have the grid; refused if they are not clear."""
    matrix, shift = np.array(match.matrix), np.array(match.shift)
    again = match_capture(levels, match.grid)
    matrix, shift = np.array(again.matrix) @ matrix, np.array(again.matrix) @ shift + again.shift
    words, scale, turn = _off(matrix, shift, grid, levels.shape)
    sure = again.fits and max(again.agreement, again.smoothness) >= _TRUSTED
    if not sure or abs(scale) > _MOST_SCALE or abs(turn) > _MOST_TURN or not _fits(again, grid):
        raise _unfit(f"the calibration does not fit its pixels: micro images lie {words}", where)
    whole = place.then(PixelMap(matrix, shift, place.shape))
    note = (
        f"the calibration did not fit its pixels: micro images lie {words}; the grid was moved "
        "there, and a white image of the camera as it is now is better"
    )
    return Fitted(mapped(calibration, whole), whole, (*notes, note))


def _off(
    matrix: Floats, shift: Floats, grid: Grid, shape: tuple[int, ...]
) -> tuple[str, float, float]:
    """How far a grid lies off, for people; its scale less 1, and its turn in degrees."""
    middle = (np.array(shape) - 1) / 2
    off = matrix @ middle + shift - middle
    # A grid looks the same after a move by a lens.
    _, _, off = grid.nearest(grid.centres(*grid.nearest(middle)[:2]) + off)
    scale = float(np.sqrt(np.linalg.det(matrix)) - 1)
    turn = float(np.degrees(np.arctan2(matrix[0, 1] - matrix[1, 0], np.trace(matrix))))
    words = f"{off[0]:.2f} pixels lower and {off[1]:.2f} to the right of its grid's in the middle"
    if abs(scale) > 1e-4:
        words += f", {abs(100 * scale):.2f} % {'farther apart' if scale > 0 else 'closer'}"
    if abs(turn) > 0.02:
        words += f", rotated by {turn:.2f} degrees"
    return words, scale, turn
