# SPDX-License-Identifier: Apache-2.0
"""DNG as cameras and converters write it, byte by byte from the specification's tags."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tifffile import TiffWriter, imwrite

from plenofir.ground.errors import InputError
from plenofir.ground.images import read_picture

CFA, LINEAR_RAW = 32803, 34892
VERSION = (50706, 1, 4, (1, 4, 0, 0), True)
SENSOR = np.random.default_rng(20_261_127).integers(64, 1023, (24, 32)).astype(np.uint16)


def cfa(pattern: str = "rggb", *tags: tuple[int, int, int, Any, bool]) -> list[Any]:
    return [
        (33421, 3, 2, (2, 2), True),
        (33422, 1, 4, tuple("rgb".index(one) for one in pattern), True),
        *tags,
    ]


def written(tmp_path: Path, pixels: np.ndarray, tags: list[Any], **how: Any) -> Path:
    path = tmp_path / "x.dng"
    imwrite(path, pixels, **{"photometric": CFA, "metadata": None, "extratags": tags} | how)
    return path


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "grbg", "gbrg"])
def test_levels_and_colours(tmp_path: Path, pattern: str) -> None:
    tags = [
        VERSION,
        *cfa(pattern, (50714, 4, 1, 64, True), (50717, 4, 1, 1023, True)),
        (50728, 5, 3, (55, 100, 1, 1, 7, 10), True),
    ]
    picture = read_picture(written(tmp_path, SENSOR, tags))
    assert (picture.pixels == SENSOR - 64).all()
    assert picture.full_scale == 959
    assert picture.mosaic == pattern
    assert picture.neutral == (0.55, 1.0, 0.7)
    assert picture.gamma == 1.0


def test_black_of_each_colour_within_the_active_area(tmp_path: Path) -> None:
    tags = [
        VERSION,
        *cfa(
            "grbg", (50713, 3, 2, (2, 2), True), (50714, 5, 4, (60, 1, 61, 1, 124, 2, 63, 1), True)
        ),
        (50717, 3, 1, 1023, True),
        (50829, 4, 4, (3, 5, 23, 31), True),
    ]
    picture = read_picture(written(tmp_path, SENSOR, tags))
    levels = np.tile([[60, 61], [62, 63]], (10, 13))
    assert (picture.pixels == SENSOR[3:23, 5:31] - levels).all()
    assert picture.full_scale == 1023 - 62
    assert picture.mosaic == "grbg"


def test_the_largest_sensor_picture_of_all_directories(tmp_path: Path) -> None:
    """As converters write it: a preview in front, the sensor's picture and a small one behind."""
    path = tmp_path / "x.dng"
    preview = np.full((8, 10, 3), 200, np.uint8)
    with TiffWriter(path) as file:
        tags = [VERSION, (274, 3, 1, 6, True)]
        file.write(preview, photometric="rgb", subifds=2, metadata=None, extratags=tags)
        small = [*cfa(), (50717, 3, 1, 4095, True)]
        file.write(SENSOR[:8, :8].copy(), photometric=CFA, metadata=None, extratags=small)
        file.write(SENSOR, photometric=CFA, metadata=None, extratags=small)
    picture = read_picture(path, as_stored=True)
    assert (picture.pixels == SENSOR).all()
    assert (picture.mosaic, picture.full_scale, picture.orientation) == ("rggb", 4095, 6)
    picture = read_picture(path)
    assert (picture.pixels == np.rot90(SENSOR, -1)).all()
    # The colours of an even number of rows, the lower left pixel first: g r over b g.
    assert (picture.mosaic, picture.orientation) == ("grbg", 1)


@pytest.mark.parametrize("how", ["adobe_deflate", "packed", "ljpeg", "tiles"])
def test_compressions(tmp_path: Path, how: str) -> None:
    tags = [VERSION, *cfa(), (50717, 3, 1, 4095, True)]
    if how == "packed":
        # 12 bits, high ones first, as the specification has it.
        path = tmp_path / "x.dng"
        path.write_bytes(_packed(SENSOR, 12))
    elif how == "ljpeg":
        path = tmp_path / "x.dng"
        path.write_bytes(_lossless(SENSOR))
    elif how == "tiles":
        path = written(tmp_path, SENSOR, tags, tile=(16, 16))
    else:
        path = written(tmp_path, SENSOR, tags, compression=how)
    picture = read_picture(path)
    assert (picture.pixels == SENSOR).all()
    assert picture.full_scale == 4095


def _directory(entries: list[tuple[int, int, int, bytes]], data: bytes) -> bytes:
    """A little-endian TIFF of one directory; values of more than 4 bytes and data behind it."""
    start = 8 + 2 + 12 * len(entries) + 4
    body, extra = b"", b""
    place = start + sum(len(value) for *_, value in entries if len(value) > 4)
    for tag, kind, count, value in sorted(entries):
        if value == b"DATA":
            value = place.to_bytes(4, "little")
        if len(value) > 4:
            offset = (start + len(extra)).to_bytes(4, "little")
            extra, value = extra + value, offset
        body += tag.to_bytes(2, "little") + kind.to_bytes(2, "little")
        body += count.to_bytes(4, "little") + value.ljust(4, b"\0")
    head = b"II*\0" + (8).to_bytes(4, "little") + len(entries).to_bytes(2, "little")
    return head + body + bytes(4) + extra + data


