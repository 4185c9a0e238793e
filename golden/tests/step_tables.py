# SPDX-License-Identifier: Apache-2.0
"""Block RAM of parts of a core."""

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family


def block_rams_of_steps(core: CoreConfiguration, family: Family) -> int:
    """Block RAMs of the tables of steps of moving sums, which recorded cores may lack."""
    memories = core.engine.memories(core)
    steps = [memory.usage(family) for memory in memories if memory.name == "steps"]
    return sum(steps, Usage()).block_rams
