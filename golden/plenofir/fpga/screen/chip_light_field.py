# SPDX-License-Identifier: Apache-2.0
"""A light field kept on the chip, two colours a micro image: ``hdl/video/stored_pkg.vhd``.

A micro image is a small part of the scene seen from M x M positions, so two colours approximate it
well; the refocuser averages M x M micro images for each pixel, and most of the error averages out.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.fpga.resources.estimate import Block

STORED_PACKAGE = "stored_pkg"
"""Name of the VHDL package."""
# With these a word of M = 5 has 53 bits, which three block RAMs of 18 hold.
COLOUR_BITS = (5, 5, 4)
"""Bits of red, green and blue of a stored colour."""
_ROUNDS = 8
# A block RAM of 18 Kbit.
_WORDS, _WIDTH = 1024, 18


def _of_bits(values: npt.NDArray[np.int64], bits: int) -> npt.NDArray[np.int64]:
    """Values of a given number of bits expanded to 8 bits, by repeating the high bits."""
    return values << (8 - bits) | values >> (2 * bits - 8)


@dataclass(frozen=True, eq=False)
class StoredLightField:
    """A raw image, compressed."""

    micro_image_size: int
    # (lens rows, lens columns, M * M): the second colour instead of the first, line by line.
    mask: npt.NDArray[np.bool_]
    # (lens rows, lens columns, 2, 3): both colours, COLOUR_BITS each.
    colours: npt.NDArray[np.int64]

    @property
    def lenses(self) -> tuple[int, int]:
        """Rows and columns of micro images."""
        rows, columns = self.mask.shape[:2]
        return rows, columns

    @property
    def size(self) -> tuple[int, int]:
        rows, columns = self.lenses
        return rows * self.micro_image_size, columns * self.micro_image_size

    @property
    def word_bits(self) -> int:
        return self.micro_image_size**2 + 2 * sum(COLOUR_BITS)

    @property
    def block_rams(self) -> int:
        """Block RAMs of 18 Kbit that it takes, each 1024 words of 18 bits."""
        rows, columns = self.lenses
        return math.ceil(rows * columns / _WORDS) * math.ceil(self.word_bits / _WIDTH)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Block of the entity ``stored_light_field``, for the estimate."""
        parts = {"stored": 1, "word bits": self.word_bits, "block RAMs": self.block_rams}
        return (Block("stored", parts),)

    def raster(self) -> npt.NDArray[np.uint8]:
        """The raw image that the FPGA reconstructs, (rows, columns, 3)."""
        m, (rows, columns) = self.micro_image_size, self.lenses
        both = np.stack(
            [_of_bits(self.colours[..., c], bits) for c, bits in enumerate(COLOUR_BITS)], axis=-1
        )
        pixels = np.where(self.mask[..., None], both[..., 1:, :], both[..., :1, :])
        parts = pixels.reshape(rows, columns, m, m, 3).transpose(0, 2, 1, 3, 4)
        return parts.reshape(rows * m, columns * m, 3).astype(np.uint8)

    def words(self) -> list[str]:
        """A word of bits for each micro image, row by row: second colour, first colour, mask."""
        columns = []
        for number in (1, 0):
            for c in (2, 1, 0):
                value, bits = self.colours[..., number, c], COLOUR_BITS[c]
                columns += [value >> bit & 1 for bit in reversed(range(bits))]
        columns += [
            self.mask[..., bit].astype(np.int64) for bit in reversed(range(self.mask.shape[-1]))
        ]
        table = np.stack(columns, axis=-1).astype(np.uint8).reshape(-1, self.word_bits) + ord("0")
        return [row.tobytes().decode("ascii") for row in table]


