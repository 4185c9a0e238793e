# SPDX-License-Identifier: Apache-2.0
"""What comes out besides the refocused slice: on a board's screen, or of a core with all slices.

``hdl/video/screen_pkg.vhd`` holds what a board shows.
"""

from dataclasses import dataclass

from plenofir.fpga.core.configuration import STREAM_CLOCKS, CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import Generics
from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.screen.overlay import OVERLAY_CLOCKS, Overlay
from plenofir.refocus.operator import least_box
from plenofir.refocus.sharpness import FRACTION_BITS

SCREEN_PACKAGE = "screen_pkg"
"""Name of the VHDL package."""
SHADES = 8
"""Colours of a slice where depth between slices is shown (MOST_SHADES)."""
# Clocks of the video path: video_to_stream 3, stream_to_video 1, the output's choice 1.
_VIDEO_CLOCKS = 5
# Digits of a string literal in a line.
_DIGITS = 80


@dataclass(frozen=True)
class Screen:
    """Selectable outputs, and the text over them."""

    # A letter for each, as in ``hdl/video/picture_pkg.vhd``; the first one after a reset. Of a core
    # without a screen "s" (all slices), "ai" (in focus, with the depth index) or "i" (the latter).
    outputs: str = "r"
    radius: int = 1  # see `plenofir.refocus.sharpness.depth_index`, as the next two
    confidence: int = 0
    vote_radius: int = 0
    # Red, green, blue of each slice in the depth picture; SHADES colours of each with `between`.
    colours: tuple[tuple[int, int, int], ...] = ()
    between: bool = False  # whether depth between slices is found
    overlay: Overlay | None = None
    # Samples of a box where a slice is in focus, if it is less than M, the box elsewhere: the core
    # has each slice twice, see `in_pairs`.
    sharp_box: int | None = None

    @property
    def needs_stack(self) -> bool:
        """Whether all slices are computed at once."""
        return self.needs_index or "s" in self.outputs

    @property
    def needs_index(self) -> bool:
        """Whether the sharpest of them are found."""
        return bool(set(self.outputs) & {"a", "d", "i"})

    def in_pairs(self, core: CoreConfiguration) -> CoreConfiguration:
        """A core of some slices as its outputs take them.

        With `sharp_box` each comes twice, with its box of M and beside it with the smallest of
        `sharp_box` samples or more.
        """
        if self.sharp_box is None:
            return core
        m = core.micro_image_size
        boxes = (b for shift in core.shifts for b in (m, least_box(m, shift, self.sharp_box)))
        shifts = (shift for shift in core.shifts for _ in range(2))
        return core.model_copy(update={"shifts": tuple(shifts), "boxes": tuple(boxes)})

    def shifts(self, core: CoreConfiguration) -> tuple[int, ...]:
        """The a' in pixels of a core's slices, each once."""
        return core.shifts if self.sharp_box is None else core.shifts[::2]

    def index(self, core: CoreConfiguration) -> DepthIndexConfiguration:
        """Depth index behind the focal stack."""
        return DepthIndexConfiguration(
            micro_image_size=core.micro_image_size,
            slices=len(self.shifts(core)),
            radius=self.radius,
            confidence=self.confidence,
            vote_radius=self.vote_radius,
            max_columns=core.max_columns,
            pixels_per_clock=core.pixels_per_clock,
            channels=core.channels,
            pixel_bits=core.pixel_bits,
            shifts=self.shifts(core) if self.between else (),
            picture=self.outputs != "i",
            sharp_too=self.sharp_box is not None,
        )

    def blocks(self, core: CoreConfiguration) -> tuple[Block, ...]:
        """Blocks of a core, the depth index behind it, and the text, for the estimate."""
        blocks = core.blocks
        if self.needs_index:
            blocks += (self.index(core).block(chosen_too="i" not in self.outputs),)
        return blocks if self.overlay is None else blocks + self.overlay.blocks

    def delay_lines(self, core: CoreConfiguration) -> int:
        """Delay of a picture in lines (picture_delay_lines)."""
        if not self.needs_stack:
            return core.delay
        # If a frame's lines, blanking included, are no multiple of M, the last ones wait for the
        # next.
        return core.delay + self.index(core).delay + core.micro_image_size - 1

    def delay_pixels(self, core: CoreConfiguration) -> int:
        """Delay in pixels besides that in lines (picture_delay_pixels)."""
        if not self.needs_stack:
            return core.video_delay_pixels
        return core.video_delay_pixels + STREAM_CLOCKS + self.index(core).index_latency

    def latency_clocks(self, core: CoreConfiguration, line_length: int) -> int:
        """Clocks from a pixel at the video path's input to the same position at its output.

        A line's length includes blanking.
        """
        text = OVERLAY_CLOCKS if self.overlay else 0
        return self.delay_lines(core) * line_length + self.delay_pixels(core) + _VIDEO_CLOCKS + text

    def stack_pixel_bits(self, core: CoreConfiguration) -> int:
        """Bits of a pixel in the stream of a core with all slices (index_word_bits)."""
        if not self.needs_index:
            return len(core.shifts) * core.channels * core.pixel_bits
        picture = core.channels * core.pixel_bits * self.index(core).picture
        return picture + 8 + 2 * FRACTION_BITS * self.between

    def core_delay_lines(self, core: CoreConfiguration) -> int:
        """Lines that what comes out of a core's streams is behind its input."""
        return core.delay + (self.index(core).delay if self.needs_index else 0)

    def core_latency_clocks(self, core: CoreConfiguration, columns: int, rows: int) -> int:
        """Clocks from the first pixel of a core's streams to the first one that comes out."""
        clocks = core.latency_clocks(columns, rows)
        if self.needs_index:
            clocks += self.index(core).latency_clocks(columns, rows)
        return clocks

    def generics(self) -> Generics:
        """Generics of ``picture_core``, besides the core."""
        return {
            "OUTPUTS": self.outputs,
            "RADIUS": self.radius,
            "CONFIDENCE": self.confidence,
            "VOTE_RADIUS": self.vote_radius,
            "COLOURS": "".join(bytes(colour).hex() for colour in self.colours),
        }


