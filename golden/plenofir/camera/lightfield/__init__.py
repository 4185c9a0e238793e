# SPDX-License-Identifier: Apache-2.0
"""Light fields from aligned raw images: indexing, views, focal stacks, disparity, depth.

`raw` is a raw image, shape (rows, columns[, 3]), `micro_image_size` its M in pixels; `progress` is
called with the parts done and to do.
"""

from plenofir.camera.lightfield.absolute_differences import sad_disparity
from plenofir.camera.lightfield.disparity import (
    DepthMap,
    Disparity,
    depth_map,
    light_field_disparity,
)
from plenofir.camera.lightfield.exports import named_views, write_views
from plenofir.camera.lightfield.fourier import aperture_weights, fourier_slice, shifted_views
from plenofir.camera.lightfield.indexing import (
    compose,
    light_field,
    light_field_index,
    raw_image,
    raw_index,
    sub_aperture,
    views,
)
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
    "aperture_weights",
    "compose",
    "depth_map",
    "focal_stack",
    "fourier_slice",
    "light_field",
    "light_field_disparity",
    "light_field_index",
    "named_views",
    "peak",
    "raw_image",
    "raw_index",
    "sad_disparity",
    "sharpness",
    "sharpness_curve",
    "shifted_views",
    "sub_aperture",
    "views",
    "write_views",
]
