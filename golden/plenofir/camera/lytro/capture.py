# SPDX-License-Identifier: Apache-2.0
"""From a Lytro file to what `plenofir.camera.calibration.decode` takes: a picture and a grid."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plenofir.camera.calibration.calibrate import calibrate, calibration_of_grid
from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Grid
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.captures.fit import located
from plenofir.camera.lytro.frames import Frame, nearest_white, read_frame
from plenofir.camera.lytro.metadata import FrameMetadata
from plenofir.camera.lytro.sensor import (
    FULL_SCALE,
    Colour,
    Demosaic,
    Mosaic,
    balanced,
    develop,
    grey_mosaic,
)
from plenofir.camera.patterns.match import Match
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

# Pitches of a white image and of the capture's metadata may differ by this share.
_SAME_PITCH = 0.005


@dataclass(frozen=True, eq=False)
class LytroCapture:
    """A capture ready to be decoded."""

    image: Image  # RGB in linear light, uint16, 0 to 65535.
    calibration: Calibration  # grid of the capture; vignetting only if it came from a white image.
    white: Image | None  # White image to divide by, RGB, where one was given.
    metadata: FrameMetadata
    lines: tuple[tuple[str, str], ...]  # What was done, headings and texts for people.


def checked_grid(grey: Image32, metadata: FrameMetadata, where: str) -> Match:
    """Grid of the metadata, moved to where the capture's pixels (`grey_mosaic`) have it.

    It stays where micro images are not seen; InputError if the pixels have another grid.
    """
    try:
        return located(grey, metadata.grid(), "the metadata say", where)
    except InputError as error:
        raise InputError(f"{error.problem}; the file may be damaged", where=where) from None


def read_lytro(
    path: Path,
    *,
    white: Path | None = None,
    colour: Colour = "balanced",
    demosaic: Demosaic = "edge-aware",
) -> LytroCapture:
    """Read a Lytro capture, with or without a white image.

    `path`: a .lfp, .lfr or .raw file, see `read_frame`. `white`: white image, or a set of them, see
    `nearest_white`; without one the grid is that of the file's metadata, moved to where the
    capture's own pixels have it. `colour`, `demosaic`: see `develop`. Raises `InputError` if the
    file or the white image cannot be used, or its pixels contradict its metadata.
    """
    frame = read_frame(path)
    metadata = frame.metadata
    mosaic = frame.mosaic()
    linear = balanced(mosaic, metadata)
    match = checked_grid(grey_mosaic(linear), metadata, str(path))
    lines = metadata.described()
    image = develop(mosaic, metadata, colour=colour, demosaic=demosaic)
    shape = metadata.height, metadata.width
    if white is None:
        lines.append(("grid", match_text(match)))
        return LytroCapture(
            image, calibration_of_grid(match.grid, shape), None, metadata, tuple(lines)
        )
    chosen = nearest_white(white, metadata)
    lines.append(("white image", chosen.described()))
    calibration, white_mosaic = _calibrated(chosen.frame)
    off = _apart(calibration.grid, match.grid, chosen.frame.where)
    lines.append(
        ("grid", f"of the white image, {off:.2f} pixels from the metadata's in the middle")
    )
    divisor = develop(white_mosaic, chosen.frame.metadata, colour="camera", demosaic=demosaic)
    return LytroCapture(image, calibration, divisor, metadata, tuple(lines))


def match_text(match: Match) -> str:
    """Outcome for the metadata's grid, for people."""
    if not match.fits:
        return "of the metadata, unchecked: micro images are not seen in the pixels"
    return (
        f"of the metadata, moved by up to {match.moved_px:.2f} pixels to the capture's own "
        f"micro images (agreement {match.agreement:.2f})"
    )


def _calibrated(frame: Frame) -> tuple[Calibration, Mosaic]:
    """Calibration of a white image, and its mosaic."""
    mosaic = frame.mosaic()
    grey = grey_mosaic(balanced(mosaic, frame.metadata, white_balance=False))
    levels = np.clip(np.rint(grey), 0, FULL_SCALE).astype(np.uint16)
    return calibrate(levels, where=frame.where, full_scale=FULL_SCALE), mosaic


def _apart(grid: Grid, other: Grid, where: str) -> float:
    """Distance in pixels of two grids in the middle of the first; their pitches must agree."""
    if grid.layout != other.layout or abs(grid.lens_pitch / other.lens_pitch - 1) > _SAME_PITCH:
        raise InputError(
            f"has micro images {grid.lens_pitch:.3f} pixels apart ({grid.layout}), the "
            f"capture {other.lens_pitch:.3f} ({other.layout}); use a white image of the "
            "same camera and zoom",
            where=where,
        )
    middle = grid.positions(np.array(grid.middle))
    _, _, from_centre = grid.nearest(middle)
    _, _, between = other.nearest(middle - from_centre)
    return float(np.hypot(*between))
