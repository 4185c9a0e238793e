# SPDX-License-Identifier: Apache-2.0
"""How many threads or processes to start."""

import os


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
