# SPDX-License-Identifier: Apache-2.0
"""The module that cocotb runs: for each case the tests of its bench, on the case's entity.

A bench reads its case when it is imported, so each case gets a copy of the module.
"""

import functools
import gc
import importlib.util
import sys
from collections.abc import Callable, Coroutine
from typing import Any

from cocotb.regression import TestGenerator

from plenofir_tb.case import begin_case, load_cases

Function = Callable[..., Coroutine[Any, None, None]]


def _on_case(test: Function, number: int, case: dict[str, Any]) -> Function:
    @functools.wraps(test)
    async def run(dut: Any) -> None:
        begin_case(case)
        await test(getattr(dut, f"case_{number}"))

    return run


def _add_tests(number: int, case: dict[str, Any], bench: str, label: str) -> None:
    begin_case(case)
    spec = importlib.util.find_spec(bench)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[bench] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for generator in list(vars(module).values()):
        if isinstance(generator, TestGenerator):
            for test in generator.generate_tests():
                # cocotb seeds a test by its name, so names must be the same with other cases and
                # alone.
                test.name = f"{label}/{test.name}"
                test.func = _on_case(test.func, number, case)
                globals()[test.name] = test


for _number, _case in enumerate(load_cases()):
    _add_tests(_number, **_case)

# The search for reference cycles would take a tenth of the time, and there are hardly any.
gc.freeze()
gc.set_threshold(100_000)
