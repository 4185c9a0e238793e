# SPDX-License-Identifier: Apache-2.0
"""Pictures and depth of focused plenoptic cameras, whose micro images are pictures themselves.

A point that micro images show d from their centres C lies at C + v d: v is its virtual depth. It
is counted between the centres of the micro images, where v = a p with the focus setting a and
their pitch p in pixels; between those of the micro lenses it is
`plenofir.camera.rays.virtual_depth`, less than a per cent of v - 1 apart as a rule.

`FocusedCapture` refocuses to a v, or to one for each place; `search_depth` finds them;
`types_by_sharpness` tells types of micro lenses apart; `read_vendor_grid` reads files of makers.
"""

from plenofir.camera.focused.agreement import moved_to_agree
from plenofir.camera.focused.capture import FocusedCapture, focused_capture
from plenofir.camera.focused.depth import FocusedDepth, search_depth
from plenofir.camera.focused.gaps import calibration_of_gaps
from plenofir.camera.focused.raster import FocusedRaster, focused_raster
from plenofir.camera.focused.scale import DepthScale
from plenofir.camera.focused.vendor import VendorGrid, read_vendor_grid
from plenofir.camera.focused.which_type import types_by_sharpness

__all__ = [
    "DepthScale",
    "FocusedCapture",
    "FocusedDepth",
    "FocusedRaster",
    "VendorGrid",
    "calibration_of_gaps",
    "focused_capture",
    "focused_raster",
    "moved_to_agree",
    "read_vendor_grid",
    "search_depth",
    "types_by_sharpness",
]
