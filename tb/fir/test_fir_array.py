# SPDX-License-Identifier: Apache-2.0
"""The filter array by itself: exact, with the clock counts of the formulas."""

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.refocus import StoredProductArithmetic
from plenofir_studies.clock_counts import SIMULATED
from plenofir_tb.runner import Case, run_cases


def array_case(core: CoreConfiguration, columns: int, rows: int) -> Case:
    core.check_limits()
    return Case(
        "array_ports",
        "fir.array_bench",
        core.generics(),
        {
            "core": core.model_dump(mode="json"),
            "columns": columns,
            "rows": rows,
        },
    )


def test_clock_counts() -> None:
    for case in SIMULATED:
        if case.core.parallel_rows == case.rows and case.core.shifts == (1,):
            assert case.first_frame <= case.thesis_first_frame
            assert case.next_frame <= case.thesis_next_frame
    run_cases([array_case(case.core, case.columns, case.rows) for case in SIMULATED])


def test_slices_and_idle_clocks() -> None:
    cores = [
        CoreConfiguration(
            micro_image_size=3,
            shifts=(-2, 4),
            max_columns=14,
            channels=3,
            engine=FirEngine(parallel_rows=4),
        ),
        CoreConfiguration(
            micro_image_size=2,
            shifts=(3, 0, -1),
            max_columns=9,
            order=1,
            engine=FirEngine(parallel_rows=5, broadcast_taps=2),
            arithmetic=StoredProductArithmetic(),
        ),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(0,),
            max_columns=7,
            align="causal",
            engine=FirEngine(parallel_rows=2, hold=True),
        ),
        CoreConfiguration(
            micro_image_size=5, shifts=(7,), max_columns=6, engine=FirEngine(parallel_rows=9)
        ),
        CoreConfiguration(
            micro_image_size=4,
            shifts=(-3, 2),
            boxes=(3, 2),
            max_columns=9,
            engine=FirEngine(parallel_rows=3),
        ),
    ]
    run_cases([array_case(core, core.max_columns, 2 * core.micro_image_size + 3) for core in cores])
