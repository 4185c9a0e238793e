# SPDX-License-Identifier: Apache-2.0
"""The board's control, entity by entity, in one simulation."""

import pytest

from plenofir_tb.runner import Case, run_cases


def unit(entity: str, generics: dict, **case: object) -> Case:
    bench = "board_control" if entity == "board_control" else "unit"
    return Case(entity, f"board.{bench}_bench", generics, {"entity": entity, **case})


CONTROL = {"slices": 3, "first_slice": 1, "bit_clocks": 8, "stable": 4, "switch_frames": 30}
UNITS = [
    *(
        unit(
            "i2c_rom_slave",
            {"MAX_COLUMNS": columns, "LET_GO": 2000},
            max_columns=columns,
            let_go=2000,
        )
        for columns in (64, 640, 1279, 1280, 2000)
    ),
    unit("camera_report", {"COUNT_BITS": 8}),
    unit("debouncer", {"STABLE": 20}, stable=20),
    *(
        unit(
            "demo_control",
            {"SLICES": slices, "FRAMES": frames, "BUTTON_STABLE": 3},
            **{"slices": slices, "frames": frames, "stable": 3},
        )
        for slices, frames in ((1, 2), (2, 1), (5, 3))
    ),
    unit(
        "reset_filter",
        {"ASSERT_CLOCKS": 5, "RELEASE_CLOCKS": 30},
        assert_clocks=5,
        release_clocks=30,
    ),
    unit("hot_plug", {"PAUSE": 50}, pause=50),
    unit(
        "board_control",
        {
            **{name.upper(): value for name, value in CONTROL.items()},
            **{"OUTPUTS": 3, "WITH_TEXT": True, "FIELDS": 3},
            "STATUS": "clock=# rows=# taps=#.",
        },
        **CONTROL,
    ),
]


# `make mutants` chooses by the names of entities.
@pytest.mark.parametrize(
    "cases",
    [UNITS],
    ids=["i2c_rom_slave-camera_report-debouncer-demo_control-reset_filter-hot_plug-board_control"],
)
def test_unit(cases: list[Case]) -> None:
    run_cases(cases)