def _two_means(
    pixels: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.float64]]:
    """Divide the pixels (n, M * M, 3) of each micro image in two: membership and both means.

    Lloyd's algorithm, begun with the mean of the channel that varies most.
    """

    def means(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
        second = mask[..., None]
        count = second.sum(axis=1)
        total = pixels.sum(axis=1)
        of_second = (pixels * second).sum(axis=1)
        of_first = (total - of_second) / np.maximum(mask.shape[1] - count, 1)
        # A colour that no pixel has is the other one.
        of_second = np.where(count > 0, of_second / np.maximum(count, 1), of_first)
        return np.stack([of_first, of_second], axis=1)

    channel = pixels.var(axis=1).argmax(axis=1)
    values = np.take_along_axis(pixels, channel[:, None, None], axis=2)[..., 0]
    mask = values > values.mean(axis=1, keepdims=True)
    for _ in range(_ROUNDS):
        first, second = np.moveaxis(means(mask), 1, 0)
        to_first = ((pixels - first[:, None]) ** 2).sum(axis=2)
        mask = ((pixels - second[:, None]) ** 2).sum(axis=2) < to_first
    return mask, means(mask)


def store(raster: npt.NDArray[np.uint8], micro_image_size: int) -> StoredLightField:
    """Compress a raw image of 8 bits, (rows, columns, 3), of whole micro images."""
    m = micro_image_size
    rows, columns = (extent // m for extent in raster.shape[:2])
    parts = raster.reshape(rows, m, columns, m, 3).transpose(0, 2, 1, 3, 4)
    mask, means = _two_means(parts.reshape(-1, m * m, 3).astype(np.float64))
    largest = 2 ** np.array(COLOUR_BITS) - 1
    colours = np.rint(means / 255 * largest).astype(np.int64)
    return StoredLightField(
        micro_image_size=m,
        mask=mask.reshape(rows, columns, m * m),
        colours=colours.reshape(rows, columns, 2, 3),
    )


def move_focus(
    raster: npt.NDArray[np.uint8], micro_image_size: int, lenses: int
) -> npt.NDArray[np.uint8]:
    """Move the planes of a raw image: what was sharp at a is so at a + `lenses`.

    Each view is moved by whole micro images, so no pixel changes its value; the image is continued
    periodically.
    """
    m = micro_image_size
    rows, columns = (extent // m for extent in raster.shape[:2])
    moved = raster.reshape(rows, m, columns, m, *raster.shape[2:]).copy()
    for v in range(m):
        moved[:, v] = np.roll(moved[:, v], -lenses * (v - m // 2), axis=0)
    for u in range(m):
        moved[:, :, :, u] = np.roll(moved[:, :, :, u], -lenses * (u - m // 2), axis=2)
    return moved.reshape(raster.shape)


def stored_package(stored: StoredLightField | None = None) -> str:
    """VHDL of ``hdl/video/stored_pkg.vhd``; None: no light field is kept."""
    m, (rows, columns) = (1, (1, 1)) if stored is None else (stored.micro_image_size, stored.lenses)
    bits = m * m + 2 * sum(COLOUR_BITS)
    words = ["0" * bits] if stored is None else stored.words()
    lines = [
        "-- The light field that is kept on the chip, two colours a micro image; built by",
        "-- scripts/build_hdl.py from plenofir.fpga.screen.chip_light_field.",
        "",
        "library ieee;",
        "use ieee.std_logic_1164.all;",
        "",
        f"package {STORED_PACKAGE} is",
        "",
        "  -- Whether a light field is stored; pixels of a micro image in each dimension; micro",
        "  -- images in each dimension.",
        f"  constant WITH_STORED      : boolean  := {str(stored is not None).lower()};",
        f"  constant STORED_SIZE      : positive := {m};",
        f"  constant STORED_LENSES    : positive := {columns};",
        f"  constant STORED_LENS_ROWS : positive := {rows};",
        "",
        "  -- A micro image: a bit for each pixel, the first one lowest, that selects its colour;",
        "  -- then both colours, each of 5 bits red, 5 bits green, 4 bits blue.",
        f"  subtype stored_word_t is std_logic_vector({bits - 1} downto 0);",
        "",
        f"  type stored_words_t is array (natural range 0 to {len(words) - 1}) of stored_word_t;",
        "",
        "  constant STORED_WORDS : stored_words_t :=",
        "  (",
        # An aggregate of one element has its index.
        *([f'    0 => "{words[0]}"'] if len(words) == 1 else []),
        *([",\n".join(f'    "{word}"' for word in words)] if len(words) > 1 else []),
        "  );",
        "",
        f"end package {STORED_PACKAGE};",
        "",
    ]
    return "\n".join(lines)
