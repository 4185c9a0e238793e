# SPDX-License-Identifier: Apache-2.0
"""The parts of the refocuser, each on its own."""

from dataclasses import asdict
from itertools import cycle, product

import pytest

from plenofir.fpga.core.memory import block_sizes
from plenofir.refocus import FilterLayout
from plenofir_tb.runner import Case, run_cases


def unit(entity: str, generics: dict, **case: object) -> Case:
    return Case(entity, "core.unit_bench", generics, {"entity": entity, **case})


@pytest.mark.drawn(1)
@pytest.mark.parametrize("bits", [8, 16])
def test_divide_round(bits: int) -> None:
    cases = []
    for m in (1, 2, 3, 4, 5, 7, 8, 11, 15, 128):
        divisor = m * m
        largest = divisor * (2**bits - 1)
        generics = {"VALUE_MAX": largest, "DIVISOR": divisor, "QUOTIENT_BITS": bits}
        cases.append(unit("divide_round", generics, value_max=largest, divisor=divisor))
    run_cases(cases)


def test_ram_blocks() -> None:
    sizes = [(2, 1), (8, 700), (8, 5000), (9, 4099), (24, 6656), (1, 40000)]
    run_cases(
        [
            unit(
                "ram_blocks",
                {"WIDTH": width, "WORDS": words, "READ_LATENCY": latency},
                width=width,
                words=words,
                latency=latency,
                blocks=block_sizes(words, width),
            )
            for latency, (width, words) in zip(cycle((2, 3)), sizes, strict=False)
        ]
    )


def test_round_saturate() -> None:
    run_cases(
        [
            unit(
                "round_saturate",
                {"VALUE_MAX": value_max, "DROP_BITS": drop, "RESULT_BITS": bits},
                value_max=value_max,
                drop_bits=drop,
                result_bits=bits,
            )
            for value_max, drop, bits in [(1000, 0, 8), (5000, 4, 8), (2047, 3, 8)]
        ]
    )


def test_stored_product() -> None:
    cases = []
    for value_bits, scale_bits, divisor in [(8, 0, 3), (8, 8, 5), (10, 6, 7), (8, 3, 1), (8, 0, 2)]:
        product_max = round((2**value_bits - 1) * 2**scale_bits / divisor + 0.5)
        generics = {
            "VALUE_BITS": value_bits,
            "PRODUCT_BITS": product_max.bit_length(),
            "SCALE_BITS": scale_bits,
            "DIVISOR": divisor,
        }
        cases.append(
            unit(
                "stored_product",
                generics,
                value_bits=value_bits,
                scale_bits=scale_bits,
                divisor=divisor,
            )
        )
    run_cases(cases)


def geometry(layout: FilterLayout) -> dict[str, int | bool | str]:
    """Generics that describe a filter."""
    return {
        "MICRO_IMAGE_SIZE": layout.micro_image_size,
        "SHIFTS": " ".join(map(str, layout.shifts)),
        "CENTRED": layout.align == "centred",
        "HOLD": layout.hold,
        "TAPS": layout.taps,
    }


LAYOUTS = [
    *(FilterLayout(m, (shift,)) for m in (1, 2, 3, 5, 8) for shift in (-5, 0, 1, 7)),
    FilterLayout(3, (-4, 5, 1), "causal"),
    FilterLayout(4, (0, -7, 3, 12, 1)),
    FilterLayout(3, (6, 5)),
    FilterLayout(3, (0,), hold=True),
    FilterLayout(5, (-10, 5, 0), hold=True),
]


def test_switch_table() -> None:
    run_cases([unit("switch_table", geometry(f), layout=asdict(f)) for f in LAYOUTS])


def test_switched_fir() -> None:
    layouts = [
        FilterLayout(3, (2,)),
        FilterLayout(3, (0, 4)),
        FilterLayout(4, (-3,)),
        FilterLayout(1, (5,)),
        FilterLayout(3, (0, -6), hold=True),
    ]
    run_cases(
        [
            unit(
                "switched_fir",
                {
                    "TAPS": layout.taps,
                    "DELAY": layout.delay,
                    "DEPTH": depth,
                    "HOLD": layout.hold,
                    "DATA_MAX": 255,
                    "SUM_MAX": 255 * layout.micro_image_size,
                    "BROADCAST_TAPS": broadcast_taps,
                },
                layout=asdict(layout),
                depth=depth,
                latency=2 if broadcast_taps else 1,
            )
            for layout, depth, broadcast_taps in product(layouts, (1, 2, 3, 7), (0, 2))
        ]
    )


def test_pixel_counter() -> None:
    run_cases([unit("pixel_counter", {"MODULUS": n}, modulus=n) for n in (1, 2, 5)])


def test_lane_skew() -> None:
    run_cases(
        [
            unit(
                "lane_skew",
                {"LANES": lanes, "WIDTH": 5, "REVERSED": backwards},
                lanes=lanes,
                backwards=backwards,
            )
            for lanes, backwards in product((1, 4), (False, True))
        ]
    )


def test_lane_exchange() -> None:
    run_cases([unit("lane_exchange", {"LANES": n, "WIDTH": 4}, lanes=n) for n in (1, 2, 5)])


def test_slice_select() -> None:
    run_cases(
        [
            unit(
                "slice_select",
                {"SLICES": slices, "SLICE_BITS": max((slices - 1).bit_length(), 1)},
                slices=slices,
            )
            for slices in (1, 2, 3, 256)
        ]
    )


def test_axis_fifo() -> None:
    run_cases(
        [
            unit(
                "axis_fifo",
                {"WIDTH": width, "ADDRESS_BITS": address_bits},
                width=width,
                address_bits=address_bits,
            )
            for width, address_bits in [(8, 1), (26, 3), (10, 5)]
        ]
    )


def test_tag_delay() -> None:
    run_cases(
        [
            unit("tag_delay", {"WIDTH": width, "LENGTH": length}, width=width, length=length)
            for width, length in [(1, 0), (3, 1), (5, 9)]
        ]
    )


def test_bus_crossing() -> None:
    run_cases([unit("bus_crossing", {"WIDTH": 24}, width=24)])


def test_row_scatter() -> None:
    cases = []
    # Two whose memory is just as large as it must be, two that need a few words more than half.
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
        cases.append(Case("scatter_ports", "core.scatter_bench", generics, case))
    run_cases(cases)
