"""Hold the VHDL sources against what XST is known to refuse or to take otherwise.

Usage: python scripts/lint_xst.py
"""

import sys

from plenofir.fpga import hdl
from plenofir.fpga.xst_lint import lint


def main() -> int:
    """Print what is found."""
    findings = lint(hdl.board_sources())
    for finding in findings:
        print(finding, file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
