# SPDX-License-Identifier: Apache-2.0
"""FuseSoC generator: a scene in Verilog, for cores such as examples/verilog/refocus_button.core.

Its parameter is ``scene``: a shipped scene, or a profile relative to the core file that asks for
it. FuseSoC calls it with the file that tells what is wanted; plenofir and fusesoc must be in one
environment.
"""

import subprocess
import sys
from pathlib import Path

from fusesoc.capi2.generator import Generator


def main() -> int:
    """Write the scene's Verilog and a core file that lists it."""
    generator = Generator()
    scene = generator.config["scene"]
    profile = Path(generator.files_root) / scene
    command = [sys.executable, "-m", "plenofir", "configure", "--verilog", "--out", "scene"]
    process = subprocess.run([*command, str(profile if profile.is_file() else scene)], check=False)
    if process.returncode:
        return process.returncode
    names = [file for file in sorted(Path("scene").iterdir()) if file.suffix in (".v", ".vh")]
    generator.add_files(
        [
            {str(name): {"file_type": "verilogSource", "is_include_file": name.suffix == ".vh"}}
            for name in names
        ]
    )
    generator.write()
    return 0


if __name__ == "__main__":
    sys.exit(main())
