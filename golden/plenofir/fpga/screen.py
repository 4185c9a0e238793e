# SPDX-License-Identifier: Apache-2.0
"""What a board's screen shows besides the refocused slice: ``hdl/board/screen_pkg.vhd``."""

from dataclasses import dataclass

from plenofir.fpga.overlay import Overlay

SCREEN_PACKAGE = "screen_pkg"
"""Name of the VHDL package."""
# Digits of a string literal in a line.
_DIGITS = 80


@dataclass(frozen=True)
class Screen:
    """Outputs that can be chosen, and the text over them.

    Attributes
    ----------
    outputs
        A letter for each, as in ``hdl/video/picture_pkg.vhd``; the first is shown after a reset.
    radius, confidence, vote_radius
        See `plenofir.refocus.sharpness.depth_index`.
    colours
        Red, green, blue of each slice in the depth picture.
    overlay
        The text, or None.
    """

    outputs: str = "r"
    radius: int = 1
    confidence: int = 0
    vote_radius: int = 0
    colours: tuple[tuple[int, int, int], ...] = ()
    overlay: Overlay | None = None


def _literal(value: str | int | bool) -> tuple[str, str]:
    """Type and text of a constant; a long text takes several lines."""
    if isinstance(value, bool):
        return "boolean", str(value).lower()
    if isinstance(value, int):
        return "natural", str(value)
    parts = [value[i : i + _DIGITS] for i in range(0, len(value), _DIGITS)]
    return "string", " &\n    ".join(f'"{part}"' for part in parts) or '""'


def _constants(values: dict[str, str | int]) -> list[str]:
    """Declarations, in columns."""
    found = {name: _literal(value) for name, value in values.items()}
    names, types = max(map(len, found)), max(len(kind) for kind, _ in found.values())
    return [
        f"  constant {name.ljust(names)} : {kind.ljust(types)} := {text};"
        for name, (kind, text) in found.items()
    ]


def screen_package(screen: Screen | None = None) -> str:
    """Make the VHDL package.

    Parameters
    ----------
    screen
        What it says; the refocused slice alone, without a text, if None.

    Returns
    -------
    str
        ``hdl/board/screen_pkg.vhd``.
    """
    screen = screen or Screen()
    overlay = screen.overlay
    shown: dict[str, str | int] = {
        "OUTPUTS": screen.outputs,
        "SHARPNESS_RADIUS": screen.radius,
        "CONFIDENCE": screen.confidence,
        "VOTE_RADIUS": screen.vote_radius,
        "COLOURS": "".join(bytes(colour).hex() for colour in screen.colours),
    }
    written: dict[str, str | int] = {"WITH_TEXT": overlay is not None, "TEXTS": ""}
    written |= {"TEXT_COLUMNS": 1, "LABELS": "", "LABEL_COLUMNS": 2, "FONT": ""}
    if overlay is not None:
        written |= {name: text for name, text in overlay.generics().items() if name in written}
    lines = [
        "-- What the screen shows besides the refocused slice, and the text over it; built by",
        "-- scripts/build_hdl.py from plenofir.fpga.screen.",
        "",
        "library ieee;",
        "use ieee.std_logic_1164.all;",
        "",
        f"package {SCREEN_PACKAGE} is",
        "",
        "  -- As in picture_core.",
        *_constants(shown),
        "",
        "  -- As in text_overlay.",
        *_constants(written),
        "",
        f"end package {SCREEN_PACKAGE};",
        "",
    ]
    return "\n".join(lines)