def _entries(pixels: np.ndarray, bits: int, compression: int, data: bytes) -> list[Any]:
    def short(*values: int) -> bytes:
        return b"".join(value.to_bytes(2, "little") for value in values)

    rows, columns = pixels.shape
    return [
        (256, 3, 1, short(columns)),
        (257, 3, 1, short(rows)),
        (258, 3, 1, short(bits)),
        (259, 3, 1, short(compression)),
        (262, 3, 1, short(CFA)),
        (273, 4, 1, b"DATA"),
        (277, 3, 1, short(1)),
        (278, 3, 1, short(rows)),
        (279, 4, 1, len(data).to_bytes(4, "little")),
        (33421, 3, 2, short(2, 2)),
        (33422, 1, 4, bytes((0, 1, 1, 2))),
        (50706, 1, 4, bytes((1, 4, 0, 0))),
        (50717, 3, 1, short(4095)),
    ]


def _packed(pixels: np.ndarray, bits: int) -> bytes:
    lines = [
        int("".join(f"{value:0{bits}b}" for value in line), 2).to_bytes(
            len(line) * bits // 8, "big"
        )
        for line in pixels.tolist()
    ]
    data = b"".join(lines)
    return _directory(_entries(pixels, bits, 1, data), data)


def _lossless(pixels: np.ndarray) -> bytes:
    """Lossless JPEG of two components, a line's even and odd pixels, as converters write it.

    ITU-T T.81: predictor 1; one Huffman table, in which all 13 categories have codes of 4 bits.
    """
    rows, columns = pixels.shape
    values = pixels.reshape(rows, columns // 2, 2).astype(int)
    text = ""
    for row in range(rows):
        for column in range(columns // 2):
            for part in range(2):
                if column:
                    near = values[row, column - 1, part]
                else:
                    near = values[row - 1, 0, part] if row else 1 << 11
                step = int(values[row, column, part] - near)
                size = abs(step).bit_length()
                text += f"{size:04b}"
                if size:
                    text += f"{step if step > 0 else step + (1 << size) - 1:0{size}b}"
    text += "1" * (-len(text) % 8)
    coded = int(text, 2).to_bytes(len(text) // 8, "big").replace(b"\xff", b"\xff\0")

    def segment(marker: int, *content: int) -> bytes:
        return bytes((0xFF, marker)) + (len(content) + 2).to_bytes(2, "big") + bytes(content)

    half = columns // 2
    frame = (12, *divmod(rows, 256), *divmod(half, 256), 2, 0, 0x11, 0, 1, 0x11, 0)
    table = (0, *(13 if length == 4 else 0 for length in range(1, 17)), *range(13))
    scan = (2, 0, 0, 1, 0, 1, 0, 0)
    data = b"\xff\xd8" + segment(0xC3, *frame) + segment(0xC4, *table) + segment(0xDA, *scan)
    data += coded + b"\xff\xd9"
    return _directory(_entries(pixels, 16, 7, data), data)


def test_linear_raw(tmp_path: Path) -> None:
    """Of phones: colours interpolated, black and white of each."""
    pixels = np.stack([SENSOR, SENSOR + 1, SENSOR + 2], axis=-1)
    tags = [VERSION, (50714, 4, 3, (10, 11, 12), True), (50717, 4, 3, (1023,) * 3, True)]
    picture = read_picture(written(tmp_path, pixels, tags, photometric=LINEAR_RAW))
    assert (picture.pixels == SENSOR[..., None] - 10).all()
    assert (picture.mosaic, picture.full_scale) == (None, 1012)


def test_eight_bits_by_a_table(tmp_path: Path) -> None:
    table = tuple(min(n * n, 65535) for n in range(256))
    pixels = (SENSOR >> 2).astype(np.uint8)
    tags = [VERSION, *cfa("rggb", (50712, 3, 256, table, True), (50717, 4, 1, 65025, True))]
    picture = read_picture(written(tmp_path, pixels, tags))
    assert (picture.pixels == pixels.astype(np.uint16) ** 2).all()
    assert picture.full_scale == 65025


def test_what_is_not_read(tmp_path: Path) -> None:
    trans = [VERSION, (33421, 3, 2, (6, 6), True), (33422, 1, 36, tuple([1, 0, 2] * 12), True)]
    with pytest.raises(InputError, match="colour filters in 6 x 6 pixels"):
        read_picture(written(tmp_path, SENSOR, trans))
    with pytest.raises(InputError, match="does not say its colour filters"):
        read_picture(written(tmp_path, SENSOR, [VERSION]))
    levels = cfa("rggb", (50714, 4, 1, 64, True), (50717, 4, 1, 50, True))
    with pytest.raises(InputError, match="white level, 50, is not above black, 64"):
        read_picture(written(tmp_path, SENSOR, [VERSION, *levels]))
    nikon = tmp_path / "x.nef"
    with TiffWriter(nikon) as file:
        make = [(271, 2, None, "NIKON CORPORATION", True)]
        preview = np.zeros((8, 8, 3), np.uint8)
        file.write(preview, photometric="rgb", subifds=1, metadata=None, extratags=make)
        file.write(SENSOR, photometric=CFA, metadata=None)
    with pytest.raises(InputError, match="raw file of NIKON CORPORATION; convert it to DNG"):
        read_picture(nikon)
    canon = io.BytesIO()
    imwrite(canon, SENSOR, photometric="minisblack", metadata=None)
    data = bytearray(canon.getvalue())
    data[8:10] = b"CR"
    (tmp_path / "x.cr2").write_bytes(data)
    with pytest.raises(InputError, match="Canon; convert it to DNG"):
        read_picture(tmp_path / "x.cr2")
