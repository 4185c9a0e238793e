# SPDX-License-Identifier: Apache-2.0
"""Reading and writing images without losing depth; damaged files are refused.

Each format is read by the library that reports its errors best: PNG by libpng (imagecodecs), TIFF
by tifffile, PNM by netpbmfile, JPEG and BMP by Pillow. JPEG, PNM and BMP, and TIFF without
compression or with LZW or PackBits, have no checksum: there a wrong length is found, a flipped bit
may not be.
"""

import io
import logging
import zlib
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file, write_file

# What they say of a file that they read is not printed.
for _library in ("imagecodecs", "netpbmfile", "tifffile"):
    logging.getLogger(_library).addHandler(logging.NullHandler())

Image = npt.NDArray[np.integer]
"""Shape (rows, columns[, channels])."""

_EXPECTED = "an 8 to 16 bit grey or RGB image file (PNG, TIFF, PGM/PPM, BMP or JPEG)"
_WHOLE = "a whole file: copy or convert it again"
_JPEG_QUALITY = 92
_PNG = b"\x89PNG\r\n\x1a\n"


class Picture(NamedTuple):
    """An image as its file has it.

    `pixels`: shape (rows, columns) or (rows, columns, 3), uint8 or uint16. `full_scale`: value of
    white that the file tells: 4095 of a camera's 12 bit capture in words of 16. That of a PNG is
    always 255 or 65535; its samples are scaled to that by definition.
    """

    pixels: Image
    full_scale: int


class _DamagedError(ValueError):
    """A file that is not whole."""


def _png(data: bytes) -> tuple[Any, int]:
    from imagecodecs import png_decode

    place, kind = len(_PNG), b""
    while kind != b"IEND":
        head = data[place : place + 8]
        length, kind = int.from_bytes(head[:4], "big"), head[4:]
        body = data[place + 8 : place + 8 + length]
        checksum = data[place + 8 + length : place + 12 + length]
        if len(head) < 8 or len(body) < length or len(checksum) < 4:
            raise _DamagedError("it ends in the middle")
        if int.from_bytes(checksum, "big") != zlib.crc32(kind + body):
            raise _DamagedError(f"wrong checksum at byte {place}")
        place += 12 + length
    return png_decode(data), 0


