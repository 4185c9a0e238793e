"""Calibration: from a white image to micro image centres, from a raw capture to an aligned raster.

`calibrate` finds the grid, `load_calibration` reads it back, `decode` resamples captures.
"""

from plenofir.camera.calibration.calibrate import calibrate, calibration_of_grid
from plenofir.camera.calibration.evidence import Evidence
from plenofir.camera.calibration.fit import Fit, fit_grid
from plenofir.camera.calibration.grid import Grid, Layout
from plenofir.camera.calibration.record import Calibration, load_calibration
from plenofir.camera.calibration.resample import decode, hexagonal_to_rectangular, raster_window
from plenofir.camera.calibration.text_method import TextCalibration, text_calibration

__all__ = [
    "Calibration",
    "Evidence",
    "Fit",
    "Grid",
    "Layout",
    "TextCalibration",
    "calibrate",
    "calibration_of_grid",
    "decode",
    "fit_grid",
    "hexagonal_to_rectangular",
    "load_calibration",
    "raster_window",
    "text_calibration",
]
