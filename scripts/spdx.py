# SPDX-License-Identifier: Apache-2.0
"""Put the licence at the head of sources that lack it: one line, below a ``#!`` line.

Usage: python scripts/spdx.py [--check]

With --check nothing is written; exit code 1 if a source lacks it. Sources are what git knows of
the kinds below, but for VHDL that scripts/build_hdl.py writes. REUSE.toml tells of all other files.
"""

import subprocess
import sys
from pathlib import Path

from build_hdl import packages
from plenofir.ground import project

ROOT = project.root()
OF_OTHERS = ROOT / "docs" / "site"
# In two parts: reuse would read it as this file's own.
LINE = "SPDX-License-" + "Identifier: Apache-2.0"
STYLES = {
    **dict.fromkeys((".py", ".sh", ".yml", ".yaml", ".lpf", ".ucf", "Makefile", "run"), "# {}"),
    **dict.fromkeys((".v", ".vh", ".sv", ".cpp", ".js", ".cst"), "// {}"),
    ".vhd": "-- {}",
    ".css": "/* {} */",
}


def style_of(path: Path) -> str | None:
    """How a source of this kind has a comment; None if it is not one."""
    return STYLES.get(path.suffix or path.name)


def lacking() -> list[Path]:
    """Sources without the line."""
    names = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout.split("\0")
    # A file in conflict is named several times.
    paths = [ROOT / name for name in sorted(set(names)) if name and (ROOT / name).is_file()]
    generated = packages()
    sources = [
        path
        for path in paths
        if style_of(path) and path not in generated and path.parent != OF_OTHERS
    ]
    return [path for path in sources if LINE not in "".join(path.read_text().splitlines()[:2])]


def main() -> int:
    """Write or check the lines."""
    paths = lacking()
    if "--check" in sys.argv[1:]:
        for path in paths:
            print(f"{path.relative_to(ROOT)} has no licence; run scripts/spdx.py", file=sys.stderr)
        return 1 if paths else 0
    for path in paths:
        style = style_of(path)
        assert style is not None
        lines = path.read_text().splitlines(keepends=True)
        place = 1 if lines and lines[0].startswith("#!") else 0
        lines.insert(place, style.format(LINE) + "\n")
        path.write_text("".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
