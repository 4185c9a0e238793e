# SPDX-License-Identifier: Apache-2.0
"""The one comparison of a simulated frame with the golden one."""

from dataclasses import dataclass

import numpy as np

from plenofir.refocus.operator import Image


@dataclass(frozen=True)
class Comparison:
    """Outcome of a comparison of frames."""

    pixels: int  # number of pixels compared; all channels of a pixel count once
    mismatches: int  # pixels that differ in any channel
    first: str | None  # description of the first wrong pixel


def compare_frames(got: Image, want: Image) -> Comparison:
    """Compare frames of shape (frames, rows, columns[, channels]) pixel by pixel."""
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
    """Absolute difference as uint8, stretched so that the largest one is white."""
    difference = np.abs(got.astype(np.int64) - want.astype(np.int64))
    scale = max(int(difference.max(initial=0)), 1)
    return ((difference * 255 + scale - 1) // scale).astype(np.uint8)
