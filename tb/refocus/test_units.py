"""The parts of the refocuser, each on its own."""

import pytest

from plenofir.refocus import output_delay, tap_count
from plenofir_tb.runner import run_case


def run_unit(entity: str, generics: dict, **case: object) -> None:
    run_case(entity, "refocus.unit_bench", generics=generics, case={"entity": entity, **case})


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


@pytest.mark.parametrize("m", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("shift", [-5, -1, 0, 1, 2, 7])
def test_switch_table(m: int, shift: int) -> None:
    run_unit(
        "switch_table",
        {"MICRO_IMAGE_SIZE": m, "SHIFT": shift, "TAPS": tap_count(m, shift)},
        m=m,
        shift=shift,
    )


@pytest.mark.parametrize("depth", [1, 2, 3, 7])
@pytest.mark.parametrize(("m", "shift"), [(3, 2), (3, 0), (4, -3), (1, 5)])
def test_switched_fir(m: int, shift: int, depth: int) -> None:
    run_unit(
        "switched_fir",
        {
            "TAPS": tap_count(m, shift),
            "DELAY": output_delay(m, shift),
            "DEPTH": depth,
            "DATA_MAX": 255,
            "SUM_MAX": 255 * m,
        },
        m=m,
        shift=shift,
        depth=depth,
    )


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
