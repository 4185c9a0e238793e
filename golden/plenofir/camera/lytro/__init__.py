# SPDX-License-Identifier: Apache-2.0
"""Files of Lytro's cameras: container, metadata, pixels, micro lens grid.

`read_lytro` reads a capture with its grid; `read_frame`, `develop` and `FrameMetadata.grid` are the
parts that it is made of.
"""

from plenofir.camera.lytro.capture import LytroCapture, read_lytro
from plenofir.camera.lytro.container import Container, is_container, read_container
from plenofir.camera.lytro.frames import Frame, White, is_lytro, nearest_white, read_frame
from plenofir.camera.lytro.metadata import FrameMetadata, frame_metadata
from plenofir.camera.lytro.sensor import balanced, develop, grey_mosaic, unpack

__all__ = [
    "Container",
    "Frame",
    "FrameMetadata",
    "LytroCapture",
    "White",
    "balanced",
    "develop",
    "frame_metadata",
    "grey_mosaic",
    "is_container",
    "is_lytro",
    "nearest_white",
    "read_container",
    "read_frame",
    "read_lytro",
    "unpack",
]
