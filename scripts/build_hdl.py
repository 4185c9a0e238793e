"""Build the VHDL packages whose contents Python computes.

Usage: python scripts/build_hdl.py [--check]

With --check nothing is written; exit code 1 if a package is missing or stale.
"""

import sys

from plenofir import project
from plenofir.fpga.hdmi.edid import edid_package
from plenofir.fpga.hdmi.pll import settings_package


def main() -> int:
    """Write or check the packages."""
    hdl = project.root() / "hdl"
    packages = {
        hdl / "board" / "edid_pkg.vhd": edid_package(),
        hdl / "board" / "pll_settings_pkg.vhd": settings_package(),
    }
    stale = {p for p, text in packages.items() if not p.exists() or p.read_text() != text}
    if "--check" in sys.argv[1:]:
        for path in sorted(stale):
            print(
                f"{path.relative_to(project.root())} is stale; run scripts/build_hdl.py",
                file=sys.stderr,
            )
        return 1 if stale else 0
    for path in stale:
        path.write_text(packages[path])
    return 0


if __name__ == "__main__":
    sys.exit(main())
