# SPDX-License-Identifier: Apache-2.0
"""The text over the picture, bit for bit as ``hdl/overlay/text_overlay.vhd`` draws it."""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.resources.memory import Memory, bits_for
from plenofir.ground import project
from plenofir.ground.errors import InputError

GLYPH_COLUMNS, GLYPH_ROWS, RULER_ROWS, MARGIN = 8, 16, 8, 8
ROWS = 2 * GLYPH_ROWS + RULER_ROWS
OVERLAY_CLOCKS = 5
"""Clocks from a pixel in to the same pixel out (overlay_pkg.OVERLAY_LATENCY)."""
ERROR_TEXT = "  errors "
ERROR_COLUMNS = len(ERROR_TEXT) + 2
MAX_TEXT, MAX_LABEL, MAX_SLICES = 64, 16, 64

Shown = Literal["refocused", "all-in-focus", "depth", "raw"]
"""Content of a frame."""
_ORDER = ("all-in-focus", "depth", "raw")


@cache
def font() -> dict[str, bytes]:
    """Glyphs: a byte a line, the left pixel in its high bit (``data/overlay_font.txt``)."""
    lines = (project.DATA / "overlay_font.txt").read_text(encoding="ascii").splitlines()
    return {line[0]: bytes.fromhex(line[2:]) for line in lines if not line.startswith("##")}


def font_digits() -> str:
    """All glyphs from the blank to the tilde, in hexadecimal (generic FONT)."""
    return "".join(font()[chr(code)].hex() for code in range(32, 127))


@dataclass(frozen=True)
class Overlay:
    """Texts over the pictures of a scene."""

    texts: tuple[str, ...]  # for each slice, then for all in focus, depth, and the unchanged input
    labels: tuple[str, ...]  # for each slice
    # Red, green, blue of each slice; with depth between slices several of each, of which the middle
    # one is drawn; empty if depth is never shown.
    colours: tuple[tuple[int, int, int], ...] = ()

    def __post_init__(self) -> None:
        """Refuse texts without a glyph, and wrong numbers of texts or colours."""
        if not 1 <= len(self.labels) <= MAX_SLICES:
            raise InputError(f"an overlay has 1 to {MAX_SLICES} slices, not {len(self.labels)}")
        for texts, limit in ((self.texts, MAX_TEXT), (self.labels, MAX_LABEL - 1)):
            for text in texts:
                if len(text) > limit or not set(text) <= set(font()):
                    raise InputError(
                        f"an overlay has texts of at most {limit} characters of ASCII, not {text!r}"
                    )

    @property
    def slices(self) -> int:
        return len(self.labels)

    @property
    def text_columns(self) -> int:
        return max(map(len, self.texts))

    @property
    def label_columns(self) -> int:
        """Characters of a label, with a blank after it."""
        return max(map(len, self.labels)) + 1

    @property
    def columns(self) -> int:
        return max(self.text_columns + ERROR_COLUMNS, self.slices * self.label_columns)

    @property
    def codes(self) -> int:
        """Characters of all texts and labels, with that of the errors."""
        return (
            len(self.texts) * self.text_columns + self.slices * self.label_columns + ERROR_COLUMNS
        )

    @property
    def size(self) -> tuple[int, int]:
        """Smallest picture that it fits in, (rows, columns) in pixels."""
        return ROWS + 2 * MARGIN, self.columns * GLYPH_COLUMNS + 2 * MARGIN

    def generics(self) -> dict[str, int | str]:
        return {
            "SLICES": self.slices,
            "FONT": font_digits(),
            "TEXTS": "".join(text.ljust(self.text_columns) for text in self.texts),
            "TEXT_COLUMNS": self.text_columns,
            "LABELS": "".join(label.ljust(self.label_columns) for label in self.labels),
            "LABEL_COLUMNS": self.label_columns,
            "COLOURS": "".join(bytes(colour).hex() for colour in self.colours),
        }

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Block of the text over the picture, for the estimate."""
        characters = Memory("characters", bits_for(self.codes - 1), 7, 1, rom=True)
        return (Block("text", {"text": 1}, (characters, Memory("font", 11, 8, 1, rom=True))),)

    def _ruler(self, output: Shown, slice_: int) -> npt.NDArray[np.uint8]:
        """Colour of each pixel of the ruler's lines, shape (columns, 3)."""
        field = self.label_columns * GLYPH_COLUMNS
        line = np.zeros((self.columns * GLYPH_COLUMNS, 3), np.uint8)
        shades = len(self.colours) // self.slices
        for number in range(self.slices):
            colour: tuple[int, ...] = (0x40,) * 3
            if output == "depth":
                colour = self.colours[number * shades + shades // 2] if shades else (0, 0, 0)
            elif output == "all-in-focus" or (output == "refocused" and number == slice_):
                colour = (255,) * 3
            # Two dark columns part neighbouring fields.
            line[number * field : (number + 1) * field - 2] = colour
        return line

    def draw(
        self,
        picture: npt.NDArray[np.uint8],
        output: Shown,
        slice_: int,
        *,
        errors: int = 0,
        bottom: bool = False,
    ) -> npt.NDArray[np.uint8]:
        """Write over a picture (rows, columns, 3), cut at its edges.

        `output` and `slice_` say what the picture shows, `errors` is the sum of the errors,
        0 to 31.
        """
        number = slice_ if slice_ < self.slices else 0
        entry = number if output == "refocused" else self.slices + _ORDER.index(output)
        text = self.texts[entry].ljust(self.text_columns)
        if errors:
            text += f"{ERROR_TEXT}{errors:02d}"
        labels = "".join(label.ljust(self.label_columns) for label in self.labels)
        white = np.concatenate([self._line(line) for line in (text, labels)])
        # -1: the picture, darkened.
        drawn = np.full((ROWS, white.shape[1], 3), -1, np.int16)
        drawn[: len(white)][white] = 255
        drawn[len(white) :] = self._ruler(output, slice_)
        out = picture.copy()
        first = picture.shape[0] - ROWS - MARGIN if bottom else MARGIN
        box = out[max(first, 0) : max(first + ROWS, 0), MARGIN : MARGIN + white.shape[1]]
        rows, columns = box.shape[:2]
        above = max(-first, 0)
        part = drawn[above : above + rows, :columns]
        # The picture stays visible behind the text, at a quarter of its values.
        box[...] = np.where(part < 0, box >> 2, part)
        return out

    def _line(self, text: str) -> npt.NDArray[np.bool_]:
        """White pixels of a line of text, shape (16, columns)."""
        glyphs = [np.frombuffer(font()[letter], np.uint8) for letter in text.ljust(self.columns)]
        return np.unpackbits(np.stack(glyphs, axis=1), axis=1).astype(bool)
