# SPDX-License-Identifier: Apache-2.0
"""Makes the testbench packages importable; the longest tests come first."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

# So that all workers finish together.
LONGEST = (
    "test_chain",
    "test_refocus_video",
    "test_figures",
    "test_netlist",
    "test_random",
)
# Which GHDL, which simulator: what a test leaves behind here, the next ones would use.
_AT_START = {name: os.environ.get(name) for name in ("GHDL_BACKEND", "SIM", "SEED", "PATH")}


@pytest.fixture(autouse=True)
def environment() -> Iterator[None]:
    """No test begins or ends with another environment than the first one had."""
    assert {name: os.environ.get(name) for name in _AT_START} == _AT_START
    yield
    assert {name: os.environ.get(name) for name in _AT_START} == _AT_START


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def is_short(item: pytest.Item) -> bool:
        return not item.path.is_relative_to(Path(__file__).parent) or not any(
            name in item.name for name in LONGEST
        )

    items.sort(key=is_short)
