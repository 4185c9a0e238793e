# SPDX-License-Identifier: Apache-2.0
"""The steps of a build with open tools: progress, processor time, one-line errors."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from plenofir.ground.errors import InputError, ToolError

Progress = Callable[[str, int, int], None]
"""Called with the tool's name, how many are done, and how many there are."""

# Lines of nextpnr's log that show its stage, the last stage first.
_STAGES = (
    # Router 2 of Nexus and Gowin says "Routing.." only when it has ended.
    ("Routing..", "routing"),
    ("Running router2", "routing"),
    ("Running simulated annealing placer", "placing, last steps"),
    ("Running main analytical placer", "placing"),
    ("Packing", "packing"),
)


def _processor_seconds() -> float:
    """Processor time of all processes that this one started and that have ended."""
    used = os.times()
    return used.children_user + used.children_system


def run_steps(
    steps: Mapping[str, Callable[[], None]], work: Path, progress: Progress
) -> dict[str, float]:
    """Run the tools one after the other in a folder; processor time of each in seconds.

    InputError in a line if a tool fails.
    """
    seconds: dict[str, float] = {}
    for number, (name, step) in enumerate(steps.items()):
        progress(name, number, len(steps))
        begin = _processor_seconds()
        try:
            step()
        except ToolError as error:
            last = str(error).splitlines()[-1]
            raise InputError(f"{name} failed: {last}", where=str(work)) from None
        seconds[name] = round(_processor_seconds() - begin, 1)
    progress(name, len(steps), len(steps))
    return seconds


def nextpnr_stage(log: Path) -> str:
    """Stage that nextpnr is in, from its log."""
    text = log.read_text(errors="replace") if log.exists() else ""
    return next((stage for sign, stage in _STAGES if sign in text), "reading")
