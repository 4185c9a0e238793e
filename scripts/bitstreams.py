# SPDX-License-Identifier: Apache-2.0
"""Builds bitstreams of boards and writes them into one archive, build/bitstreams/*.zip.

Usage: python scripts/bitstreams.py [BOARD[:DEVICE] ...]; without a board those of `PREBUILT`, for
their scenes and usual devices. In the archive are each board's bitstream and report (clocks,
resources, versions of the tools, seconds), and SHA256SUMS, which `sha256sum -c` checks. Reports
have the seconds that the build took, so two runs differ in them.
"""

import hashlib
import io
import sys
import zipfile
from collections.abc import Mapping, Sequence

import plenofir
from plenofir.commands.bitstream import scene_plan
from plenofir.fpga.boards import BOARDS
from plenofir.ground import project
from plenofir.ground.errors import EXIT_BAD_INPUT, EXIT_TOOL_FAILED, InputError, ToolError
from plenofir.ground.files import publish
from plenofir.plan.board_build import build_scene

PREBUILT = ("ulx3s", "tangnano20k", "lifcl40")
"""Boards in the archive: open tools build them, and each has a scene of its own."""
FOLDER = project.root() / "build" / "bitstreams"


def built(target: str) -> dict[str, bytes]:
    """Build a board's bitstream; the archive's files of it."""
    name, _, device = target.partition(":")
    if name not in PREBUILT:
        raise InputError(f"there is no {name}; choose from {', '.join(PREBUILT)}", where="board")
    board = BOARDS[name]
    plan = scene_plan(board.scene, name, device or None)
    folder = FOLDER / f"{name}-{plan.device}"
    report = build_scene(plan, folder, lambda *_: None, board=board)
    clocks = ", ".join(f"{c.clock} {c.reached_mhz:g} MHz" for c in report.timing)
    seconds = ", ".join(f"{tool} {time:.0f} s" for tool, time in report.seconds.items())
    print(f"{name}, {plan.device}, {plan.scene}: {clocks}; {seconds}", flush=True)
    files = (board.bitstream, "report.json")
    return {f"{folder.name}/{file}": (folder / file).read_bytes() for file in files}


def packed(files: Mapping[str, bytes]) -> bytes:
    """An archive of files and their hashes, all with one date."""
    sums = "".join(f"{hashlib.sha256(d).hexdigest()}  {name}\n" for name, d in files.items())
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as members:
        for name, data in {**files, "SHA256SUMS": sums.encode()}.items():
            members.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()


def main(targets: Sequence[str]) -> int:
    """Build and pack, errors in one line."""
    archive = FOLDER / f"plenofir-{plenofir.__version__}-bitstreams.zip"
    try:
        archive.unlink(missing_ok=True)
        files: dict[str, bytes] = {}
        for target in targets or PREBUILT:
            files |= built(target)
        publish({archive.name: packed(files)}, FOLDER)
    except (InputError, ToolError) as error:
        print(f"bitstreams: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT if isinstance(error, InputError) else EXIT_TOOL_FAILED
    print(f"{archive}: {archive.stat().st_size / 1024:.0f} KiB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
