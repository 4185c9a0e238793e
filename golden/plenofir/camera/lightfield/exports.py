# SPDX-License-Identifier: Apache-2.0
"""Files for other programs: views, mosaics, quilts, .pfm, float TIFF, point clouds."""

import io
from math import isqrt

import numpy as np
import numpy.typing as npt

from plenofir.camera.lightfield.between import views_between
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError
from plenofir.ground.images import eight_bits
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]


def named_views(images: Image) -> dict[str, Image]:
    """Views (v, u, t, s[, 3]) with the names of their files."""
    rows, columns = images.shape[:2]
    digits = max(2, len(str(max(rows, columns) - 1)))
    return {
        f"view_{v:0{digits}}_{u:0{digits}}.png": images[v, u] for v, u in np.ndindex(rows, columns)
    }


def mosaic(images: Image) -> Image:
    """All views (v, u, t, s[, 3]) side by side: view (v, u) is the tile in row v and column u."""
    v, u, t, s = images.shape[:4]
    return np.moveaxis(images, 2, 1).reshape(v * t, u * s, *images.shape[4:])


def quilt_tiles(count: int) -> tuple[int, int]:
    """Columns and rows of a quilt that takes all views of a line."""
    rows = max(n for n in range(1, isqrt(count) + 1) if count % n == 0)
    return count // rows, rows


def quilt(line: Image, columns: int, rows: int, disparity: Floats | None = None) -> Image:
    """Views of a line from left to right (u, t, s[, 3]), in the order of a Looking Glass's quilt.

    `columns` x `rows` views are taken evenly from left to right: those nearest, or, if there are
    more than in the line, views between them, for which the `disparity` of view u // 2 is needed,
    in pixels per view. The one farthest to the left is the tile at the bottom left; the next ones
    lie to its right, then in the row above.
    """
    there, count = len(line), columns * rows
    places = np.linspace(0, there - 1, count) if count > 1 else np.array([there // 2])
    if count <= there:
        chosen = [line[place] for place in np.rint(places).astype(int)]
    elif disparity is None or there < 2:
        raise InputError(
            f"a quilt of {columns} x {rows} tiles needs more views than the {there} of a "
            "row; use fewer columns"
        )
    else:
        chosen = list(views_between(line, disparity, places.tolist()))
    lines = [
        np.concatenate(chosen[row * columns : (row + 1) * columns], axis=1) for row in range(rows)
    ]
    return np.concatenate(lines[::-1], axis=0)


def quilt_name(stem: str, view: tuple[int, int], columns: int, rows: int) -> str:
    """Name of a quilt by the convention of Looking Glass: NAME_qsCOLUMNSxROWSaASPECT.

    `view` is (rows, columns) in pixels; the aspect is width over height.
    """
    return f"{stem}_qs{columns}x{rows}a{view[1] / view[0]:.4g}"


def encode_pfm(values: Floats) -> bytes:
    """Map of numbers as .pfm: 32 bit little endian, bottom line first, infinite where unknown."""
    rows, columns = values.shape
    content = np.where(np.isnan(values), np.inf, values)[::-1].astype("<f4")
    return b"Pf\n%d %d\n-1.0\n" % (columns, rows) + content.tobytes()


def encode_float_tiff(values: Floats) -> bytes:
    """Map of numbers as TIFF of 32 bit floats, nan where unknown."""
    from tifffile import imwrite

    file = io.BytesIO()
    imwrite(file, values.astype(np.float32), photometric="minisblack", metadata=None)
    return file.getvalue()


def points(distance_mm: Floats, model: RayModel) -> Floats:
    """Where the pixels of the central view lie in space, by the ray model.

    Distances (t, s) are from the micro lenses in mm, nan where unknown. (x, y, z) in mm, shape (t,
    s, 3): x to the right and y down in the picture, z away from the micro lenses, whose middle is
    on the axis of the camera, focused as it was.
    """
    lens = model.camera.main_lens
    # Rays leave the main lens at its object side principal plane.
    z = distance_mm - model.image_distance_mm - lens.principal_plane_separation_mm
    m = model.micro_image_size
    # For even M the central view is half a pixel from the middle of the micro images.
    offset = m // 2 - (m - 1) / 2
    result = np.empty((*distance_mm.shape, 3))
    for axis, n in enumerate(distance_mm.shape):
        place = (np.arange(n) - (n - 1) / 2) * model.camera.micro_lenses.pitch_mm
        slope, height = model.object_ray(np.full(n, offset), place)
        shape = (n, 1) if axis == 0 else (1, n)
        # The main lens turns the picture upside down.
        result[..., 1 - axis] = -(slope.reshape(shape) * z + height.reshape(shape))
    result[..., 2] = distance_mm
    return np.where(np.isnan(distance_mm)[..., np.newaxis], np.nan, result)


def encode_ply(places: Floats, colours: Image) -> bytes:
    """Point cloud as binary .ply, in mm; points without a place (nan) are left out.

    Places (t, s, 3) as of `points`, colours grey or RGB, (t, s[, 3]), uint8 or uint16.
    """
    finite = ~np.isnan(places).any(axis=-1)
    levels = colours if colours.ndim == 3 else np.repeat(colours[..., np.newaxis], 3, axis=2)
    levels = eight_bits(levels)
    names = ("x", "y", "z"), ("red", "green", "blue")
    kinds = [(name, "<f4") for name in names[0]] + [(name, "u1") for name in names[1]]
    vertices = np.empty(int(finite.sum()), dtype=kinds)
    for k in range(3):
        vertices[names[0][k]] = places[finite][:, k]
        vertices[names[1][k]] = levels[finite][:, k]
    lines = [
        *("ply", "format binary_little_endian 1.0", "comment mm; x right, y down, z away"),
        f"element vertex {len(vertices)}",
        *(f"property float {name}" for name in names[0]),
        *(f"property uchar {name}" for name in names[1]),
        "end_header",
    ]
    return ("\n".join(lines) + "\n").encode() + vertices.tobytes()
