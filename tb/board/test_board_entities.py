"""The board's control, entity by entity."""

import pytest

from plenofir_tb.runner import run_case


def run_unit(entity: str, generics: dict, **case: object) -> None:
    run_case(entity, "board.unit_bench", generics=generics, case={"entity": entity, **case})


@pytest.mark.parametrize("max_columns", [64, 640, 1279, 1280, 2000])
def test_i2c_rom_slave(max_columns: int) -> None:
    run_unit("i2c_rom_slave", {"MAX_COLUMNS": max_columns}, max_columns=max_columns)


def test_debouncer() -> None:
    run_unit("debouncer", {"STABLE": 20})
