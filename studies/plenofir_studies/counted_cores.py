# SPDX-License-Identifier: Apache-2.0
"""Cores whose cells are counted for each family, beside the estimates."""

from collections.abc import Iterator
from typing import Any

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.families import Family
from plenofir.refocus.arithmetic import StoredProductArithmetic
from plenofir_studies.engine_cells import LANES, SETS, Cell, measured_cells

COUNTED: tuple[Family, ...] = ("series7", "cyclonev", "nexus", "gw2a", "gw5a", "gatemate")
"""Families whose counts are recorded; those of GW1N are GW2A's, which has the same cells."""


# Options that the comparison lacks: stored products, several rows at once, interpolation.
_VARIANTS: dict[str, dict[str, Any]] = {
    "fir M=3 a'=0..2 RGB stored, 3 rows": {
        "micro_image_size": 3,
        "shifts": (0, 1, 2),
        "max_columns": 843,
        "channels": 3,
        "arithmetic": StoredProductArithmetic(fraction_bits=0, guard_bits=0),
        "engine": FirEngine(parallel_rows=3),
    },
    "fir M=3 a'=1 grey, 3 rows": {
        "micro_image_size": 3,
        "shifts": (1,),
        "max_columns": 640,
        "engine": FirEngine(parallel_rows=3),
    },
    "fir M=5 a'=2 grey stored": {
        "micro_image_size": 5,
        "shifts": (2,),
        "max_columns": 640,
        "arithmetic": StoredProductArithmetic(),
    },
    "fir M=5 a'=2 grey linear": {
        "micro_image_size": 5,
        "shifts": (2,),
        "max_columns": 640,
        "order": 1,
    },
    "moving_sum M=5 a'=2 grey linear": {
        "micro_image_size": 5,
        "shifts": (2,),
        "max_columns": 640,
        "order": 1,
        "engine": MovingSumEngine(),
    },
}


def counted_cores() -> Iterator[tuple[str, CoreConfiguration]]:
    """Cores that are counted for each family, by name: cells of the comparison, and variants."""
    for cell in measured_cells():
        m = cell.micro_image_size
        one = len(cell.shifts) == 1 and cell.shifts[0] in (2, m)
        if one or (m, cell.shifts, cell.channels) in SETS:
            yield cell.name, cell.core()
    for lanes in LANES:
        cell = Cell(*lanes[:3], "moving_sum", 2)
        yield cell.name, cell.core()
    for name, fields in _VARIANTS.items():
        yield name, CoreConfiguration.model_validate(fields)
