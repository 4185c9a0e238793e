"""The filter array by itself: exact, and as many clocks as the formulas say."""

import pytest

from plenofir.fpga.core.clock_counts import SIMULATED, ClockCase
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.refocus import StoredProductArithmetic
from plenofir_tb.runner import run_case


def run_array(core: CoreConfiguration, columns: int, rows: int, *, deskew: bool = False) -> None:
    core.check_limits()
    run_case(
        "fir_array",
        "fir.array_bench",
        generics={**core.generics(), "DESKEW": deskew},
        case={
            "core": core.model_dump(mode="json"),
            "columns": columns,
            "rows": rows,
            "deskew": deskew,
        },
    )


@pytest.mark.parametrize(
    "case",
    SIMULATED,
    ids=lambda case: (
        f"{case.columns}x{case.rows}_M{case.core.micro_image_size}"
        f"_shift{case.core.shifts[0]}_iota{case.core.parallel_rows}"
    ),
)
def test_clock_counts(case: ClockCase) -> None:
    run_array(case.core, case.columns, case.rows)
    if case.core.parallel_rows == case.rows and case.core.shifts == (1,):
        assert case.first_frame <= case.thesis_first_frame
        assert case.next_frame <= case.thesis_next_frame


@pytest.mark.parametrize("deskew", [False, True])
@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(
            micro_image_size=3, shifts=(-2, 4), max_columns=14, parallel_rows=4, channels=3
        ),
        CoreConfiguration(
            micro_image_size=2,
            shifts=(3, 0, -1),
            max_columns=9,
            parallel_rows=5,
            order=1,
            broadcast_taps=2,
            arithmetic=StoredProductArithmetic(),
        ),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(0,),
            max_columns=7,
            parallel_rows=2,
            align="causal",
            hold=True,
        ),
        CoreConfiguration(micro_image_size=5, shifts=(7,), max_columns=6, parallel_rows=9),
    ],
    ids=lambda core: f"M{core.micro_image_size}_slices{len(core.shifts)}_iota{core.parallel_rows}",
)
def test_slices_idle_clocks_deskew(core: CoreConfiguration, deskew: bool) -> None:
    run_array(core, core.max_columns, 2 * core.micro_image_size + 3, deskew=deskew)
