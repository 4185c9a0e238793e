# SPDX-License-Identifier: Apache-2.0
"""Check the VHDL sources for constructs that XST is known to refuse or to interpret otherwise.

Usage: python scripts/lint_xst.py

If NVC is installed, it analyses the core too, as a second strict reader of VHDL-93.
"""

import subprocess
import sys
import tempfile

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise import xst_script
from plenofir.fpga.bitstream.ise_project import project_tcl
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.errors import InputError
from xst_lint import lint, loop_limit


def refused_by_nvc() -> str:
    """What NVC says of the core, if it is there and refuses it."""
    try:
        nvc = find_simulator("nvc")
    except InputError:
        return ""
    command = nvc.build_commands(hdl.hdl_sources(), "raster_refocuser")[0]
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return process.stderr if process.returncode else ""


def main() -> int:
    """Print what is found."""
    # The least of both forms in which XST gets its options: a script, a project's properties.
    limit = min(map(loop_limit, (xst_script(), project_tcl())))
    findings = [*map(str, lint(hdl.board_sources(), limit)), refused_by_nvc()]
    lines = [line for line in findings if line]
    if lines:
        print(*lines, sep="\n", file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
