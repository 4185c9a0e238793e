# SPDX-License-Identifier: Apache-2.0
"""Ports read in every clock."""

from collections.abc import Callable
from typing import Any


def levels(port: Any) -> Callable[[], str]:
    """Read a port's bits as text, the leftmost one first.

    The simulator's own call takes 0.1 to 1 us; `port.value`, which calls it, 3 to 8 us.
    """
    read: Callable[[], str] = port._handle.get_signal_val_binstr
    return read
