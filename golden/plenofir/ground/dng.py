# SPDX-License-Identifier: Apache-2.0
"""Raw pictures of sensors in TIFF files: DNG, and TIFF/EP that says its colour filters.

The picture is the largest one of a sensor in all directories of the file; others are previews. Of
the DNG specification (Adobe, 1.7): LinearizationTable, ActiveArea, CFAPattern, BlackLevel,
WhiteLevel, AsShotNeutral. tifffile decodes the pixels: uncompressed, deflate, lossless and lossy
JPEG, JPEG XL.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError

_CFA, _LINEAR_RAW = 32803, 34892
_VERSION, _MAKE, _ORIENTATION = 50706, 271, 274
_PATTERN_SIZE, _PATTERN, _PLANES = 33421, 33422, 50710
_TABLE, _BLACK_SIZE, _BLACK, _WHITE = 50712, 50713, 50714, 50717
_NEUTRAL, _ACTIVE = 50728, 50829
_RATIONAL = (5, 10)


class SensorPicture(NamedTuple):
    """A sensor's picture, black subtracted."""

    pixels: npt.NDArray[np.uint16]
    full_scale: int
    mosaic: str | None  # colours of the first 2 x 2 pixels, line by line
    neutral: tuple[float, float, float] | None  # what the sensor sees of white
    orientation: int  # that the picture still needs, as EXIF counts


def _pages(pages: Any) -> list[Any]:
    """All directories of a file, those within directories too."""
    all_pages = []
    for page in pages:
        all_pages += [page, *(_pages(page.pages) if page.subifds else [])]
    return all_pages


def _numbers(page: Any, tag: int) -> list[float] | None:
    """Numbers of a tag."""
    if tag not in page.tags:
        return None
    values = [float(value) for value in np.ravel(page.tags[tag].value)]
    if page.tags[tag].dtype in _RATIONAL:
        return [above / below for above, below in zip(values[::2], values[1::2], strict=True)]
    return values


def sensor_picture(file: Any) -> SensorPicture | None:
    """The picture of a sensor in a TIFF file; None if it has none."""
    first = file.pages[0]
    is_dng = _VERSION in first.tags
    pages = [page for page in _pages(file.pages) if page.photometric in (_CFA, _LINEAR_RAW)]
    # Other makers' raws are TIFFs too: their first page is a preview, which must not pass for the
    # picture.
    if not is_dng and pages and pages[0] is not first:
        raise _other_raw(first)
    if not pages:
        return None
    # Beside the picture a DNG may hold reduced versions with the same photometry.
    page = max(pages, key=lambda one: one.imagewidth * one.imagelength)
    pixels = page.asarray()
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[..., 0]
    table = _numbers(page, _TABLE)
    if table is not None:
        pixels = np.array(table, np.uint16)[np.minimum(pixels, len(table) - 1)]
    top, left, bottom, right = map(int, _numbers(page, _ACTIVE) or (0, 0, *pixels.shape[:2]))
    pixels = pixels[top:bottom, left:right]
    mosaic = _mosaic(page) if page.photometric == _CFA else None
    white = (_numbers(page, _WHITE) or [(1 << page.bitspersample) - 1])[0]
    black = _black(page, pixels.shape)
    # Black differs by place in the mosaic; full scale is one number, above their mean.
    lowest = int(np.rint(np.mean(black)))
    if white <= lowest:
        raise InputError(f"its white level, {white:g}, is not above black, {lowest}", where="")
    levels = np.clip(np.rint(pixels - black), 0, 65535).astype(np.uint16)
    neutral = _numbers(first, _NEUTRAL) or _numbers(page, _NEUTRAL)
    is_neutral = neutral is not None and len(neutral) == 3 and min(neutral) > 0
    turned = (_numbers(page, _ORIENTATION) or _numbers(first, _ORIENTATION) or [1])[0]
    return SensorPicture(
        levels,
        int(white) - lowest,
        mosaic,
        (neutral[0], neutral[1], neutral[2]) if is_neutral and neutral is not None else None,
        int(turned),
    )


def _other_raw(page: Any) -> InputError:
    """Error of a camera's raw file of a kind of its own."""
    make = str(page.tags[_MAKE].value).strip() if _MAKE in page.tags else "a camera"
    return InputError(
        f"is a raw file of {make}; convert it to DNG (dnglab convert, Adobe DNG Converter)",
        where="",
    )


def is_canon_raw(data: bytes) -> bool:
    """Whether a TIFF file is a Canon's CR2, whose pages do not say that they are a sensor's."""
    return data[8:10] == b"CR"


def _black(page: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """Black level of each pixel, as far as they differ: shape that broadcasts to the picture."""
    values = _numbers(page, _BLACK)
    if values is None:
        return np.zeros(1)
    rows, columns = map(int, _numbers(page, _BLACK_SIZE) or (1, 1))
    samples = shape[2] if len(shape) == 3 else 1
    if len(values) != rows * columns * samples:
        raise InputError(f"has {len(values)} black levels for {rows} x {columns} pixels", where="")
    tile = np.array(values).reshape(rows, columns, *shape[2:])
    if tile.size == 1:
        return tile.reshape(1)
    times = -(-shape[0] // rows), -(-shape[1] // columns), *(1 for _ in shape[2:])
    return np.asarray(np.tile(tile, times)[: shape[0], : shape[1]])


def _mosaic(page: Any) -> str:
    """Colours of the first 2 x 2 pixels."""
    size = _numbers(page, _PATTERN_SIZE) or [2, 2]
    pattern = page.tags[_PATTERN].value if _PATTERN in page.tags else None
    if pattern is None:
        raise InputError("does not say its colour filters (CFAPattern)", where="")
    planes = _numbers(page, _PLANES) or [0, 1, 2]
    plane = np.frombuffer(bytes(pattern), np.uint8)
    colours = "".join("rgb"[int(p)] if p in planes[:3] and p < 3 else "?" for p in plane)
    if size != [2, 2] or sorted(colours) != ["b", "g", "g", "r"] or colours[0] == colours[1]:
        raise InputError(
            f"has colour filters in {size[0]:g} x {size[1]:g} pixels ({colours}); only Bayer's "
            "2 x 2 (RGGB, BGGR, GRBG, GBRG) are read",
            where="",
        )
    return colours
