# SPDX-License-Identifier: Apache-2.0
"""A scene in Verilog, for flows that take no VHDL: what GHDL makes of it, and its sizes."""

import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from plenofir.fpga.boards import board_of
from plenofir.fpga.tools.synthesis import ghdl_version, write_verilog
from plenofir.plan.planned import Plan

_SHIFT_BITS = 16


def sizes_header(plan: Plan, top: str) -> str:
    """Verilog header with the sizes of a scene's core, for designs and benches around it.

    Macros ``SCENE_...``; ``SCENE_SHIFTS`` has a' of each slice in pixels, 16 bits in two's
    complement, slice 0 in the lowest ones. The guard is named after the entity `top`.
    """
    core = plan.core
    shifts = "_".join(f"{shift % (1 << _SHIFT_BITS):04x}" for shift in reversed(core.shifts))
    generics = core.generics()
    values = {
        "MICRO_IMAGE_SIZE": core.micro_image_size,
        "COLUMNS": plan.columns,
        "ROWS": plan.rows,
        "PIXELS_PER_CLOCK": core.pixels_per_clock,
        "CHANNELS": core.channels,
        "PIXEL_BITS": core.pixel_bits,
        "SLICES": len(core.shifts),
        "SHIFTS": f"{_SHIFT_BITS * len(core.shifts)}'h{shifts}",
        "CENTRED": int(bool(generics["CENTRED"])),
        "EXACT": int(bool(generics["EXACT"])),
        "INTERPOLATION_ORDER": core.order,
    }
    guard = f"{top.upper()}_VH"
    return "\n".join(
        [
            f"// Sizes of the scene {plan.scene}, written by plenofir configure --verilog.",
            "// SCENE_SHIFTS: a' of each slice in pixels, 16 bits each, slice 0 in the lowest.",
            f"`ifndef {guard}",
            f"`define {guard}",
            *(f"`define SCENE_{name} {value}" for name, value in values.items()),
            "`endif",
            "",
        ]
    )


def _tidy(text: str) -> str:
    """GHDL's Verilog without comments, which name places in the VHDL, and as lint wants it.

    Assignments in ``initial`` and ``always @*`` are blocking ones.
    """
    text = re.sub(r" *(?:/\*.*?\*/|//[^\n]*)", "", text, flags=re.S)
    lines = []
    blocking = False
    for line in text.splitlines():
        if re.match(r" {2}\S", line):
            blocking = bool(re.match(r" *(?:initial|always @\*)", line))
        if blocking:
            line = re.sub(r"^( +(?:[^;:]+: )?\w+) <= ", r"\1 = ", line)
        if line.startswith("module "):
            lines.append("")
        if line:
            lines.append(line)
    return "\n".join(lines)


def verilog_files(
    plan: Plan, top: str, own: Mapping[str, str], sources: Sequence[Path]
) -> dict[str, str]:
    """Synthesise the entity `top` of a scene's project to Verilog: name to text.

    `own` are the scene's own VHDL files, name to text; `sources` are in order of analysis, those
    whose name is in `own` are taken from there. For a core the header `sizes_header` comes along.
    A board's primitives stay instances of its vendor's cells, whose ports Yosys knows.
    """
    board = board_of(plan.device) if plan.path == "video" else None
    library = "" if board is None else board.library
    # First of all: whether GHDL is there.
    ghdl = ghdl_version()
    with tempfile.TemporaryDirectory(prefix="plenofir-") as work:
        folder = Path(work)
        for name, content in own.items():
            (folder / name).write_text(content)
        places = [folder / path.name if path.name in own else path for path in sources]
        text = write_verilog(places, top, {}, folder, primitives=library).read_text()
    text = _tidy(text)
    head = (
        f"// The scene {plan.scene}, written by plenofir configure --verilog: the VHDL as\n"
        f"// synthesised by GHDL {ghdl}. Change the scene or the VHDL, not this file.\n"
    )
    files = {f"{top}.v": f"{head}\n{text.strip()}\n"}
    if board is None:
        files[f"{top}.vh"] = sizes_header(plan, top)
    return files
