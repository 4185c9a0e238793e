# SPDX-License-Identifier: Apache-2.0
"""Parts of a netlist: their numbers as counted and as expected.

They are counted in GHDL's Verilog, where each entity still is a module.
"""

import re
from collections import Counter
from collections.abc import Iterator
from functools import cache

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.synthesis.spartan6 import TMDS_ENDS
from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic

# Entities that are counted, with the name of the part.
_ENTITIES = {
    "fir_stage": "stages",
    "switched_fir": "filters",
    "moving_sum_stage": "moving sums",
    "lane_stage": "moving sums",
    "stored_product": "stored products",
    "lens_sharpener": "sharpeners",
    "divide_round": "dividers",
    "divide_weighted": "dividers",
    "lane_skew": "lane registers",
    "lane_exchange": "lane registers",
}
PARTS = tuple(
    name
    for part in dict.fromkeys(_ENTITIES.values())
    for name in ((part, "taps") if part == "filters" else (part,))
)
"""Parts of a core that are counted, with the taps of filters."""


def count_instances(verilog: str, top: str) -> Counter[str]:
    """Count the instances of all modules and cells below a module of GHDL's Verilog, by name."""
    modules = re.findall(r"^module (\w+)\n(.*?)^endmodule", verilog, re.M | re.S)
    below = {
        name: Counter(re.findall(r"^  (\w+) (?:#\([^;]*?\) )?\w+ \(", body, re.M))
        for name, body in modules
    }

    @cache
    def count(name: str) -> Counter[str]:
        total: Counter[str] = Counter()
        for part, number in below.get(name, Counter()).items():
            total[part] += number
            for deeper, times in count(part).items():
                total[deeper] += number * times
        return total

    return count(top)


def count_parts(verilog: str, top: str) -> dict[str, int]:
    """Count the `PARTS` and `TMDS_ENDS` of a design in GHDL's Verilog."""
    counts = dict.fromkeys((*PARTS, *TMDS_ENDS), 0)
    for name, number in count_instances(verilog, top).items():
        if name in TMDS_ENDS:
            counts[name] += number
        for entity, part in _ENTITIES.items():
            # GHDL appends generics that are numbers: a filter's first is TAPS, that of lane
            # registers LANES.
            match = re.match(rf"{entity}_(?:(\d+)_)?", name)
            # A single lane is a wire.
            if match and not (part == "lane registers" and match[1] == "1"):
                counts[part] += number
                if part == "filters":
                    counts["taps"] += number * int(match[1])
    return counts


def needed_parts(core: CoreConfiguration) -> dict[str, int]:
    """Expected number of each of the `PARTS` of a core; no TMDS ends."""
    lanes = core.channels * core.parallel_rows * core.pixels_per_clock
    parts = {"moving sums": 2 * core.passes}
    if isinstance(core.engine, FirEngine):
        filters = 2 * core.passes * lanes
        taps = 2 * lanes * core.engine.taps(core)
        parts = {"stages": 2 * core.passes, "filters": filters, "taps": taps}
    if core.normalises:
        # The weights are moving sums, and one of the dividers has all channels of a pixel.
        parts["moving sums"] = parts.get("moving sums", 0) + 2 * core.passes
        lanes //= core.channels
    return {
        **dict.fromkeys(PARTS, 0),
        **parts,
        "stored products": 0 if core.exact else 2 * core.passes * lanes,
        "sharpeners": int(core.sharpens),
        "dividers": lanes if core.exact else 0,
        # Two of each, before and after the columns.
        "lane registers": 4 if core.parallel_rows > 1 else 0,
    }


def left_out_in_turn() -> Iterator[tuple[str, CoreConfiguration]]:
    """Yield a full build, the same without each of its features, and without all of them.

    Each comes with the name of what is left out.
    """
    everything = CoreConfiguration(
        micro_image_size=3,
        shifts=tuple(range(-3, 4)),
        max_columns=64,
        channels=3,
        engine=FirEngine(parallel_rows=2),
        order=1,
        arithmetic=StoredProductArithmetic(),
    )
    things: dict[str, dict[str, object]] = {
        "two of three channels": {"channels": 1},
        "six of seven slices": {"shifts": (1,)},
        "interpolation": {"order": 0},
        "stored products (exact sums)": {"arithmetic": ExactArithmetic()},
        "the second row at once": {"engine": FirEngine()},
    }
    yield "nothing", everything
    fitted: dict[str, object] = {}
    for feature, change in things.items():
        yield feature, everything.model_copy(update=change)
        fitted |= change
    yield "all of these", everything.model_copy(update=fitted)
