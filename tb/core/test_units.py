"""The parts of the refocuser, each on its own."""

from dataclasses import asdict

import pytest

from plenofir.fpga.synthesis.estimate import block_sizes
from plenofir.refocus import FilterLayout
from plenofir_tb.runner import run_case


def run_unit(entity: str, generics: dict, **case: object) -> None:
    run_case(entity, "core.unit_bench", generics=generics, case={"entity": entity, **case})


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("m", [1, 2, 3, 4, 5, 7, 8, 11, 15, 128])
def test_divide_round(m: int, bits: int) -> None:
    divisor = m * m
    largest = divisor * (2**bits - 1)
    run_unit(
        "divide_round",
        {"VALUE_MAX": largest, "DIVISOR": divisor, "QUOTIENT_BITS": bits},
        value_max=largest,
        divisor=divisor,
    )


@pytest.mark.parametrize(
    ("width", "words"), [(2, 1), (8, 700), (8, 5000), (9, 4099), (24, 6656), (1, 40000)]
)
def test_ram_blocks(width: int, words: int) -> None:
    blocks = block_sizes(words, width)
    run_unit(
        "ram_blocks", {"WIDTH": width, "WORDS": words}, width=width, words=words, blocks=blocks
    )


@pytest.mark.parametrize(("value_max", "drop", "bits"), [(1000, 0, 8), (5000, 4, 8), (2047, 3, 8)])
def test_round_saturate(value_max: int, drop: int, bits: int) -> None:
    run_unit(
        "round_saturate",
        {"VALUE_MAX": value_max, "DROP_BITS": drop, "RESULT_BITS": bits},
        value_max=value_max,
        drop_bits=drop,
        result_bits=bits,
    )


@pytest.mark.parametrize(
    ("value_bits", "scale_bits", "divisor"),
    [(8, 0, 3), (8, 8, 5), (10, 6, 7), (8, 3, 1), (8, 0, 2)],
)
def test_stored_product(value_bits: int, scale_bits: int, divisor: int) -> None:
    product_bits = round((2**value_bits - 1) * 2**scale_bits / divisor + 0.5).bit_length()
    run_unit(
        "stored_product",
        {
            "VALUE_BITS": value_bits,
            "PRODUCT_BITS": product_bits,
            "SCALE_BITS": scale_bits,
            "DIVISOR": divisor,
        },
        value_bits=value_bits,
        scale_bits=scale_bits,
        divisor=divisor,
    )


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


def layout_name(layout: FilterLayout) -> str:
    shifts = "_".join(map(str, layout.shifts))
    return f"M{layout.micro_image_size}_{shifts}_{layout.align}{'_hold' * layout.hold}"


@pytest.mark.parametrize("layout", LAYOUTS, ids=layout_name)
def test_switch_table(layout: FilterLayout) -> None:
    run_unit("switch_table", geometry(layout), layout=asdict(layout))


@pytest.mark.parametrize("broadcast_taps", [0, 2])
@pytest.mark.parametrize("depth", [1, 2, 3, 7])
@pytest.mark.parametrize(
    "layout",
    [
        FilterLayout(3, (2,)),
        FilterLayout(3, (0, 4)),
        FilterLayout(4, (-3,)),
        FilterLayout(1, (5,)),
        FilterLayout(3, (0, -6), hold=True),
    ],
    ids=layout_name,
)
def test_switched_fir(layout: FilterLayout, depth: int, broadcast_taps: int) -> None:
    run_unit(
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


@pytest.mark.parametrize("modulus", [1, 2, 5])
def test_pixel_counter(modulus: int) -> None:
    run_unit("pixel_counter", {"MODULUS": modulus}, modulus=modulus)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("lanes", [1, 4])
def test_lane_skew(lanes: int, backwards: bool) -> None:
    generics = {"LANES": lanes, "WIDTH": 5, "REVERSED": backwards}
    run_unit("lane_skew", generics, lanes=lanes, backwards=backwards)


@pytest.mark.parametrize("lanes", [1, 2, 5])
def test_lane_exchange(lanes: int) -> None:
    run_unit("lane_exchange", {"LANES": lanes, "WIDTH": 4}, lanes=lanes)


@pytest.mark.parametrize("slices", [1, 2, 3, 256])
def test_slice_select(slices: int) -> None:
    generics = {"SLICES": slices, "SLICE_BITS": max((slices - 1).bit_length(), 1)}
    run_unit("slice_select", generics, slices=slices)


@pytest.mark.parametrize(("width", "address_bits"), [(8, 1), (26, 3), (10, 5)])
def test_axis_fifo(width: int, address_bits: int) -> None:
    run_unit(
        "axis_fifo",
        {"WIDTH": width, "ADDRESS_BITS": address_bits},
        width=width,
        address_bits=address_bits,
    )


@pytest.mark.parametrize(("width", "length"), [(1, 0), (3, 1), (5, 9)])
def test_tag_delay(width: int, length: int) -> None:
    run_unit("tag_delay", {"WIDTH": width, "LENGTH": length}, width=width, length=length)
