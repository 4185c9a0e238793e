# SPDX-License-Identifier: Apache-2.0
"""`make formal`: the proofs, side by side; a property that fails leaves its steps as a VCD."""

import argparse
import os
import shutil
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from formal import LONG_PROOFS, PROOFS, Proof
from plenofir.ground import project
from plenofir.ground.errors import ToolError

FOLDER = project.root() / "build" / "formal"


def prove(proof: Proof, folder: Path) -> str:
    """Prove in an empty folder, which stays if the proof fails; result: the failure, or nothing."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        proof.prove(folder)
    except ToolError as error:
        return str(error)
    shutil.rmtree(folder)
    return ""


def main() -> int:
    """Prove all; exit code 1 if a proof fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--long", action="store_true", help="those of `make test-full` as well")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    proofs = [*PROOFS, *(LONG_PROOFS if options.long else ())]
    started, failed = time.monotonic(), 0
    with ThreadPoolExecutor(options.jobs) as pool:
        running = {
            pool.submit(prove, proof, FOLDER / str(number)): proof
            for number, proof in enumerate(proofs)
        }
        for future in as_completed(running):
            failed += bool(future.result())
            print(future.result() or f"{running[future].name}: proved", flush=True)
    print(f"{len(proofs)} proofs, {failed} failed, {time.monotonic() - started:.0f} s")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
