# SPDX-License-Identifier: Apache-2.0
"""Reading and writing images without losing depth; damaged files are refused.

Each format is read by the library that reports its errors best: PNG by libpng (imagecodecs), TIFF
by tifffile, PNM by netpbmfile, JPEG and BMP by Pillow. JPEG, PNM and BMP, and TIFF without
compression or with LZW or PackBits, have no checksum: a wrong length is detected, a flipped bit may
not be.

The meaning of the values is stored with them. White below the type's largest value: in a TIFF its
bits or the tag WhiteLevel (50717, as in DNG), in a PNG a text chunk of this project, "White level".
Gamma: in a PNG gAMA and sRGB, in a TIFF the tag Gamma (42240, as in EXIF). ICC profiles: where the
format has them.
"""

import io
import logging
import struct
import zlib
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.dng import is_canon_raw, sensor_picture
from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.ground.files import input_file, write_file
from plenofir.ground.levels import levels
from plenofir.ground.orientation import TAG_ORIENTATION, exif_orientation, page_orientation, turned
from plenofir.ground.png import SIGNATURE as PNG_SIGNATURE
from plenofir.ground.png import png_chunk, png_file

# Log messages of these libraries about files are not printed.
for _library in ("imagecodecs", "netpbmfile", "tifffile"):
    logging.getLogger(_library).addHandler(logging.NullHandler())

Image = npt.NDArray[np.integer]
"""Shape (rows, columns[, channels])."""

_ADVICE = "use an 8 to 16 bit grey or RGB image (PNG, TIFF, PGM/PPM, BMP or JPEG)"
_JPEG_QUALITY = 92
_WHITE_LEVEL = b"White level"
# A profile is deflated in a PNG: a few bytes of it may unpack to gigabytes.
_LARGEST_PROFILE = 1 << 24
_TAG_WHITE_LEVEL, _TAG_PROFILE, _TAG_GAMMA, _TAG_XMP = 50717, 34675, 42240, 700
_NUMBER_OF_IMAGES = 0xB001  # of the index of a multi-picture file
# What a Raspberry Pi's raspistill -r writes behind a JPEG.
_BROADCOM = b"BRCMo"
_RAW_BEHIND = (
    "the sensor's data behind the JPEG are left out; write them as DNG (rpicam-still --raw)"
)
# Approximate gamma of screens, sRGB and JPEG.
SCREEN_GAMMA = 2.2


class Picture(NamedTuple):
    """An image as stored in its file, with the meaning of its values.

    `pixels`: shape (rows, columns) or (rows, columns, 3), uint8 or uint16. `full_scale`: value of
    white, 4095 for a camera's 12 bit capture in words of 16. `gamma`: light is value^gamma; 1 for a
    camera's linear data, 2.2 for pictures made for screens, None if the file does not tell.
    `profile`: ICC profile of the colours. `xmp`: packet of other metadata, only written.
    `orientation`: how the picture is to be turned to be looked at, as of EXIF (`upright`). `alpha`:
    whether a transparency that is not opaque everywhere was left out. `notes`: what else of the
    file was left out, for people. `is_jpeg`: whether it was compressed in blocks of 8 x 8 pixels.
    Of a sensor's picture (DNG), whose black is subtracted: `mosaic`, colours of the first 2 x 2
    pixels ("rggb"); `neutral`, what the sensor sees of white.
    """

    pixels: Image
    full_scale: int
    gamma: float | None = None
    profile: bytes | None = None
    xmp: bytes | None = None
    orientation: int = 1
    alpha: bool = False
    notes: tuple[str, ...] = ()
    is_jpeg: bool = False
    mosaic: str | None = None
    neutral: tuple[float, float, float] | None = None

    def like(self, pixels: Image) -> "Picture":
        """Other pixels with the same meaning; values raised above white by sharpening are cut."""
        if self.full_scale < np.iinfo(pixels.dtype).max:
            # A file may already have values above its white.
            white = max(self.full_scale, int(self.pixels.max()))
            pixels = np.minimum(pixels, min(white, np.iinfo(pixels.dtype).max))
        return self._replace(pixels=pixels)


