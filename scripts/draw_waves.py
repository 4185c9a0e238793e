# SPDX-License-Identifier: Apache-2.0
"""Draw the timing diagrams of docs/waves.md from simulations of the row module in GHDL.

Usage: python scripts/draw_waves.py
"""

import sys
import tempfile
from pathlib import Path

from plenofir import project
from plenofir.errors import EXIT_BAD_INPUT, EXIT_TOOL_FAILED, InputError
from plenofir.fpga.simulate.module_waves import RowBench, timing_diagrams
from plenofir.fpga.tools.simulators import SimulationError

FOLDER = project.root() / "docs" / "images" / "waves"


def main() -> int:
    """Write the drawings, all or none."""
    try:
        with tempfile.TemporaryDirectory() as work:
            drawings = timing_diagrams(RowBench(Path(work)))
    except (InputError, SimulationError) as error:
        print(f"draw_waves: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT if isinstance(error, InputError) else EXIT_TOOL_FAILED
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, drawing in drawings.items():
        (FOLDER / name).write_text(drawing)
        print(f"{(FOLDER / name).relative_to(project.root())}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
