# SPDX-License-Identifier: Apache-2.0
"""Broadcast nets of a row filter compared: all taps at once, latches, and full-systolic.

The thesis's filters are semi-systolic; it recommends to convert them (section 6.3). The filters of
``data/row_filter.vhd`` differ only in the net; tests check that they give the same sums.
`python scripts/resources.py nets` places them for an ECP5.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass

from plenofir.fpga.resources.record import Placed
from plenofir_studies import DATA
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import table

TOP = "row_filter"
SOURCE = DATA / f"{TOP}.vhd"
FILE = DATA / "row_filters.json"
FILTERS = ((5, 5), (11, 11))
"""M and a'."""
NETS = {0: "semi-systolic", 8: "latches of 8 taps", -1: "full-systolic"}
"""Generic NET, and what it is."""


@dataclass(frozen=True)
class RowFilter:
    """A row filter with a net."""

    micro_image_size: int
    shift: int
    net: int

    @property
    def name(self) -> str:
        """In the file of records."""
        return f"M={self.micro_image_size} a'={self.shift} {NETS[self.net]}"

    @property
    def taps(self) -> int:
        return self.micro_image_size + (self.micro_image_size - 1) * (self.shift - 1)

    @property
    def latency(self) -> int:
        """Clocks from a pixel to the first sum with it; in two nets the switches take one."""
        return self.taps if self.net < 0 else 2 + (self.net > 0)

    def generics(self, pixel_bits: int = 8) -> dict[str, int]:
        return {
            "MICRO_IMAGE_SIZE": self.micro_image_size,
            "SHIFT": self.shift,
            "PIXEL_BITS": pixel_bits,
            "NET": self.net,
        }


def row_filters() -> Iterator[RowFilter]:
    return (RowFilter(m, shift, net) for m, shift in FILTERS for net in NETS)


def load_placed() -> dict[str, Placed]:
    content = json.loads(FILE.read_text()) if FILE.exists() else {}
    return {name: Placed.model_validate(values) for name, values in content.items()}


def save_placed(placed: dict[str, Placed]) -> None:
    """Write the file, a filter a line."""
    save_records(FILE, {name: record.model_dump() for name, record in placed.items()})


def summary() -> list[str]:
    """Lines of a table of the filters that were placed."""
    placed = load_placed()
    rows = [
        (
            row.micro_image_size,
            row.shift,
            row.taps,
            NETS[row.net],
            placed[row.name].lut,
            placed[row.name].flip_flops,
            f"{placed[row.name].fmax_mhz:g}",
            row.latency,
        )
        for row in row_filters()
        if row.name in placed
    ]
    heads = ["M", "a'", "taps", "net", "LUT4", "flip-flops", "MHz", "latency in clocks"]
    return table(heads, rows)[:-1]
