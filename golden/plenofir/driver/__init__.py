# SPDX-License-Identifier: Apache-2.0
"""The driver of a core behind a bus (docs/registers.md).

`Core` works over any object with ``read(address) -> int`` and ``write(address, value)``. Without
calibrations and distances nothing but Python's own library is used.
"""

from plenofir.driver.accesses import Memory, SerialBridge, Uio, Window, find_uio
from plenofir.driver.core import Core, Counters, Description
from plenofir.driver.registers import Access, Registers

__all__ = [
    "Access",
    "Core",
    "Counters",
    "Description",
    "Memory",
    "Registers",
    "SerialBridge",
    "Uio",
    "Window",
    "find_uio",
]
