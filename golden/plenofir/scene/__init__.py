"""A synthetic plenoptic camera, for ground truth.

`render` takes pictures of textured planes; `white_image` makes patterns with known centres.
"""

from plenofir.scene.pattern import centres_within, regular_grid, white_image
from plenofir.scene.render import (
    Capture,
    TexturedPlane,
    field_of_view,
    micro_image_pitch,
    render,
    with_pitch,
)

__all__ = [
    "Capture",
    "TexturedPlane",
    "centres_within",
    "field_of_view",
    "micro_image_pitch",
    "regular_grid",
    "render",
    "white_image",
    "with_pitch",
]
