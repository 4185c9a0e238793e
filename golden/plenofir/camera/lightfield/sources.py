# SPDX-License-Identifier: Apache-2.0
"""Light fields as cameras, data sets and programs leave them: pictures, folders, MATLAB files.

- a folder of views, also the HCI benchmark's (``input_Cam000.png``, ``parameters.cfg``);
- one picture with all views side by side (a mosaic), or with all pixels of a micro image side by
  side (a raster: Lytro's ESLF, 14 x 14 pixels for each lens);
- a MATLAB file with an array of views, as the LFToolbox and the EPFL's data set have it;
- a video of M x M frames, a view each, line by line.
"""

import configparser
import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isqrt
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.folders import ViewOrder, read_paths, read_views_picture
from plenofir.camera.lightfield.indexing import views
from plenofir.camera.patterns.rasters import find_mosaic, find_raster
from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.films import VIDEOS, read_video
from plenofir.ground.images import SCREEN_GAMMA, Image, Picture, bare, read_picture

PictureLayout = Literal["auto", "mosaic", "raster"]
Floats32 = npt.NDArray[np.float32]

ESLF = 14
_LARGEST_MAT = 4 << 30
_MOST_FRAMES = 33**2
_HCI_VIEW = re.compile(r"input_Cam(\d{3})\.png")
_MATLAB_5, _HDF5 = b"MATLAB", b"\x89HDF\r\n\x1a\n"
_MAT_ADVICE = "views are an array LF of (rows, columns of views, height, width, 3 or 4)"


@dataclass(frozen=True, eq=False)
class LightFieldSource:
    """A light field that was read."""

    picture: Picture  # its pixels: views, shape (v, u, t, s[, 3]), uint8 or uint16
    lines: tuple[tuple[str, str], ...]  # what was found, headings and texts for people

    @property
    def images(self) -> Image:
        """Views, shape (v, u, t, s[, 3])."""
        return self.picture.pixels


