# SPDX-License-Identifier: Apache-2.0
"""A finished configuration of an ECP5, read back: words of the PLLs, settings of the pins.

nextpnr writes it as text (Project Trellis, docs/libtrellis/textconfig.rst), ecppack packs it.
Constraints and attributes are compared with it, because nextpnr silently ignores those that it does
not know.
"""

import re
from dataclasses import dataclass

from plenofir.fpga.bitstream.ecp5_netlist import PLL_WORDS
from plenofir.ground.errors import ToolError

Settings = dict[str, str]

_PIN = re.compile(r"pin '(.+)\$tr_io' constrained to Bel 'X(\d+)/Y(\d+)/(PIO[A-D])'")
_PORT = re.compile(r'^\s*IOBUF\s+PORT\s+"([^"]+)"\s+([^;]*);', re.M)
_PLL = re.compile(r"PLL0_(\w\w)")
# Settings that a constraint may change, with their defaults.
_DEFAULTS = {"DRIVE": "8", "SLEWRATE": "SLOW", "DIFFRESISTOR": "OFF"}


@dataclass(frozen=True)
class Configuration:
    """What tiles and groups of tiles of a configuration are set to."""

    tiles: dict[tuple[int, int], Settings]  # row and column; tiles of one place together
    plls: dict[str, dict[str, int]]  # words by name, for each corner of the device (UL, LL, ...)


def read_configuration(text: str) -> Configuration:
    """Read a configuration; ToolError if it has a line that is not understood."""
    tiles: dict[tuple[int, int], Settings] = {}
    plls: dict[str, dict[str, int]] = {}
    settings: Settings = {}
    words: dict[str, int] = {}
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind in (".tile", ".tile_group"):
            place = re.search(r"R(\d+)C(\d+)", rest)
            pll = _PLL.search(rest) if kind == ".tile_group" else None
            words = plls.setdefault(pll[1], {}) if pll else {}
            if place is None:
                raise ToolError(f"{rest}: a tile without a place in the configuration")
            settings = {}
            if kind == ".tile":
                settings = tiles.setdefault((int(place[1]), int(place[2])), {})
        elif kind == "enum:":
            name, _, value = rest.partition(" ")
            settings[name] = value
        elif kind == "word:":
            name, _, bits = rest.partition(" ")
            words[name] = int(bits, 2)
    return Configuration(tiles, plls)


def pin_places(log: str) -> dict[str, tuple[int, int, str]]:
    """Column, row and letter of each pin that nextpnr's log tells."""
    return {name: (int(x), int(y), pio) for name, x, y, pio in _PIN.findall(log)}


def pin_settings(config: Configuration, place: tuple[int, int, str]) -> Settings:
    """What a pin is set to: type, pull, drive, slew, termination.

    They are in the pin's own tile at the upper and the lower edge, in the tile one row below at the
    other edges (`get_pio_tile` in nextpnr's ``ecp5/bitstream.cc``).
    """
    x, y, pio = place
    at = (y, x + (pio == "PIOB")) if y == 0 else (y + 1, x)
    enums = config.tiles.get(at, {})
    if f"{pio}.BASE_TYPE" not in enums:
        enums = config.tiles.get((y, x + (pio == "PIOB")), {})
    return {
        name.partition(".")[2]: value for name, value in enums.items() if name.startswith(f"{pio}.")
    }


def constrained_settings(constraints: str) -> dict[str, Settings]:
    """Settings of each port in an LPF file."""
    return {
        port: dict(item.split("=") for item in items.split())
        for port, items in _PORT.findall(constraints)
    }


def check_configuration(
    config: Configuration, log: str, constraints: str
) -> tuple[dict[str, dict[str, int]], dict[str, str]]:
    """Compare a configuration with constraints and attributes.

    Returns the words of each PLL by its corner, and the settings of each pin as one text. ToolError
    names the first that differs.
    """
    plls = {}
    for corner, words in config.plls.items():
        # The text leaves out words that are zero.
        plls[corner] = {name: words.get(name, 0) for name in PLL_WORDS}
        if plls[corner] != PLL_WORDS:
            raise ToolError(f"PLL {corner} is configured with {plls[corner]}, not {PLL_WORDS}")
    places = pin_places(log)
    pins = {}
    for port, asked in constrained_settings(constraints).items():
        if port not in places:
            raise ToolError(f"pin {port} is not in the configuration")
        placed = pin_settings(config, places[port])
        kind = placed.pop("BASE_TYPE", "nothing")
        pins[port] = " ".join([kind, *(f"{name}={value}" for name, value in placed.items())])
        is_output = not kind.startswith("INPUT")
        for name, value in asked.items():
            there = kind.partition("_")[2] if name == "IO_TYPE" else placed.get(name)
            # Constraints of a group set these for inputs too, whose configuration has no such bits.
            if name in ("DRIVE", "SLEWRATE") and not is_output:
                continue
            if (there or _DEFAULTS.get(name)) != value:
                raise ToolError(f"pin {port} is configured as {pins[port]}, not {name}={value}")
    return plls, pins


def match_complements(text: str, log: str, constraints: str) -> str:
    """Give the negative pin of each pair of outputs at the upper edge the slew of the positive one.

    nextpnr 0.11 sets drive and type of both, but the slew of the positive one only, whose edges
    would then be faster than those of its complement.
    """
    places = pin_places(log)
    config = read_configuration(text)
    for port, settings in constrained_settings(constraints).items():
        if not settings.get("IO_TYPE", "").endswith("D") or "SLEWRATE" not in settings:
            continue
        x, y, pio = places[port]
        if (y, pio) != (0, "PIOA"):
            continue
        slew = f"enum: PIOB.SLEWRATE {settings['SLEWRATE']}"
        if config.tiles.get((0, x + 1), {}).get("PIOB.SLEWRATE") == settings["SLEWRATE"]:
            continue
        # The complement's tile is the one with its drive.
        head = re.compile(rf"(^\.tile \w*R0C{x + 1}:\S+\n(?:(?!\.tile).*\n)*?)(enum: PIOB\.)", re.M)
        text, count = head.subn(rf"\g<1>{slew}\n\g<2>", text, count=1)
        if count != 1:
            raise ToolError(f"the complement of {port} is not in the configuration")
    return text
