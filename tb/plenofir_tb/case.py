# SPDX-License-Identifier: Apache-2.0
"""The case of a running testbench; few imports, as every bench imports it."""

import json
import os
from pathlib import Path
from typing import Any

CASES_VARIABLE = "PLENOFIR_CASES"
"""Environment variable: file with the cases of a simulation."""
_running: dict[str, Any] = {}


def load_cases() -> list[dict[str, Any]]:
    """Cases of this simulation, in order."""
    cases: list[dict[str, Any]] = json.loads(Path(os.environ[CASES_VARIABLE]).read_text())
    return cases


def begin_case(case: dict[str, Any]) -> None:
    """Make a case the current one, which `read_case` returns."""
    global _running
    _running = case


def read_case() -> dict[str, Any]:
    """The current case: the `case` of its `plenofir_tb.runner.Case`."""
    return _running
