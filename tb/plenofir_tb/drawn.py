# SPDX-License-Identifier: Apache-2.0
"""Long lists of cases, from which ``make test`` draws some; ``make test-full`` takes all.

``make test`` sets the variable ``DRAWN`` and prints it; given on the command line, the same number
draws the same cases. If it is not set, all cases are taken.
"""

import os
import random
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")


def drawn(cases: Sequence[T], count: int) -> list[T]:
    """The drawn cases of a list, in their order."""
    seed = os.environ.get("DRAWN")
    if not seed:
        return list(cases)
    rng = random.Random(f"{seed} {' '.join(map(str, cases))}")
    return [cases[place] for place in sorted(rng.sample(range(len(cases)), count))]


def bench_filter(count: int, *benches: Path) -> str:
    """Filter for cocotb (``COCOTB_TEST_FILTER``) that draws `count` tests of benches."""
    text = "".join(bench.read_text() for bench in benches)
    names = re.findall(r"^@cocotb\.test\(.*\)\nasync def (\w+)", text, re.MULTILINE)
    return rf"\b({'|'.join(drawn(names, count))})$"
