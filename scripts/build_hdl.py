# SPDX-License-Identifier: Apache-2.0
"""Build generated sources: computed VHDL packages, repeated ports, core files.

Usage: python scripts/build_hdl.py [--check]

With --check nothing is written; exit code 1 if a file is missing or stale.
"""

import re
import sys
from pathlib import Path

from core_files import core_files
from marks_hdl import MARKS_PACKAGE, marks_package
from plenofir.fpga.hdmi.edid import edid_package
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, screen_package
from plenofir.fpga.screen.chip_light_field import STORED_PACKAGE, stored_package
from plenofir.ground import project
from plenofir.plan.sensor.board_camera import CAMERA_PACKAGE, camera_package
from plenofir.plan.sensor.board_sensor import SENSOR_PACKAGE, sensor_package

sys.path.insert(0, str(project.root() / "tb"))

from plenofir_tb.hdmi.colour import colour_package
from plenofir_tb.hdmi.pll import settings_package
from plenofir_tb.hdmi.status import status_package

HDL = project.root() / "hdl"
MODELS = HDL / "sim"

COMPONENTS_PACKAGE = """\
-- The {family} primitives that boards use, declared as in {vendor}'s library of this name;
-- built by scripts/build_hdl.py from the entities of the models.
--
-- For simulation without {vendor}'s tools: a small library `{library}` with behavioural models,
-- written from {documents}. Ports and generics have {vendor}'s names; only those in use
-- are here. Each model says at its head what it leaves out.

library ieee;
use ieee.std_logic_1164.all;

package {package} is

{components}

end package {package};
"""
LIBRARIES = {
    "unisim": {
        "family": "Spartan-6 and 7-series",
        "vendor": "Xilinx",
        "package": "vcomponents",
        "documents": "UG381, UG382, UG471, UG472, UG615 and XAPP879",
    },
    "ecp5u": {
        "family": "ECP5",
        "vendor": "Lattice",
        "package": "components",
        "documents": "FPGA-TN-02035 and FPGA-TN-02200",
    },
    "gw2a": {
        "family": "GW2A",
        "vendor": "Gowin",
        "package": "components",
        "documents": "UG286 and UG289",
    },
    "lifcl": {
        "family": "CrossLink-NX",
        "vendor": "Lattice",
        "package": "components",
        "documents": "the cells that Yosys declares",
    },
}


def components_package(library: str) -> tuple[Path, str]:
    """Make the package with the components of a library of models, place and text."""
    components = []
    for path in sorted((MODELS / library).glob("*.vhd")):
        entity = re.search(r"^entity (\w+) is\n(.*?)^end entity", path.read_text(), re.S | re.M)
        if entity is None:
            # A package.
            continue
        name, clauses = entity.groups()
        component = f"component {name} is\n{clauses}end component {name};"
        components.append(re.sub(r"^(?=.)", "  ", component, flags=re.M))
    words = LIBRARIES[library]
    text = COMPONENTS_PACKAGE.format(library=library, components="\n\n".join(components), **words)
    return MODELS / library / f"{words['package']}.vhd", text


def packages() -> dict[Path, str]:
    """Make the packages, place to text."""
    return {
        HDL / "link" / "edid_pkg.vhd": edid_package(),
        HDL / "video" / f"{SCREEN_PACKAGE}.vhd": screen_package(),
        HDL / "video" / f"{SENSOR_PACKAGE}.vhd": sensor_package(),
        HDL / "path" / f"{CAMERA_PACKAGE}.vhd": camera_package(),
        HDL / "video" / f"{STORED_PACKAGE}.vhd": stored_package(),
        HDL / "control" / "status_pkg.vhd": status_package(),
        HDL / "video" / "colour_pkg.vhd": colour_package(),
        HDL / "video" / f"{MARKS_PACKAGE}.vhd": marks_package(),
        HDL / "spartan6" / "pll_settings_pkg.vhd": settings_package(),
        **dict(components_package(library) for library in LIBRARIES),
    }


def main() -> int:
    """Write or check the files."""
    files = {
        **packages(),
        **core_files(),
    }
    stale = {p for p, text in files.items() if not p.exists() or p.read_text() != text}
    if "--check" in sys.argv[1:]:
        for path in sorted(stale):
            print(
                f"{path.relative_to(project.root())} is stale; run scripts/build_hdl.py",
                file=sys.stderr,
            )
        return 1 if stale else 0
    for path in stale:
        path.write_text(files[path])
    return 0


if __name__ == "__main__":
    sys.exit(main())
