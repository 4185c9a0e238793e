# SPDX-License-Identifier: Apache-2.0
"""Long lists of cases, of which ``make test`` takes some; ``make test-full`` takes all.

``make test`` sets the variable ``DRAWN``, prints it, and takes it from the command line: a run
with the same number takes the same cases. Where it is not set, all cases are taken.
"""

import os
import random
import re
from collections.abc import Sequence
from pathlib import Path


def drawn(names: Sequence[str], count: int) -> list[str]:
    """Those of the names that a run takes, in their order."""
    seed = os.environ.get("DRAWN")
    if not seed:
        return list(names)
    taken = set(random.Random(f"{seed} {' '.join(names)}").sample(list(names), count))
    return [name for name in names if name in taken]


def bench_filter(count: int, *benches: Path) -> str:
    """Filter for cocotb (``COCOTB_TEST_FILTER``) that takes `count` tests of benches."""
    text = "".join(bench.read_text() for bench in benches)
    names = re.findall(r"^@cocotb\.test\(.*\)\nasync def (\w+)", text, re.MULTILINE)
    return rf"\b({'|'.join(drawn(names, count))})$"
