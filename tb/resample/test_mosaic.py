"""The interpolation of colour filter mosaics in VHDL, against the bit-true model."""

from plenofir_tb.runner import Case, run_cases


def test_mosaic() -> None:
    run_cases(
        [
            Case(
                "colour_mosaic",
                "resample.mosaic_bench",
                {"MAX_COLUMNS": columns, "PIXEL_BITS": bits},
                {"max_columns": columns, "pixel_bits": bits},
            )
            for columns, bits in ((9, 8), (8, 12))
        ]
    )