def _literal(value: str | int | bool) -> tuple[str, str]:
    """Type and text of a constant; a long text takes several lines."""
    if isinstance(value, bool):
        return "boolean", str(value).lower()
    if isinstance(value, int):
        return "natural", str(value)
    parts = [value[i : i + _DIGITS] for i in range(0, len(value), _DIGITS)]
    return "string", " &\n    ".join(f'"{part}"' for part in parts) or '""'


def _constants(values: dict[str, str | int]) -> list[str]:
    literals = {name: _literal(value) for name, value in values.items()}
    names, types = max(map(len, literals)), max(len(kind) for kind, _ in literals.values())
    return [
        f"  constant {name.ljust(names)} : {kind.ljust(types)} := {text};"
        for name, (kind, text) in literals.items()
    ]


def screen_package(screen: Screen | None = None) -> str:
    """VHDL of ``hdl/video/screen_pkg.vhd``; None: the refocused slice alone, without a text."""
    screen = screen or Screen()
    overlay = screen.overlay
    settings: dict[str, str | int] = {
        "OUTPUTS": screen.outputs,
        "SHARPNESS_RADIUS": screen.radius,
        "CONFIDENCE": screen.confidence,
        "VOTE_RADIUS": screen.vote_radius,
        "COLOURS": "".join(bytes(colour).hex() for colour in screen.colours),
        "SHARP_TOO": screen.sharp_box is not None,
    }
    written: dict[str, str | int] = {"WITH_TEXT": overlay is not None, "TEXTS": ""}
    written |= {"TEXT_COLUMNS": 1, "LABELS": "", "LABEL_COLUMNS": 2, "FONT": ""}
    if overlay is not None:
        written |= {name: text for name, text in overlay.generics().items() if name in written}
    lines = [
        "-- The outputs that the screen shows besides the refocused slice, and the text over them;",
        "-- built by scripts/build_hdl.py from plenofir.fpga.screen.board_screen.",
        "",
        "library ieee;",
        "use ieee.std_logic_1164.all;",
        "",
        f"package {SCREEN_PACKAGE} is",
        "",
        "  -- Generics of picture_core: the possible outputs, and how depth is found.",
        *_constants(settings),
        "",
        "  -- Generics of text_overlay: the text over the picture.",
        *_constants(written),
        "",
        f"end package {SCREEN_PACKAGE};",
        "",
    ]
    return "\n".join(lines)