def read_source(
    path: Path,
    *,
    order: ViewOrder = "rows",
    layout: PictureLayout = "auto",
    size: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> LightFieldSource:
    """Read a light field, whatever it is stored as: a folder or video of views, a picture, .mat.

    `order`: of the numbers in a folder's names (`read_views`). `layout`: of a picture, views side
    by side or micro images; "auto" finds out. `size`: views (pixels of a micro image) along each
    side, None to find out.
    """
    try:
        there = path.exists()
    except (OSError, ValueError):  # Not a file name, or a folder that cannot be read.
        there = False
    if not there:
        raise InputError(
            "no such file or folder; give a folder or video of views, a picture or a .mat file",
            where=str(path),
        )
    if path.is_dir():
        if hci_views(path):
            return read_hci(path, progress=progress)
        return LightFieldSource(read_views_picture(path, order=order, progress=progress), ())
    if path.suffix.lower() == ".mat":
        return LightFieldSource(bare(read_mat(path)), ())
    if path.suffix.lower() in VIDEOS:
        return _video(path, order)
    return _picture(path, layout, size)


def holds_views(path: Path) -> bool:
    """Whether a folder or a file holds views, one by one, by its name."""
    return path.is_dir() or path.suffix.lower() in (".mat", *VIDEOS)


def _video(path: Path, order: ViewOrder) -> LightFieldSource:
    """Views of a video: frame after frame a line of views, or a column."""
    frames = read_video(path, _MOST_FRAMES)
    m = isqrt(len(frames))
    if m * m != len(frames) or m < 2:
        raise InputError(
            f"has {len(frames)} frames, which is not a square number of views (M x M, 4 or more)",
            where=str(path),
        )
    found = np.stack(frames).reshape(m, m, *frames[0].shape)
    if order == "columns":
        found = found.swapaxes(0, 1)
    text = f"{len(frames)} frames: {m} x {m} views of {found.shape[3]} x {found.shape[2]} pixels"
    return LightFieldSource(Picture(found, 255, SCREEN_GAMMA), (("video", text),))


def central(images: Image, count: int) -> Image:
    """Keep the central views, `count` along each side of (v, u, t, s[, 3]), without a copy."""
    there = images.shape[0]
    if not 1 <= count <= there:
        raise InputError(
            f"{count} views cannot be taken of {there}; use 1 to {there}", where="views"
        )
    first = (there - count) // 2
    return images[first : first + count, first : first + count]


def _picture(path: Path, layout: PictureLayout, size: int | None) -> LightFieldSource:
    """Views of one picture."""
    picture = read_picture(path, drop_alpha=True)
    image, where = picture.pixels, str(path)
    kind = layout
    if layout == "auto" and "eslf" in path.stem.lower():
        kind, size = "raster", size or ESLF
    if kind == "auto" or size is None:
        levels = grey(image)
        mosaic = find_mosaic(levels) if kind != "raster" else None
        is_jpeg = path.suffix.lower() in (".jpg", ".jpeg")
        raster = find_raster(levels, is_jpeg=is_jpeg) if kind != "mosaic" else None
        seen = {
            "mosaic": mosaic.rows if mosaic and mosaic.rows == mosaic.columns else None,
            "raster": raster.micro_image_size if raster else None,
        }
        fits = [name for name, m in seen.items() if m is not None and size in (None, m)]
        if len(fits) != 1:
            asked = f" of {size} x {size}" if size else ""
            option = "layout" if kind == "auto" else "micro_image"
            raise InputError(
                f"it is not clear whether {where} is a mosaic or a raster{asked}; "
                + (
                    "choose one of them, with -M"
                    if kind == "auto"
                    else "give the number of views along a side"
                ),
                where=option,
            )
        kind = "mosaic" if fits[0] == "mosaic" else "raster"
        size = size or seen[kind]
    assert size is not None
    rows, columns = image.shape[:2]
    if size > min(rows, columns):
        raise InputError(
            f"{size} is more than the picture has pixels; use at most {min(rows, columns)}",
            where="micro_image",
        )
    if kind == "raster":
        text = f"{size} x {size} pixels for each of {columns // size} x {rows // size} lenses"
        return LightFieldSource(picture.like(views(image, size)), (("raster", text),))
    if rows % size or columns % size:
        raise InputError(
            f"{columns} x {rows} pixels are no multiple of {size}, as {size} x {size} "
            "views would be",
            where=where,
        )
    tiles = image.reshape(size, rows // size, size, columns // size, *image.shape[2:])
    text = f"{size} x {size} views of {columns // size} x {rows // size} pixels"
    found = np.moveaxis(tiles, 2, 1)
    return LightFieldSource(picture.like(found), (("mosaic", text),))


def read_mat(path: Path) -> Image:
    """Read the views of a MATLAB file (version 5 to 7, or 7.3, which needs h5py).

    It has an array LF, or just one array of 4 or 5 dimensions: rows and columns of views, height,
    width, and 3 channels or 4 (the last one, a weight, is left out). uint8 and uint16 are taken as
    they are, floats from 0 to 1 as uint16.
    """
    where = str(path)
    try:
        if not path.is_file():
            raise InputError(f"no such file; {_MAT_ADVICE}", where=where)
        if path.stat().st_size > _LARGEST_MAT:
            raise InputError("is larger than 4 GiB; use a smaller light field", where=where)
        with input_file(path).open("rb") as file:
            head = file.read(1 << 10)
        if _HDF5 in head or b"MATLAB 7.3" in head:
            array = _from_hdf5(path, where)
        elif head.startswith(_MATLAB_5):
            array = _from_matlab_5(path, where)
        else:
            raise InputError(f"is not a MATLAB file; {_MAT_ADVICE}", where=where)
    except InputError:
        raise
    except MemoryError:
        raise InputError(
            "is too large for the memory; use a smaller light field", where=where
        ) from None
    except Exception as error:  # Readers raise whatever a damaged file leads them to.
        reason = " ".join(str(error).split()) or type(error).__name__
        what = f"damaged ({reason[:200]})"
        raise InputError(f"{what}; copy or export the file again", where=where) from None
    if array.ndim not in (4, 5) or array.shape[0] != array.shape[1] or 0 in array.shape:
        raise InputError(f"its array has shape {array.shape}; {_MAT_ADVICE}", where=where)
    if array.ndim == 5:
        if array.shape[4] not in (1, 3, 4):
            raise InputError(
                f"its views have {array.shape[4]} channels; they must have 1, 3 or 4", where=where
            )
        array = array[..., 0] if array.shape[4] == 1 else array[..., :3]
    if array.dtype in (np.float32, np.float64):
        low, high = float(array.min()), float(array.max())
        if not 0 <= low <= high <= 1:
            raise InputError(
                f"has values from {low:g} to {high:g}; floats must go from 0 to 1", where=where
            )
        array = np.rint(array * 65535).astype(np.uint16)
    if array.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"has values of type {array.dtype}; use uint8, uint16, or floats from 0 to 1",
            where=where,
        )
    return np.ascontiguousarray(array)


def _chosen(shapes: Mapping[str, tuple[int, ...]], where: str) -> str:
    """Name of the array that is the light field."""
    many = [name for name, shape in shapes.items() if len(shape) in (4, 5)]
    if "LF" in many:
        return "LF"
    if len(many) != 1:
        what = f"{len(many)} arrays of 4 or 5 dimensions" if many else "no array of views"
        raise InputError(f"{what}; {_MAT_ADVICE}", where=where)
    return many[0]


def _from_matlab_5(path: Path, where: str) -> npt.NDArray[Any]:
    from scipy.io import loadmat, whosmat

    shapes = {name: shape for name, shape, _ in whosmat(str(path))}
    name = _chosen(shapes, where)
    return np.asarray(loadmat(str(path), variable_names=[name])[name])


def _from_hdf5(path: Path, where: str) -> npt.NDArray[Any]:
    try:
        import h5py
    except ImportError:
        raise InputError("h5py is not installed, which reads this file; pip install h5py") from None
    with h5py.File(path, "r") as file:
        shapes = {name: part.shape for name, part in file.items() if hasattr(part, "shape")}
        # MATLAB counts the first index fastest, HDF5 the last.
        return np.asarray(file[_chosen(shapes, where)]).T


@dataclass(frozen=True, eq=False)
class HciScene:
    """Data of a scene of the HCI benchmark besides its views."""

    parameters: Mapping[str, str]  # numbers and texts of ``parameters.cfg``
    # Ground truth of the central view in pixels per view, positive for what is nearer than the
    # plane of disparity 0 (as `plenofir.camera.lightfield.Disparity` counts).
    disparity: Floats32 | None
    distance_m: Floats32 | None  # ground truth of depth

    def number(self, name: str) -> float | None:
        """One of the parameters."""
        try:
            return float(self.parameters[name])
        except (KeyError, ValueError):
            return None

    def disparity_of(self, distance_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Disparity of distances in metres, by the parameters of the camera.

        d = b f R / s (1 / Z - 1 / D), with the baseline b, focal length f, resolution R, sensor
        size s, focus distance D and the lens formula's D / (D - f).
        """
        wanted = ("baseline_mm", "focal_length_mm", "sensor_size_mm", "focus_distance_m")
        sides = ("image_resolution_x_px", "image_resolution_y_px")
        numbers = {name: self.number(name) for name in (*wanted, *sides)}
        missing = [name for name, value in numbers.items() if value is None]
        if missing:
            raise InputError(f"{missing[0]} is missing, or no number", where="parameters.cfg")
        b, f, s, focus_m, *size = (float(value or 0.0) for value in numbers.values())
        focus = 1000 * focus_m
        scale = b * f * max(size) / (s * (focus - f))
        return np.asarray(scale * (focus / (1000 * np.asarray(distance_m)) - 1))


def hci_views(folder: Path) -> list[Path]:
    """Views of the HCI benchmark, by their names."""
    return sorted(path for path in folder.iterdir() if _HCI_VIEW.fullmatch(path.name))


def read_hci(
    folder: Path, *, progress: Callable[[int, int], None] | None = None
) -> LightFieldSource:
    """Read a scene of the HCI benchmark: its views, camera and ground truth.

    The folder has ``input_Cam000.png`` and so on, line by line; other pictures are left alone.
    """
    paths = hci_views(folder)
    m = isqrt(len(paths))
    numbers = [int(path.name[9:12]) for path in paths]
    if m * m != len(paths) or numbers != list(range(m * m)):
        raise InputError(
            f"has {len(paths)} views input_CamNNN.png; there must be a square number, "
            "from 000 on without gaps",
            where=str(folder),
        )
    images = read_paths({divmod(n, m): path for n, path in enumerate(paths)}, progress=progress)
    scene = hci_scene(folder)
    lines = [("views", f"{m} x {m} of the HCI benchmark")]
    words = [
        f"{label} {scene.parameters[name]} {unit}"
        for name, label, unit in (
            ("baseline_mm", "baseline", "mm"),
            ("focal_length_mm", "focal length", "mm"),
            ("focus_distance_m", "focus at", "m"),
        )
        if name in scene.parameters
    ]
    if words:
        lines.append(("camera", ", ".join(words)))
    if scene.disparity is not None:
        low, high = np.nanmin(scene.disparity), np.nanmax(scene.disparity)
        lines.append(("true disparity", f"{low:.3f} to {high:.3f} pixels per view"))
    return LightFieldSource(images, tuple(lines))


def hci_scene(folder: Path) -> HciScene:
    """Read the data of a scene of the HCI benchmark besides its views."""
    parameters: dict[str, str] = {}
    config = folder / "parameters.cfg"
    if config.is_file():
        parser = configparser.ConfigParser(interpolation=None)
        try:
            parser.read_string(input_file(config).read_text("utf-8"))
        except (OSError, UnicodeDecodeError, configparser.Error) as error:
            reason = " ".join(str(error).split())[:120]
            raise InputError(
                f"cannot be read ({reason}); it must have sections of numbers", where=str(config)
            ) from None
        for section in parser.sections():
            parameters.update(parser[section])
    maps = []
    for name in ("gt_disp_lowres.pfm", "gt_depth_lowres.pfm"):
        file = folder / name
        maps.append(read_pfm(file) if file.is_file() else None)
    return HciScene(parameters, maps[0], maps[1])


def read_pfm(path: Path) -> Floats32:
    """Map of numbers in a .pfm file without colours, top line first, shape (rows, columns)."""
    from netpbmfile import NetpbmFile

    where = str(path)
    try:
        data = input_file(path).read_bytes()
        with NetpbmFile(io.BytesIO(data)) as file:
            image = np.asarray(file.asarray())
    except Exception as error:  # As for pictures.
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(
            f"is damaged ({reason}); it must be a whole .pfm file with one channel", where=where
        ) from None
    if image.ndim != 2 or image.dtype.kind != "f":
        raise InputError(
            f"has shape {image.shape}; it must be a .pfm file with one channel", where=where
        )
    # Its lines come from the bottom up, and netpbmfile leaves them so.
    return np.asarray(image[::-1], np.float32)