def bare(pixels: Image) -> Picture:
    """An image without metadata: white is the largest value of its type."""
    return Picture(pixels, int(np.iinfo(pixels.dtype).max))


def upright(picture: Picture) -> Picture:
    """A picture turned as its orientation says, with the mosaic of its first pixels then."""
    if picture.orientation == 1:
        return picture
    mosaic = picture.mosaic
    if mosaic is not None:
        # The last two rows and columns become the first, so sides of odd lengths count.
        sides = tuple(2 + length % 2 for length in picture.pixels.shape[:2])
        tile = np.tile(np.array(list(mosaic)).reshape(2, 2), (2, 2))[: sides[0], : sides[1]]
        mosaic = "".join(turned(tile, picture.orientation)[:2, :2].ravel())
    pixels = np.ascontiguousarray(turned(picture.pixels, picture.orientation))
    return picture._replace(pixels=pixels, orientation=1, mosaic=mosaic)


class _DamagedError(ValueError):
    """A damaged or incomplete file."""


def _png(data: bytes) -> Picture:
    from imagecodecs import png_decode

    place, kind = len(PNG_SIGNATURE), b""
    full_scale, gamma, profile, orientation, frames = 0, None, None, 1, 1
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
        if kind == b"gAMA" and any(body):
            gamma = 1e5 / int.from_bytes(body, "big")
        elif kind == b"sRGB":
            gamma = SCREEN_GAMMA
        elif kind == b"iCCP":
            # After its name and the kind of compression.
            packed = body.partition(b"\0")[2][1:]
            profile = zlib.decompressobj().decompress(packed, _LARGEST_PROFILE)
        elif kind == b"eXIf":
            orientation = exif_orientation(body)
        elif kind == b"acTL":
            frames = int.from_bytes(body[:4], "big")
        elif kind == b"tEXt" and body.startswith(_WHITE_LEVEL + b"\0"):
            full_scale = int(body[len(_WHITE_LEVEL) + 1 :])
    return Picture(
        png_decode(data),
        full_scale,
        gamma,
        profile,
        orientation=orientation,
        notes=_first_of(frames, "frames of the animation (APNG)"),
    )


def page_pixels(page: Any, where: str = "") -> Image:
    """Pixels of a page of a TIFF file (tifffile's), grey or RGB, black at 0.

    Raises `InputError` for colours of other kinds, which are no levels of red, green and blue.
    """
    from tifffile import COMPRESSION, PHOTOMETRIC

    kind = page.photometric
    if kind == PHOTOMETRIC.PALETTE:
        raise InputError(f"takes its colours from a palette; {_ADVICE}", where=where)
    # Luminance and colour differences of a JPEG become RGB with its decoding.
    decoded = kind == PHOTOMETRIC.YCBCR and page.compression == COMPRESSION.JPEG
    levels_of_light = {
        PHOTOMETRIC.MINISWHITE,
        PHOTOMETRIC.MINISBLACK,
        PHOTOMETRIC.RGB,
        PHOTOMETRIC.CFA,
        PHOTOMETRIC.LINEAR_RAW,
    }
    if kind not in levels_of_light and not decoded:
        raise InputError(f"has colours of the kind {kind.name}; {_ADVICE}", where=where)
    pixels = page.asarray()
    if kind == PHOTOMETRIC.MINISWHITE:
        pixels = (1 << page.bitspersample) - 1 - pixels
    return np.asarray(pixels)


