# SPDX-License-Identifier: Apache-2.0
"""Writes files as Lytro's cameras do, of scenes with known truth.

The metadata have the names and the values of those that imageio's tests list for an F01 (12 bit,
.lfp) and an Illum (10 bit, .lfr); the size is small and the pixels are rendered.
"""

import copy
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.camera.calibration.grid import Grid
from plenofir.camera.lytro.metadata import FrameMetadata, frame_metadata
from plenofir.camera.rays import RayModel, load_camera
from plenofir_studies.synthetic import TexturedPlane, field_of_view, render
from plenofir_studies.synthetic.render import with_pitch

SIZE = 360, 480

F01: dict[str, Any] = {
    "type": "lightField",
    "image": {
        "width": SIZE[1],
        "height": SIZE[0],
        "orientation": 1,
        "representation": "rawPacked",
        "rawDetails": {
            "pixelFormat": {
                "rightShift": 0,
                "black": {"r": 168, "gr": 168, "gb": 168, "b": 168},
                "white": {"r": 4095, "gr": 4095, "gb": 4095, "b": 4095},
            },
            "pixelPacking": {"endianness": "big", "bitsPerPixel": 12},
            "mosaic": {"tile": "r,gr:gb,b", "upperLeftPixel": "b"},
        },
        "color": {
            "ccmRgbToSrgbArray": [3.11, -1.94, -0.17, -0.36, 1.64, -0.28, 0.08, -1.16, 2.08],
            "gamma": 0.41666001081466675,
            "whiteBalanceGain": {"r": 1, "gr": 1, "gb": 1, "b": 1.2578125},
        },
    },
    "devices": {
        "sensor": {"bitsPerPixel": 12, "iso": 207, "pixelPitch": 1.3999999761581417e-06},
        "lens": {
            "infinityLambda": 18.03,
            "focalLength": 0.00684,
            "zoomStep": 943,
            "focusStep": 672,
            "fNumber": 1.92,
            "exitPupilOffset": {"z": 0.22357696533203125},
        },
        "mla": {
            "tiling": "hexUniformRowMajor",
            "lensPitch": 1.3999999999999998e-05,
            "rotation": -0.0008588103810325265,
            "defectArray": [],
            "config": "com.lytro.mla.11",
            "scaleFactor": {"x": 1, "y": 1.0003734827041626},
            "sensorOffset": {"x": -8.1778e-06, "y": 8.0023e-07, "z": 2.5e-05},
        },
    },
    "camera": {"make": "Lytro, Inc.", "model": "F01", "firmware": "v1.0a208"},
}

ILLUM: dict[str, Any] = {
    "image": {
        "width": SIZE[1],
        "height": SIZE[0],
        "orientation": 1,
        "pixelPacking": {"bitsPerPixel": 10, "endianness": "little"},
        "pixelFormat": {
            "white": {"gr": 1023, "r": 1023, "b": 1023, "gb": 1023},
            "black": {"gr": 64, "r": 64, "b": 64, "gb": 64},
            "rightShift": 0,
        },
        "mosaic": {"tile": "r,gr:gb,b", "upperLeftPixel": "gr"},
        "color": {
            "whiteBalanceGain": {"gr": 1.0, "r": 1.3789, "b": 1.1485, "gb": 1.0},
            "ccm": [2.2272, -1.0553, -0.1719, -0.4269, 1.7458, -0.3189, -0.205, -0.747, 1.952],
        },
    },
    "camera": {"make": "Lytro, Inc.", "model": "ILLUM", "firmware": "1.1.1 (23)"},
    "devices": {
        "sensor": {"pixelPitch": 1.4e-06, "pixelWidth": SIZE[1], "pixelHeight": SIZE[0]},
        "mla": {
            "config": "com.lytro.mla.3",
            "rotation": -0.0005426123971119523,
            "tiling": "hexUniformRowMajor",
            "scaleFactor": {"x": 1.0, "y": 1.0003429651260376},
            "lensPitch": 2e-05,
            "sensorOffset": {"x": 8.421777725219726e-06, "y": -9.545820355415345e-07, "z": 3.7e-05},
        },
        "lens": {
            "fNumber": 2.2,
            "exitPupilOffset": {"z": 0.09728562164306641},
            "zoomStep": -297,
            "focusStep": 309,
            "focalLength": 0.0242,
            "infinityLambda": 33.89,
        },
    },
    "algorithms": {"awb": {"computed": {"gain": {"gr": 1.0, "r": 1.3789, "b": 1.1485, "gb": 1.0}}}},
}

PRIVATE = {"camera": {"serialNumber": "A303134643"}}


def changed(metadata: dict[str, Any], *path: str, to: Any) -> dict[str, Any]:
    """Copy of metadata with another value at a place."""
    result = copy.deepcopy(metadata)
    part = result
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = to
    return result


def pack(mosaic: np.ndarray, bits: int) -> bytes:
    """Pixels as the camera packs them."""
    values = mosaic.astype(np.uint16).reshape(-1)
    if bits == 12:
        first, second = values[0::2], values[1::2]
        parts = [first >> 4, ((first & 15) << 4) | (second >> 8), second & 255]
    else:
        four = [values[k::4] for k in range(4)]
        low = sum((value & 3) << 2 * k for k, value in enumerate(four))
        parts = [*(value >> 2 for value in four), low]
    return np.stack(parts, axis=-1).astype(np.uint8).tobytes()


def name_of(content: bytes) -> str:
    return "sha1-" + hashlib.sha1(content).hexdigest()


