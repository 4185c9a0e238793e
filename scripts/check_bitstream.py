# SPDX-License-Identifier: Apache-2.0
"""Check what a bitstream build of the Atlys needs, as far as that goes without ISE.

Usage: python scripts/check_bitstream.py
"""

import sys
from collections.abc import Sequence

from bitstream_check.checks import run_checks


def report(name: str, problems: Sequence[str], summary: str) -> None:
    """Print the result of a check: a line, and one for each problem."""
    print(f"{name:<12} {f'{len(problems)} problems' if problems else f'ok: {summary}'}")
    for problem in problems:
        print(f"  {problem}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(1 if run_checks(report) else 0)
