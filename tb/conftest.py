# SPDX-License-Identifier: Apache-2.0
"""The environment of the testbenches; the longest tests come first."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from plenofir_tb import compiled
from plenofir_tb.drawn import drawn
from plenofir_tb.faults import STALE, stale_faults

# Longest first, so that all workers finish together.
LONGEST = (
    "test_chain",
    "test_refocus_video",
    "test_all_in_focus_and_depth",
    "test_raw_aligned",
    "test_capture_swept",
    "test_index_and_picture",
    "test_figures",
    "test_netlist",
    "test_random",
)
# Variables that select GHDL or simulator must not leak into the next tests.
_AT_START = {name: os.environ.get(name) for name in ("GHDL_BACKEND", "SIM", "SEED", "PATH")}


@pytest.fixture(autouse=True)
def environment() -> Iterator[None]:
    """Restore the environment around each test."""
    assert {name: os.environ.get(name) for name in _AT_START} == _AT_START
    yield
    assert {name: os.environ.get(name) for name in _AT_START} == _AT_START


def is_bench(item: pytest.Item) -> bool:
    """Whether a test is a testbench, not one of the golden model."""
    return item.path.is_relative_to(Path(__file__).parent)


def leave_out(items: list[pytest.Item]) -> list[pytest.Item]:
    """Tests marked ``drawn`` that this run leaves out, see `plenofir_tb.drawn`."""
    groups: dict[str, list[str]] = {}
    counts: dict[str, int] = {}
    for item in items:
        mark = item.get_closest_marker("drawn")
        if mark and not item.get_closest_marker("slow"):
            # Functions that share a list have its name in their marks.
            group = mark.args[1] if len(mark.args) > 1 else item.nodeid.partition("[")[0]
            groups.setdefault(group, []).append(item.nodeid)
            counts[group] = mark.args[0]
    left_out = {
        name
        for group, names in groups.items()
        for name in set(names) - set(drawn(names, min(counts[group], len(names))))
    }
    return [item for item in items if item.nodeid in left_out]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    config.stash[STALE] = stale_faults(item for item in items if is_bench(item))
    left_out = leave_out(items)
    if left_out:
        items[:] = [item for item in items if item not in left_out]
        config.hook.pytest_deselected(items=left_out)

    def is_short(item: pytest.Item) -> bool:
        return not is_bench(item) or not any(name in item.name for name in LONGEST)

    items.sort(key=is_short)


def pytest_collection_finish(session: pytest.Session) -> None:
    compiled.many = sum(map(is_bench, session.items)) > 100
