# SPDX-License-Identifier: Apache-2.0
"""What brings the link up and watches it, entity by entity."""

import pytest

from plenofir_tb.runner import Case, run_case, run_cases

PHASE = {"filter": 5, "interval": 40, "quiet": 16, "timeout": 100}


def run_unit(entity: str, **case: int) -> None:
    """Run the bench; the entity's generics are among what the case says."""
    generics = {name.upper(): value for name, value in case.items() if name != "faults"}
    case_and_name = {"entity": entity, **case}
    bench = "phase_bench" if entity == "phase_detector_control" else "link_bench"
    run_case(entity, f"board.{bench}", generics=generics, case=case_and_name)


def test_link_supervisor() -> None:
    run_unit("link_supervisor", counts_10_mhz=100, timeout=300, patience=5)


def test_pll_configure() -> None:
    run_unit("pll_configure", timeout=60)


def test_frame_rate_meter() -> None:
    run_unit("frame_rate_meter", tick=2)


def test_clock_meter() -> None:
    run_unit("clock_meter", window=400)


def test_event_counter() -> None:
    run_unit("event_counter", width=3)


def test_phase_detector_control() -> None:
    run_unit("phase_detector_control", **PHASE, faults=20)


@pytest.mark.slow
def test_many_hung_delay_lines() -> None:
    run_unit("phase_detector_control", **PHASE, faults=2000)


def run_search(bit_taps: list[int], late_step: int) -> None:
    case = {"entity": "phase_search", "timeout": 150, "bit_taps": bit_taps, "late_step": late_step}
    run_case("phase_search", "board.search_bench", generics={"TIMEOUT": 150}, case=case)


def test_phase_search() -> None:
    # From 720p60 (1347 ps, 25 ps a tap) to longer than the delay line.
    run_search([54, 160], 4)


@pytest.mark.slow
def test_phase_search_of_many_bits() -> None:
    run_search([*range(50, 180, 10)], 1)


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

    # From 24 MHz and up to 74.25 MHz, of those that the range has.
    run_cases(
        [
            control(generics, case),
            of_range(2, [(40, 0), (42, 1), (73, 1), (77, 0)]),
            of_range(3, [(26, 0), (29, 1), (51, 1), (54, 0)]),
            of_range(4, [(19, 0), (22, 1), (38, 1), (41, 0)]),
        ]
    )
