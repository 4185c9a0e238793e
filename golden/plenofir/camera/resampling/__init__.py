# SPDX-License-Identifier: Apache-2.0
"""From the raw sensor to the raster of micro images as the chip does it: bit-true models.

`grid_registers` and `tables_of` turn a calibration into what the chip's registers and memories
hold, `interpolate_mosaic` and `resample` compute what it makes of a frame. `where` names the input
in messages.
"""

from plenofir.camera.resampling.grid_resampler import Tables, lit_pixels, resample, tables_of
from plenofir.camera.resampling.mosaic import (
    BAYER_ORDERS,
    BayerOrder,
    interpolate_mosaic,
    red_place,
)
from plenofir.camera.resampling.registers import (
    Accuracy,
    GridRegisters,
    Precision,
    grid_registers,
)

__all__ = [
    "BAYER_ORDERS",
    "Accuracy",
    "BayerOrder",
    "GridRegisters",
    "Precision",
    "Tables",
    "grid_registers",
    "interpolate_mosaic",
    "lit_pixels",
    "red_place",
    "resample",
    "tables_of",
]