def _tiff(data: bytes) -> tuple[Any, int]:
    from imagecodecs import lzw_decode
    from tifffile import COMPRESSION, PHOTOMETRIC, TiffFile

    with TiffFile(io.BytesIO(data)) as file:
        page: Any = file.pages[0]
        if len(file.pages) > 1:
            raise InputError(f"{len(file.pages)} pages", where="", expected="one image")
        if page.photometric == PHOTOMETRIC.PALETTE:
            raise InputError("colours from a palette", where="", expected=_EXPECTED)
        if page.compression == COMPRESSION.LZW:
            row = -(-page.imagewidth * page.samplesperpixel * page.bitspersample // 8)
            for number, (offset, count) in enumerate(
                zip(page.dataoffsets, page.databytecounts, strict=True)
            ):
                if page.is_tiled or page.planarconfig != 1:
                    break
                rows = min(page.rowsperstrip, page.imagelength - number * page.rowsperstrip)
                if len(lzw_decode(data[offset : offset + count])) != rows * row:
                    raise _DamagedError(f"strip {number} has a wrong length")
        image = page.asarray()
        if image.ndim == 3 and page.planarconfig != 1:
            image = np.moveaxis(image, 0, -1)
        if page.photometric == PHOTOMETRIC.MINISWHITE:
            image = (1 << page.bitspersample) - 1 - image
        return image, (1 << page.bitspersample) - 1


def _netpbm(data: bytes) -> tuple[Any, int]:
    from netpbmfile import NetpbmFile

    with NetpbmFile(io.BytesIO(data)) as file:
        image, largest = file.asarray(), int(file.maxval)
    if image.max() > largest:
        raise _DamagedError(f"a pixel of {image.max()}, the largest value is {largest}")
    return image, largest


def _pillow(plugin: str, data: bytes) -> tuple[Any, int]:
    # Not PIL.Image.open, which takes more than 179 million pixels for an attack.
    with getattr(import_module(f"PIL.{plugin}Plugin"), f"{plugin}File")(io.BytesIO(data)) as image:
        image.load()
        if image.mode not in ("L", "RGB"):
            raise InputError(f"pixels of mode {image.mode}", where="", expected=_EXPECTED)
        return np.asarray(image), 255


_READERS: tuple[tuple[bytes, Callable[[bytes], tuple[Any, int]]], ...] = (
    (_PNG, _png),
    (b"II*\0", _tiff),
    (b"MM\0*", _tiff),
    (b"II+\0", _tiff),
    (b"MM\0+", _tiff),
    (b"\xff\xd8\xff", partial(_pillow, "JpegImage")),
    (b"BM", partial(_pillow, "BmpImage")),
    *((b"P%d" % kind, _netpbm) for kind in (2, 3, 5, 6)),
)


def read_picture(path: Path, *, drop_alpha: bool = False) -> Picture:
    """Read an image as it is stored, and what it counts as white.

    `drop_alpha`: leave out a fourth channel instead of refusing it. Raises `InputError` if the file
    cannot be read, is damaged, holds several images, or its depth or number of channels is not
    supported.
    """
    where = str(path)
    try:
        if path.is_char_device():  # It may have no end.
            raise InputError("is a device", where=where, expected=_EXPECTED)
        data = input_file(path).read_bytes()
    except FileNotFoundError:
        raise InputError("no such file", where=where, expected=_EXPECTED) from None
    except IsADirectoryError:
        raise InputError("is a folder", where=where, expected=_EXPECTED) from None
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot be read ({reason})", where=where, expected=_EXPECTED) from None
    read = next((read for magic, read in _READERS if data.startswith(magic)), None)
    if read is None:
        what = "an empty file" if not data else "no image of a known kind"
        raise InputError(what, where=where, expected=_EXPECTED)
    try:
        image, full_scale = read(data)
    except InputError as error:
        raise InputError(error.what, where=where, expected=error.expected) from None
    except MemoryError:
        raise InputError(
            "too large for the memory", where=where, expected="a smaller image"
        ) from None
    except Exception as error:  # Decoders raise whatever a damaged file leads them to.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"damaged ({reason})", where=where, expected=_WHOLE) from None
    if image.dtype.newbyteorder("=") not in (np.uint8, np.uint16) or 0 < full_scale < 128:
        few = 0 < full_scale < 128
        what = (
            f"pixels of {full_scale.bit_length()} bit" if few else f"pixels of type {image.dtype}"
        )
        raise InputError(what, where=where, expected=_EXPECTED)
    if drop_alpha and image.ndim == 3 and image.shape[2] == 4:
        image = image[:, :, :3]
    image = np.ascontiguousarray(image, dtype=image.dtype.newbyteorder("="))
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    if image.ndim == 3 and image.shape[2] != 3:
        raise InputError(f"{image.shape[2]} channels", where=where, expected=_EXPECTED)
    if image.ndim not in (2, 3):
        raise InputError(f"{image.ndim} dimensions", where=where, expected=_EXPECTED)
    return Picture(image, full_scale or np.iinfo(image.dtype).max)


def read_image(path: Path) -> Image:
    """Pixels of `read_picture`."""
    return read_picture(path).pixels


def encode_png(image: Image) -> bytes:
    """PNG with the depth and channels of the array."""
    from imagecodecs import png_encode

    with_channels = image.reshape(*image.shape[:2], -1)
    return bytes(png_encode(np.ascontiguousarray(with_channels), level=1))


def encode_tiff(image: Image, full_scale: int) -> bytes:
    """TIFF with the bits that this full scale needs, which a PNG cannot tell."""
    from tifffile import imwrite

    file = io.BytesIO()
    kind = "rgb" if image.ndim == 3 else "minisblack"
    bits = full_scale.bit_length()
    imwrite(file, np.ascontiguousarray(image), photometric=kind, bitspersample=bits, metadata=None)
    return file.getvalue()


def encode_picture(suffix: str, image: Image) -> bytes:
    """A file of the kind that its ending says: PNG, TIFF, or JPEG, whose 16 bit become 8."""
    if suffix.lower() in (".tif", ".tiff"):
        return encode_tiff(image, int(np.iinfo(image.dtype).max))
    if suffix.lower() not in (".jpg", ".jpeg"):
        return encode_png(image)
    from imagecodecs import jpeg8_encode

    eight = (image >> 8).astype(np.uint8) if image.dtype == np.uint16 else image
    return bytes(jpeg8_encode(np.ascontiguousarray(eight), level=_JPEG_QUALITY))


def write_png(path: Path, image: Image) -> None:
    """Write a PNG with the depth and channels of the array, in one step."""
    write_file(path, encode_png(image))
