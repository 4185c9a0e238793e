# SPDX-License-Identifier: Apache-2.0
"""What nextpnr makes of the core of a scene with 1 to 32 pixels a clock: ``data/pixels.json``."""

import json

from plenofir.fpga.synthesis.ecp5 import Placed
from plenofir.ground.files import write_file
from plenofir_studies import DATA

SCENE = "video-m11"
FILE = DATA / "pixels.json"
DEVICE, GRADE = "85k", 6


def load_placed() -> dict[int, Placed]:
    """Read the file: pixels a clock to what nextpnr made of them."""
    content = json.loads(FILE.read_text())
    return {int(pixels): Placed.model_validate(placed) for pixels, placed in content.items()}


def save_placed(placed: dict[int, Placed]) -> None:
    """Write the file, a core a line."""
    lines = [f'  "{p}": {json.dumps(placed[p].model_dump())}' for p in sorted(placed)]
    write_file(FILE, "{\n" + ",\n".join(lines) + "\n}\n")
