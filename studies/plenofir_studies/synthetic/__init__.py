# SPDX-License-Identifier: Apache-2.0
"""A synthetic plenoptic camera, for ground truth.

`render` takes pictures of textured planes; `white_image` makes patterns with known centres.
"""

from plenofir_studies.synthetic.pattern import centres_within, regular_grid, white_image
from plenofir_studies.synthetic.render import (
    Capture,
    TexturedPlane,
    field_of_view,
    micro_image_pitch,
    pinhole_view,
    render,
    with_pitch,
)

__all__ = [
    "Capture",
    "TexturedPlane",
    "centres_within",
    "field_of_view",
    "micro_image_pitch",
    "pinhole_view",
    "regular_grid",
    "render",
    "white_image",
    "with_pitch",
]
