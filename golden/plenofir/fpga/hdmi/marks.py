# SPDX-License-Identifier: Apache-2.0
"""The marked first line by which a board tells whether a picture arrives as it was made.

A place of the line has the colour ``BEGINS + place * STEPS`` modulo 256: neighbours differ by much,
so a scaler spoils it, and each channel takes all of its 256 values, so that no change of colours is
missed. `mark` writes it, `judge` is the golden model of ``hdl/video/picture_marks.vhd``, and
``scripts/marks_hdl.py`` makes ``hdl/video/marks_pkg.vhd`` of the constants.
"""

import numpy as np

from plenofir.refocus.operator import Image

BEGINS = (11, 85, 170)
STEPS = (37, 101, 151)
NEAR = 31
"""Largest difference of a channel that counts as a changed colour, not as another place: limited
range is 20 at most."""
EQUAL_BAR = (0, 160, 0)
CHANGED_BAR = (200, 0, 0)
"""Colours of the bar that the board draws."""


def mark_line(columns: int) -> Image:
    """Make the marked line of shape (columns, 3)."""
    places = np.arange(columns)[:, None]
    line: Image = ((np.array(BEGINS) + places * np.array(STEPS)) % 256).astype(np.uint8)
    return line


def mark(picture: Image) -> Image:
    """Copy a picture of shape (rows, columns, 3), its first line marked."""
    marked = picture.copy()
    marked[0] = mark_line(picture.shape[1])
    return marked


def judge(line: Image) -> int:
    """The board's result for a first line: 0 no marks, 1 other colours, 2 as it was made."""
    apart = np.abs(line.astype(int) - mark_line(len(line))).max(axis=1)
    if not apart.any():
        return 2
    return int(2 * int((apart <= NEAR).sum()) > len(line))
