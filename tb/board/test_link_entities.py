# SPDX-License-Identifier: Apache-2.0
"""Link start-up and supervision, entity by entity."""

import pytest

from plenofir_tb.runner import Case, run_case, run_cases


def unit(entity: str, bench: str = "link", **case: int) -> Case:
    """The entity's generics are among what the case says."""
    generics = {name.upper(): value for name, value in case.items() if name != "faults"}
    return Case(entity, f"board.{bench}_bench", generics, {"entity": entity, **case})


def phases(faults: int) -> Case:
    times = {"filter": 5, "interval": 40, "quiet": 16, "timeout": 100}
    return unit("phase_detector_control", "phase", **times, faults=faults)


def search(bit_taps: list[int], late_step: int) -> Case:
    times = {"timeout": 150, "error_limit": 30, "error_window": 20_000}
    case = {"entity": "phase_search", **times, "bit_taps": bit_taps, "late_step": late_step}
    generics = {name.upper(): value for name, value in times.items()}
    return Case("phase_search", "board.search_bench", generics, case)


UNITS = [
    unit("link_supervisor", counts_10_mhz=100, timeout=300, patience=5, hold=15),
    unit("pll_configure", timeout=60),
    unit("frame_rate_meter", tick=2),
    unit("clock_meter", window=400),
    phases(20),
    # From 720p60 (1347 ps, 25 ps a tap) to longer than the delay line.
    search([54, 160], 4),
]


# `make mutants` chooses by the names of entities.
@pytest.mark.parametrize(
    "cases",
    [
        UNITS,
        pytest.param(
            [phases(2000), search([*range(50, 180, 10)], 1)],
            marks=pytest.mark.slow,
            id="many-phase_detector_control-phase_search",
        ),
    ],
    ids=lambda cases: "-".join(case.top for case in cases),
)
def test_unit(cases: list[Case]) -> None:
    run_cases(cases, long=True)


def test_hdmi_control() -> None:
    case = {"slices": 3, "meter_window": 320, "data_patience": 150, "bit_clocks": 6}
    generics = {name.upper(): value for name, value in case.items()}

    def of_range(clocks: int, runs: list[tuple[int, int]]) -> Case:
        return control(
            {**generics, "METER_WINDOW": 1600, "CLOCK_RANGE": clocks},
            {**case, "meter_window": 1600, "runs": runs},
        )

    def control(generics: dict, case: dict) -> Case:
        values = {"entity": "hdmi_control_bench", **case}
        return Case("hdmi_control_bench", "board.control_bench", generics, values)

    # The modes from 24 to 74.25 MHz in the range.
    run_cases(
        [
            control(generics, case),
            of_range(2, [(40, 0), (42, 1), (73, 1), (77, 0)]),
            of_range(3, [(26, 0), (29, 1), (49, 1), (52, 0)]),
            of_range(4, [(19, 0), (22, 1), (38, 1), (41, 0)]),
        ]
    )


@pytest.mark.slow
def test_a_monitor_may_stretch_for_30_ms() -> None:
    """At any frequency of the control's clock; the lowest takes the fewest clocks."""
    case = {"entity": "hdmi_control_bench", "runs": [], "stretch": 30 * 5 * 1000, "pause": 20_000}
    run_case("hdmi_control_bench", "board.control_bench", generics={"CONTROL_MHZ": 5}, case=case)
