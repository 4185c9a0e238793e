# SPDX-License-Identifier: Apache-2.0
"""Style of the VHDL sources, by vsg: of those that changed since vsg found nothing in them.

Usage: python scripts/lint_vhdl.py

What was found good, by which vsg and configuration, is kept in build/vsg; reading all sources
takes a minute.
"""

import hashlib
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from plenofir.ground import project

ROOT = project.root()
CONFIGURATION = ROOT / "scripts" / "vsg.yaml"
GOOD = ROOT / "build" / "vsg" / "good.txt"


def digests() -> dict[str, Path]:
    """All sources by what vsg's verdict depends on."""
    common = version("vsg").encode() + b"\0" + CONFIGURATION.read_bytes() + b"\0"
    return {
        hashlib.sha256(common + str(path).encode() + b"\0" + path.read_bytes()).hexdigest(): path
        for folder in ("hdl", "tb", "examples")
        for path in sorted((ROOT / folder).rglob("*.vhd"))
    }


def main() -> int:
    """Print what vsg finds."""
    sources = digests()
    good = set(GOOD.read_text().split()) if GOOD.exists() else set()
    changed = [str(path) for digest, path in sources.items() if digest not in good]
    if not changed:
        return 0
    command = [str(Path(sys.executable).parent / "vsg"), "--configuration", str(CONFIGURATION)]
    command += ["--output_format", "syntastic", "--filename", *changed]
    status = subprocess.run(command, check=False).returncode
    if status == 0:
        GOOD.parent.mkdir(parents=True, exist_ok=True)
        GOOD.write_text("\n".join(sources) + "\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