def _tiff(data: bytes) -> Picture:
    from imagecodecs import lzw_decode
    from tifffile import COMPRESSION, TiffFile

    if is_canon_raw(data):
        raise InputError(
            "is a raw file of a Canon; convert it to DNG (dnglab convert, Adobe DNG Converter)",
            where="",
        )
    with TiffFile(io.BytesIO(data)) as file:
        sensor = sensor_picture(file)
        if sensor is not None:
            return Picture(
                sensor.pixels,
                sensor.full_scale,
                1.0,
                orientation=sensor.orientation,
                mosaic=sensor.mosaic,
                neutral=sensor.neutral,
            )
        page: Any = file.pages[0]
        # Which page is meant cannot be known: the first of a stack would be a silent choice.
        if len(file.pages) > 1:
            raise InputError(f"has {len(file.pages)} pages; one image is needed", where="")
        # The decoder fills up a strip that ends early without a word; a cut file would read as
        # black.
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
        image = page_pixels(page)
        if image.ndim == 3 and page.planarconfig != 1:
            image = np.moveaxis(image, 0, -1)

        def tag_value(tag: int) -> Any:
            return page.tags[tag].value if tag in page.tags else None

        full_scale = int(np.max(tag_value(_TAG_WHITE_LEVEL) or (1 << page.bitspersample) - 1))
        above, below = tag_value(_TAG_GAMMA) or (0, 0)
        gamma = above / below if below else None
        return Picture(
            image,
            full_scale,
            gamma,
            tag_value(_TAG_PROFILE),
            orientation=page_orientation(page),
            is_jpeg=page.compression == COMPRESSION.JPEG,
            notes=("of a pyramid of sizes the largest is taken",) if page.subifds else (),
        )


def _netpbm(data: bytes) -> Picture:
    from netpbmfile import NetpbmFile

    with NetpbmFile(io.BytesIO(data)) as file:
        image, largest = file.asarray(), int(file.maxval)
        if file.axes.startswith("I"):
            raise InputError(f"has {len(image)} pictures; one image is needed", where="")
    if image.max() > largest:
        raise _DamagedError(f"a pixel of {image.max()}, the largest value is {largest}")
    return Picture(image, largest)


def _pillow(plugin: str, data: bytes, gamma: float | None = None) -> Picture:
    # Not PIL.Image.open, which refuses more than 179 million pixels as an attack.
    with getattr(import_module(f"PIL.{plugin}Plugin"), f"{plugin}File")(io.BytesIO(data)) as image:
        image.load()
        if image.mode not in ("L", "RGB"):
            raise InputError(f"has pixels of mode {image.mode}; {_ADVICE}", where="")
        return Picture(
            np.asarray(image),
            255,
            gamma,
            image.info.get("icc_profile"),
            orientation=exif_orientation(image.info.get("exif", b"")),
            notes=(
                *_first_of(_pictures_of_mpo(image), "pictures in the JPEG (MPO)"),
                *((_RAW_BEHIND,) if _BROADCOM in data else ()),
            ),
            is_jpeg=plugin == "JpegImage",
        )


def _pictures_of_mpo(image: Any) -> int:
    """Number of pictures in a JPEG file, by its multi-picture format (CIPA DC-007)."""
    try:
        index = image._getmp() if "mpoffset" in image.info else None
        return int(index[_NUMBER_OF_IMAGES]) if index else 1
    except (SyntaxError, ValueError, KeyError, TypeError, OSError, struct.error):
        return 2  # A damaged index is one of several pictures, too.


def _first_of(count: int, name: str) -> tuple[str, ...]:
    """Note on a file with several pictures."""
    return (f"of {count} {name} the first is taken",) if count > 1 else ()


_READERS: tuple[tuple[bytes, Callable[[bytes], Picture]], ...] = (
    (PNG_SIGNATURE, _png),
    (b"II*\0", _tiff),
    (b"MM\0*", _tiff),
    (b"II+\0", _tiff),
    (b"MM\0+", _tiff),
    (b"\xff\xd8\xff", partial(_pillow, "JpegImage", gamma=SCREEN_GAMMA)),
    (b"BM", partial(_pillow, "BmpImage")),
    *((b"P%d" % kind, _netpbm) for kind in (2, 3, 5, 6)),
)


