# SPDX-License-Identifier: Apache-2.0
"""The board's control, entity by entity."""

from plenofir_tb.runner import Case, run_cases


def run_unit(entity: str, generics: dict, **case: object) -> None:
    run_cases([unit(entity, generics, **case)])


def unit(entity: str, generics: dict, **case: object) -> Case:
    return Case(entity, "board.unit_bench", generics, {"entity": entity, **case})


def test_i2c_rom_slave() -> None:
    run_cases(
        [
            unit("i2c_rom_slave", {"MAX_COLUMNS": columns}, max_columns=columns)
            for columns in (64, 640, 1279, 1280, 2000)
        ]
    )


def test_debouncer() -> None:
    run_unit("debouncer", {"STABLE": 20}, stable=20)


def test_board_control() -> None:
    case = {"slices": 3, "first_slice": 1, "bit_clocks": 8, "stable": 4, "switch_frames": 30}
    generics = {name.upper(): value for name, value in case.items()}
    generics |= {"OUTPUTS": 3, "WITH_TEXT": True}
    run_unit("board_control", {**generics, "STATUS": "clock=# rows=# taps=#.", "FIELDS": 3}, **case)
