# SPDX-License-Identifier: Apache-2.0
"""Makes the testbench packages importable; the longest tests come first."""

import sys
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
    "-11]",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def is_short(item: pytest.Item) -> bool:
        return not item.path.is_relative_to(Path(__file__).parent) or not any(
            name in item.name for name in LONGEST
        )

    items.sort(key=is_short)