def section(kind: bytes, content: bytes, padding: int | None = None) -> bytes:
    """A section with what fills it up to 16 bytes."""
    head = b"\x89LF" + kind + b"\r\n\x1a\n" + bytes(4) + len(content).to_bytes(4, "big")
    if content:
        head += name_of(content).encode().ljust(80, b"\0")
    size = len(head) + len(content)
    return head + content + bytes(-size % 16 if padding is None else padding)


HEADER = b"\x89LFP\r\n\x1a\n\x00\x00\x00\x01" + bytes(4)


def lfp_bytes(metadata: dict[str, Any], pixels: bytes) -> bytes:
    """Container of an F01: table of contents first."""
    texts = [json.dumps(part).encode() for part in (metadata, PRIVATE)]
    frame = {
        "imageRef": name_of(pixels),
        "metadataRef": name_of(texts[0]),
        "privateMetadataRef": name_of(texts[1]),
    }
    table = json.dumps({"picture": {"frameArray": [{"frame": frame}]}}).encode()
    # imageio assumes that five zeros follow the table, as in its own example.
    table += b" " * (-(96 + len(table) + 5) % 16)
    parts = [section(b"C", part) for part in (pixels, *texts)]
    return HEADER + section(b"M", table, 5) + b"".join(parts)


def lfr_bytes(metadata: dict[str, Any], pixels: bytes) -> bytes:
    """Container of an Illum: eleven contents, then the table of contents."""
    texts = [json.dumps(part).encode() for part in (metadata, PRIVATE)]
    frame = {
        "imageRef": name_of(pixels),
        "metadataRef": name_of(texts[0]),
        "privateMetadataRef": name_of(texts[1]),
    }
    table = json.dumps({"frames": [{"frame": frame}], "thumbnails": []}).encode()
    others = [b"other %d" % n for n in range(8)]
    parts = [section(b"C", part) for part in (pixels, *texts, *others)]
    return HEADER + b"".join(parts) + section(b"M", table)


@dataclass
class Written:
    """A capture, its white image, and the truth."""

    raw: np.ndarray
    white: np.ndarray
    colour: np.ndarray
    grid: Grid
    metadata: dict[str, Any]
    known: FrameMetadata

    def container(self, pixels: np.ndarray | None = None) -> bytes:
        """The capture (or other pixels) as a file."""
        packed = pack(self.raw if pixels is None else pixels, self.known.packing.bitsPerPixel)
        write = lfp_bytes if self.known.packing.bitsPerPixel == 12 else lfr_bytes
        return write(self.metadata, packed)


def mosaic_of(colour: np.ndarray, known: FrameMetadata) -> np.ndarray:
    """Levels that the sensor gives for linear colours from 0 to 1, white balance undone."""
    tiles = {"b": ("b", "gb", "gr", "r"), "gr": ("gr", "r", "b", "gb")}
    corner = known.mosaic.upperLeftPixel
    gains = known.gains
    result = np.empty(colour.shape[:2])
    for place, channel in enumerate(tiles[corner]):
        part = np.s_[place // 2 :: 2, place % 2 :: 2]
        gain = gains.of(channel) if gains else 1.0
        black, white = known.black.of(channel), known.white.of(channel)
        levels = colour[part][..., {"r": 0, "gr": 1, "gb": 1, "b": 2}[channel]]
        result[part] = black + levels / gain * (white - black)
    return np.rint(result).astype(np.uint16)


def write_capture(metadata: dict[str, Any], *, noise: float = 0.0) -> Written:
    """Render a plane that is sharp at 2/5, on the grid of the metadata."""
    known = frame_metadata(metadata, "test")
    grid = known.grid()
    # The exit pupil is where the metadata have it: nearly parallel light.
    camera = load_camera("lytro1-wide")
    pupil = 1000 * known.lens.exitPupilOffset.z if known.lens.exitPupilOffset else 200.0
    lens = camera.main_lens.model_copy(update={"exit_pupil_mm": pupil})
    camera = camera.model_copy(update={"main_lens": lens})
    model = with_pitch(RayModel.focused(camera, float("inf"), 9), grid.lens_pitch)
    rows, columns = known.height / grid.lens_pitch, known.width / grid.lens_pitch
    rng = np.random.default_rng(3)
    texture = np.kron(rng.random((20, 26, 3)), np.ones((8, 8, 1)))
    distance = float(model.distance(0.4).mm)
    plane = TexturedPlane(texture, distance, field_of_view(model, distance, 1.3 * columns))
    lenses = int(rows) + 1, int(columns) + 1
    taken = render(model, [plane], lenses, grid=grid, radius=0.47, level=0.85, noise=noise)
    size = np.s_[: known.height, : known.width]
    colour = taken.raw[size] / 65535
    colour = np.repeat(colour[..., np.newaxis], 3, axis=2) if colour.ndim == 2 else colour
    white = np.repeat(taken.white[size][..., np.newaxis] / 65535, 3, axis=2)
    return Written(mosaic_of(colour, known), mosaic_of(white, known), colour, grid, metadata, known)


def write_whites(folder: Path, written: Written, steps: dict[str, tuple[int, int]]) -> None:
    """A folder of white images with metadata as the Illum's calibration data have them."""
    folder.mkdir()
    pixels = pack(written.white, written.known.packing.bitsPerPixel)
    for name, (zoom, focus) in steps.items():
        own = changed(written.metadata, "devices", "lens", "zoomStep", to=zoom)
        own["devices"]["lens"]["focusStep"] = focus
        frame = {"frame": {"metadata": own, "privateMetadata": PRIVATE}}
        text = json.dumps({"master": {"picture": {"frameArray": [frame]}}})
        (folder / f"{name}.RAW").write_bytes(pixels)
        (folder / f"{name}.TXT").write_text(text)