def read_picture(path: str | Path, *, drop_alpha: bool = False, as_stored: bool = False) -> Picture:
    """Read an image, upright, with the meaning of its values.

    `as_stored`: in the sensor's own rows and columns, its orientation untouched, as calibrations
    have them. An alpha channel is left out if it is opaque; `drop_alpha`: another one too, instead
    of refusing it. Raises `InputError` if the file cannot be read, is damaged, holds several
    images, or its depth or number of channels is not supported.
    """
    where = str(path)
    picture = _decoded(_content(Path(path)), where)
    image, full_scale = picture.pixels, picture.full_scale
    # Files of 1 or 4 bit are decoded to bytes: as pictures of 8 bit they would be black.
    if 0 < full_scale < 128:
        raise InputError(f"pixels of {full_scale.bit_length()} bit; {_ADVICE}", where=where)
    if image.dtype.newbyteorder("=") not in (np.uint8, np.uint16):
        image, full_scale = _counted(image, where)
    alpha = False
    if image.ndim == 3 and image.shape[2] in (2, 4):
        # Editors add an opaque alpha unasked; one that hides pixels means something that is lost
        # here.
        alpha = bool((image[:, :, -1] < (full_scale or np.iinfo(image.dtype).max)).any())
        if alpha and not drop_alpha:
            raise InputError(
                "has an alpha channel that is not opaque; save it without transparency",
                where=where,
            )
        image = image[:, :, :-1]
    # Compiled loops take the machine's byte order alone; a TIFF may bring the other.
    image = np.ascontiguousarray(image, dtype=image.dtype.newbyteorder("="))
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    if image.ndim == 3 and image.shape[2] != 3:
        raise InputError(f"has {image.shape[2]} channels; {_ADVICE}", where=where)
    if image.ndim not in (2, 3):
        raise InputError(f"has {image.ndim} dimensions; {_ADVICE}", where=where)
    most = int(np.iinfo(image.dtype).max)
    # A tag that contradicts the pixels would make each picture darker than it is.
    if full_scale > most:
        raise InputError(
            f"counts {full_scale} as white, but its pixels hold at most {most}", where=where
        )
    picture = picture._replace(
        pixels=image,
        full_scale=full_scale or most,
        alpha=alpha,
        orientation=picture.orientation if picture.orientation in range(1, 9) else 1,
    )
    return picture if as_stored else upright(picture)


def _content(path: Path) -> bytes:
    """The bytes of a file; InputError if it cannot be read."""
    where = str(path)
    try:
        if path.is_char_device():  # a device may have no end
            raise InputError(f"is a device; {_ADVICE}", where=where)
        return input_file(path).read_bytes()
    except FileNotFoundError:
        raise InputError(f"no such file; {_ADVICE}", where=where) from None
    except IsADirectoryError:
        raise InputError(f"is a folder; {_ADVICE}", where=where) from None
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot be read ({reason}); {_ADVICE}", where=where) from None


def _decoded(data: bytes, where: str) -> Picture:
    """The picture of a file, as stored; InputError if it is none, or damaged."""
    read = next((read for magic, read in _READERS if data.startswith(magic)), None)
    if read is None:
        content = "an empty file" if not data else "no image of a known kind"
        raise InputError(f"{content}; {_ADVICE}", where=where)
    try:
        return read(data)
    except InputError as error:
        raise InputError(error.problem, where=where) from None
    except MemoryError:
        raise InputError("is too large for the memory; use a smaller image", where=where) from None
    except ModuleNotFoundError as error:
        raise InputError(missing(error.name or "").problem, where=where) from None
    except Exception as error:  # Decoders raise whatever a damaged file leads them to.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"is damaged ({reason}); copy or convert the file again", where=where
        ) from None


def _counted(image: npt.NDArray[Any], where: str) -> tuple[Image, int]:
    """Floats and wide integers as 8 or 16 bit with their white, where their meaning is certain."""
    values, white, notes = levels(image, where)
    if notes:
        raise InputError(f"{notes[0]}; {_ADVICE}", where=where)
    return values, white


def read_image(path: str | Path, *, as_stored: bool = False) -> Image:
    """Pixels of `read_picture`."""
    return read_picture(path, as_stored=as_stored).pixels


