# SPDX-License-Identifier: Apache-2.0
"""Places the core of the scene video-m11 with 1 to 32 pixels a clock, for data/pixels.json.

What the file has already is left as it is. Arguments: pixels a clock (all if there are none), which
are then measured anew.
"""

import sys
import tempfile
from pathlib import Path

from plenofir.errors import EXIT_TOOL_FAILED, ToolError
from plenofir.fpga import hdl
from plenofir.fpga.core.moving_sum_engine import PIXELS_PER_CLOCK
from plenofir.fpga.synthesis.ecp5 import Placed, check_tools, make_netlist, place
from plenofir.plan import load_scene, make_plan
from plenofir.plan.figures import CORE
from plenofir_studies.many_pixels import WITH_PINS, package, scene_core
from plenofir_studies.placed_pixels import DEVICE, FILE, GRADE, SCENE, load_placed, save_placed


def _known() -> dict[int, Placed]:
    return load_placed() if FILE.exists() else {}


def main() -> int:
    """Write the file, after each core."""
    check_tools()
    wanted = [int(text) for text in sys.argv[1:]]
    plan = make_plan(load_scene(SCENE))
    for pixels in PIXELS_PER_CLOCK:
        known = _known()
        if (pixels not in wanted) if wanted else (pixels in known):
            continue
        core = scene_core(plan, pixels)
        with tempfile.TemporaryDirectory() as folder:
            netlist = make_netlist(
                hdl.hdl_sources(),
                CORE,
                core.generics(),
                Path(folder),
                behind_few_pins=pixels > WITH_PINS,
            )
            try:
                placed = place(netlist, speed_grade=GRADE, device=DEVICE, package=package(pixels))
            except ToolError as error:
                print(f"place_pixels: {pixels} pixels a clock: {error}", file=sys.stderr)
                return EXIT_TOOL_FAILED
        print(f"{pixels} pixels a clock: {placed}", flush=True)
        save_placed({**_known(), pixels: placed})
    return 0


if __name__ == "__main__":
    sys.exit(main())
