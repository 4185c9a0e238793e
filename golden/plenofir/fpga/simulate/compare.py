# SPDX-License-Identifier: Apache-2.0
"""The one comparison of a simulated frame with the golden one."""

from dataclasses import dataclass

import numpy as np

from plenofir.refocus.operator import Image


@dataclass(frozen=True)
class Comparison:
    """Outcome of a comparison of frames.

    Attributes
    ----------
    pixels
        Number of pixels compared (all channels of a pixel count once).
    mismatches
        Number of pixels that differ in any channel.
    first
        Description of the first wrong pixel, or None.
    """

    pixels: int
    mismatches: int
    first: str | None


def compare_frames(got: Image, want: Image) -> Comparison:
    """Compare frames pixel by pixel.

    Parameters
    ----------
    got
        Frames, shape (frames, rows, columns) or (frames, rows, columns, channels).
    want
        What they should be, same shape.

    Returns
    -------
    Comparison
        Counts, and where the first wrong pixel is and what it holds.

    Raises
    ------
    ValueError
        If the shapes differ.
    """
    if got.shape != want.shape:
        raise ValueError(f"got frames of shape {got.shape}, want {want.shape}")
    with_channels = want.shape if want.ndim == 4 else (*want.shape, 1)
    got, want = got.reshape(with_channels), want.reshape(with_channels)
    wrong = got != want
    wrong_pixels = wrong.any(axis=3)
    mismatches = int(wrong_pixels.sum())
    first = None
    if mismatches:
        index = np.unravel_index(int(wrong.argmax()), wrong.shape)
        frame, line, column, channel = (int(i) for i in index)
        first = (
            f"frame {frame}, line {line}, column {column}, channel {channel}: "
            f"got {got[index]}, want {want[index]}"
        )
    return Comparison(int(wrong_pixels.size), mismatches, first)


def difference_picture(got: Image, want: Image) -> Image:
    """Absolute difference, stretched so that the largest one is white.

    Parameters
    ----------
    got, want
        Images of the same shape and type.

    Returns
    -------
    numpy.ndarray
        uint8, shape of the images; black where they agree.
    """
    difference = np.abs(got.astype(np.int64) - want.astype(np.int64))
    scale = max(int(difference.max(initial=0)), 1)
    return ((difference * 255 + scale - 1) // scale).astype(np.uint8)
