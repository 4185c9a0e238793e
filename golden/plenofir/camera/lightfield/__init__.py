# SPDX-License-Identifier: Apache-2.0
"""Light fields from aligned raw images: indexing, views, focal stacks, disparity, depth.

`raw` is a raw image, shape (rows, columns[, 3]), `micro_image_size` its M in pixels; `progress` is
called with the parts done and to do.
"""

from plenofir.camera.lightfield.disparity import (
    DepthMap,
    Disparity,
    depth_map,
    light_field_disparity,
)
from plenofir.camera.lightfield.exports import named_views
from plenofir.camera.lightfield.indexing import compose, light_field, raw_image, sub_aperture, views
from plenofir.camera.lightfield.stack import (
    PICTURE,
    FocalStack,
    all_in_focus,
    focal_stack,
    peak,
    sharpness,
    sharpness_curve,
)

__all__ = [
    "PICTURE",
    "DepthMap",
    "Disparity",
    "FocalStack",
    "all_in_focus",
    "compose",
    "depth_map",
    "focal_stack",
    "light_field",
    "light_field_disparity",
    "named_views",
    "peak",
    "raw_image",
    "sharpness",
    "sharpness_curve",
    "sub_aperture",
    "views",
]
