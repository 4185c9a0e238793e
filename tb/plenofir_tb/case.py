# SPDX-License-Identifier: Apache-2.0
"""What a running testbench is to do; light, as every bench imports it."""

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
    """Make a case the one that `read_case` gives."""
    global _running
    _running = case


def read_case() -> dict[str, Any]:
    """What the testbench is to do: the `case` of its `plenofir_tb.runner.Case`."""
    return _running
