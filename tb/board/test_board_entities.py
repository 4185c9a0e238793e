"""The board's control, entity by entity."""

from plenofir_tb.runner import run_case


def run_unit(entity: str, generics: dict, **case: object) -> None:
    run_case(entity, "board.unit_bench", generics=generics, case={"entity": entity, **case})


def test_i2c_rom_slave() -> None:
    run_unit("i2c_rom_slave", {})


def test_debouncer() -> None:
    run_unit("debouncer", {"STABLE": 20})
