# SPDX-License-Identifier: Apache-2.0
"""Calibration: from a white image to micro image centres, from a raw capture to an aligned raster.

`calibrate` finds the grid, `load_calibration` reads it back, `decode` resamples captures.
`inspect_white`, `focus_score` and `infinity_focus` tell how a camera is adjusted.
`where` names the input in messages; `progress` is called with the parts done and to do.
"""

from plenofir.camera.calibration.calibrate import calibrate, calibration_of_grid
from plenofir.camera.calibration.evidence import Evidence
from plenofir.camera.calibration.fit import Fit, fit_grid
from plenofir.camera.calibration.grid import Grid, Layout
from plenofir.camera.calibration.inspection import FillFactor, WhiteInspection, inspect_white
from plenofir.camera.calibration.record import Calibration, load_calibration
from plenofir.camera.calibration.resample import (
    decode,
    hexagonal_to_rectangular,
    largest_odd_size,
    raster_window,
)
from plenofir.camera.calibration.spots import (
    FocusScore,
    InfinityFocus,
    Spots,
    focus_score,
    infinity_focus,
    measure_spots,
)

__all__ = [
    "Calibration",
    "Evidence",
    "FillFactor",
    "Fit",
    "FocusScore",
    "Grid",
    "InfinityFocus",
    "Layout",
    "Spots",
    "WhiteInspection",
    "calibrate",
    "calibration_of_grid",
    "decode",
    "fit_grid",
    "focus_score",
    "hexagonal_to_rectangular",
    "infinity_focus",
    "inspect_white",
    "largest_odd_size",
    "load_calibration",
    "measure_spots",
    "raster_window",
]