def eight_bits(image: Image, full_scale: int | None = None) -> Image:
    """Values of 8 bit for those of an image, white at `full_scale` (of the type); halves up."""
    full_scale = full_scale or int(np.iinfo(image.dtype).max)
    if image.dtype == np.uint8 and full_scale == 255:
        return image
    levels = (np.arange(np.iinfo(image.dtype).max + 1) * 255 + full_scale // 2) // full_scale
    return np.asarray(np.minimum(levels, 255).astype(np.uint8)[image])


def _chunks(picture: Picture) -> bytes:
    """A PNG's chunks about the meaning of its values."""
    chunks = []
    if picture.profile is not None:
        content = b"ICC profile\0\0" + zlib.compress(picture.profile)
        chunks.append(png_chunk(b"iCCP", content))
    if picture.gamma is not None:
        chunks.append(png_chunk(b"gAMA", round(1e5 / picture.gamma).to_bytes(4, "big")))
    if picture.full_scale != np.iinfo(picture.pixels.dtype).max:
        chunks.append(png_chunk(b"tEXt", _WHITE_LEVEL + b"\0%d" % picture.full_scale))
    if picture.orientation != 1:
        # A TIFF header, and a directory of one tag.
        short = struct.pack("<HHIHHI", TAG_ORIENTATION, 3, 1, picture.orientation, 0, 0)
        chunks.append(png_chunk(b"eXIf", b"II*\0\x08\0\0\0\x01\0" + short))
    if picture.xmp is not None:
        # Neither compressed nor translated.
        chunks.append(png_chunk(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + picture.xmp))
    return b"".join(chunks)


def encode_png(image: Image | Picture) -> bytes:
    """PNG with the depth and channels of the array, and the meaning of its values."""
    picture = image if isinstance(image, Picture) else bare(image)
    return png_file(picture.pixels, _chunks(picture))


def encode_tiff(picture: Picture) -> bytes:
    """TIFF with the bits that its white needs, and the meaning of its values."""
    from tifffile import imwrite

    file = io.BytesIO()
    image, full_scale = np.ascontiguousarray(picture.pixels), picture.full_scale
    bits = full_scale.bit_length()
    if image.max(initial=0) >> bits:  # Above white, by sharpening.
        bits = 8 * image.dtype.itemsize
    tags: list[tuple[int, int, int, Any, bool]] = []
    if full_scale != (1 << bits) - 1:
        tags.append((_TAG_WHITE_LEVEL, 4, 1, full_scale, True))
    if picture.gamma is not None:
        tags.append((_TAG_GAMMA, 5, 1, (round(1e4 * picture.gamma), 10000), True))
    if picture.xmp is not None:
        tags.append((_TAG_XMP, 1, len(picture.xmp), picture.xmp, True))
    imwrite(
        file,
        image,
        photometric="rgb" if image.ndim == 3 else "minisblack",
        bitspersample=bits,
        metadata=None,
        iccprofile=picture.profile,
        extratags=tags,
    )
    return file.getvalue()


def encode_picture(suffix: str, image: Image | Picture) -> bytes:
    """An image file by its suffix: PNG, TIFF, or JPEG, for which 16 bits become 8."""
    picture = image if isinstance(image, Picture) else bare(image)
    if suffix.lower() in (".tif", ".tiff"):
        return encode_tiff(picture)
    if suffix.lower() not in (".jpg", ".jpeg"):
        return encode_png(picture)
    from PIL import Image as Pillow

    file, eight = io.BytesIO(), eight_bits(picture.pixels, picture.full_scale)
    metadata: dict[str, Any] = {} if picture.xmp is None else {"xmp": picture.xmp}
    Pillow.fromarray(eight).save(
        file, "JPEG", quality=_JPEG_QUALITY, icc_profile=picture.profile, subsampling=0, **metadata
    )
    return file.getvalue()


def write_png(path: str | Path, image: Image | Picture) -> None:
    """Write a PNG with the depth and channels of the array, in one step."""
    write_file(Path(path), encode_png(image))
