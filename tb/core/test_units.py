# SPDX-License-Identifier: Apache-2.0
"""The parts of the refocuser, each on its own, in one simulation."""

from collections.abc import Iterator
from dataclasses import asdict
from itertools import cycle, product

import pytest

from plenofir.fpga.resources.memory import block_sizes
from plenofir.refocus import FilterLayout
from plenofir_tb.drawn import drawn
from plenofir_tb.runner import Case, run_cases


def unit(entity: str, generics: dict, **case: object) -> Case:
    return Case(entity, "core.unit_bench", generics, {"entity": entity, **case})


def divide_round() -> Iterator[Case]:
    taken = map(int, drawn(["8", "16"], 1))
    for bits, m in product(taken, (1, 2, 3, 4, 5, 7, 8, 11, 15, 128)):
        divisor = m * m
        largest = divisor * (2**bits - 1)
        generics = {"VALUE_MAX": largest, "DIVISOR": divisor, "QUOTIENT_BITS": bits}
        yield unit("divide_round", generics, value_max=largest, divisor=divisor)


def divided_memory() -> Iterator[Case]:
    sizes = [(2, 1), (8, 700), (8, 5000), (9, 4099), (24, 6656), (1, 40000)]
    for latency, (width, words) in zip(cycle((2, 3)), sizes, strict=False):
        generics = {"WIDTH": width, "WORDS": words, "READ_LATENCY": latency, "DIVIDED": True}
        blocks = block_sizes(words, width)
        case = {"width": width, "words": words, "latency": latency, "blocks": blocks}
        yield unit("ram_simple_dual_port", generics, **case)


def stored_product() -> Iterator[Case]:
    for value_bits, scale_bits, divisor in [(8, 0, 3), (8, 8, 5), (10, 6, 7), (8, 3, 1), (8, 0, 2)]:
        product_max = round((2**value_bits - 1) * 2**scale_bits / divisor + 0.5)
        case = {"value_bits": value_bits, "scale_bits": scale_bits, "divisor": divisor}
        generics = {name.upper(): value for name, value in case.items()}
        generics["PRODUCT_BITS"] = product_max.bit_length()
        yield unit("stored_product", generics, **case)


def geometry(layout: FilterLayout) -> dict[str, int | bool | str]:
    """Generics that describe a filter."""
    shifts = " ".join(map(str, layout.shifts))
    numbers = f'{layout.micro_image_size}, "{shifts}", {layout.align == "centred"}'
    return {"GEOMETRY": f'geometry_of("test", {numbers})', "HOLD": layout.hold}


LAYOUTS = [
    *(FilterLayout(m, (shift,)) for m in (1, 2, 3, 5, 8) for shift in (-5, 0, 1, 7)),
    FilterLayout(3, (-4, 5, 1), "causal"),
    FilterLayout(4, (0, -7, 3, 12, 1)),
    FilterLayout(3, (6, 5)),
    FilterLayout(3, (0,), hold=True),
    FilterLayout(5, (-10, 5, 0), hold=True),
]


def switch_table() -> Iterator[Case]:
    for layout in LAYOUTS:
        yield unit("switch_table", geometry(layout), layout=asdict(layout))


def switched_fir() -> Iterator[Case]:
    layouts = [
        FilterLayout(3, (2,)),
        FilterLayout(3, (0, 4)),
        FilterLayout(4, (-3,)),
        FilterLayout(1, (5,)),
        FilterLayout(3, (0, -6), hold=True),
    ]
    for layout, depth, broadcast_taps in product(layouts, (1, 2, 3, 7), (0, 2)):
        generics = {
            "TAPS": layout.taps,
            "DELAY": layout.delay,
            "DEPTH": depth,
            "HOLD": layout.hold,
            "DATA_MAX": 255,
            "SUM_MAX": 255 * layout.micro_image_size,
            "BROADCAST_TAPS": broadcast_taps,
        }
        latency = 2 if broadcast_taps else 1
        yield unit("switched_fir", generics, layout=asdict(layout), depth=depth, latency=latency)


def lane_skew() -> Iterator[Case]:
    for lanes in (1, 4):
        yield unit("lane_skew", {"LANES": lanes, "WIDTH": 5}, lanes=lanes)


def lane_exchange() -> Iterator[Case]:
    for n in (1, 2, 5):
        yield unit("lane_exchange", {"LANES": n, "WIDTH": 4}, lanes=n)


def slice_select() -> Iterator[Case]:
    for slices in (1, 2, 3, 256):
        generics = {"SLICES": slices, "SLICE_BITS": max((slices - 1).bit_length(), 1)}
        yield unit("slice_select", generics, slices=slices)


def axis_fifo() -> Iterator[Case]:
    for width, address_bits in [(8, 1), (26, 3), (10, 5)]:
        generics = {"WIDTH": width, "ADDRESS_BITS": address_bits}
        yield unit("axis_fifo", generics, width=width, address_bits=address_bits)


def bus_crossing() -> Iterator[Case]:
    yield unit("bus_crossing", {"WIDTH": 24}, width=24)


def row_scatter() -> Iterator[Case]:
    # Two with exactly filled memories, two with a few more words than half of one.
    for rows, columns, under_way, slice_bits in [
        (1, 5, 7, 0),
        (1, 5, 8, 0),
        (2, 3, 3, 3),
        (3, 9, 5, 1),
    ]:
        generics = {
            "PARALLEL_ROWS": rows,
            "MAX_COLUMNS": columns,
            "DATA_BITS": 6,
            "SLICE_BITS": slice_bits,
            "UNDER_WAY": under_way,
        }
        case = {name.lower(): value for name, value in generics.items()}
        yield Case("scatter_ports", "core.scatter_bench", generics, case)


def function_ports() -> Iterator[Case]:
    for modulus, length in ((1, 0), (2, 1), (5, 3)):
        generics = {"MODULUS": modulus, "LENGTH": length}
        yield unit("function_ports", generics, modulus=modulus, length=length)


# One simulation, as start-up takes most of the time. `make mutants` selects by names of entities.
PARTS = [
    [divide_round, divided_memory, stored_product, switch_table],
    [switched_fir, lane_skew, lane_exchange, slice_select],
    [axis_fifo, bus_crossing, row_scatter, function_ports],
]


@pytest.mark.parametrize(
    "parts", PARTS, ids=lambda parts: "-".join(part.__name__ for part in parts)
)
def test_unit(parts: list) -> None:
    run_cases([case for part in parts for case in part()])
