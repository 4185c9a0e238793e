# SPDX-License-Identifier: Apache-2.0
"""Reference of `focal_stack` (docs/stack.md): all slices of a pixel, exact, nearest neighbour."""

import numpy as np

from hunt.references.raster_refocuser import refocused


def stack(raw: np.ndarray, g: dict) -> np.ndarray:
    """The slices of a frame, one after another in the channels."""
    plain = {**g, "EXACT": True, "INTERPOLATION_ORDER": 0, "SHARPENING": ""}
    return np.dstack([refocused(raw, plain, s) for s in range(len(g["SHIFTS"].split()))])
