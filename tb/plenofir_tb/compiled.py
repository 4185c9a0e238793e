# SPDX-License-Identifier: Apache-2.0
"""All sources compiled once by GHDL's LLVM back end, for runs of many testbenches.

It simulates in two thirds of the time of the mcode back end, but compiling a core takes longer than
most benches run. The library is cached in ``build/ghdl`` by a hash of its sources; a long
simulation gets a copy, to which it adds its own units.
"""

import fcntl
import hashlib
import shutil
from collections.abc import Sequence
from pathlib import Path

from plenofir.fpga.tools.simulators import Simulator
from plenofir.ground import project

KEPT = project.root() / "build" / "ghdl"
# Whether compiling is worthwhile: set if many benches run (``tb/conftest.py``).
many = False


def copy_library(simulator: Simulator, library: str, sources: Sequence[Path], folder: Path) -> bool:
    """Copy the library of all sources into a folder, if there is one.

    There is none for changed sources, for other simulators, and if no other bench would use it.
    """
    kept = project.root() / "hdl"
    compiles = simulator.environment.get("GHDL_BACKEND") == "llvm"
    if not compiles or not all(source.is_relative_to(kept) for source in sources):
        return False
    command = simulator.analysis(sources, library=library)
    digest = hashlib.sha256(repr((simulator.version, command)).encode())
    for source in sources:
        digest.update(source.read_bytes())
    compiled = KEPT / digest.hexdigest()[:16]
    if not (compiled.exists() or many):
        return False
    KEPT.mkdir(parents=True, exist_ok=True)
    with (KEPT / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not compiled.exists():
            for older in KEPT.iterdir():
                if older.is_dir():
                    shutil.rmtree(older)
            work = KEPT / "new"
            work.mkdir()
            simulator.run(command, work)
            work.rename(compiled)
        shutil.copytree(compiled, folder, dirs_exist_ok=True)
    return True
