# SPDX-License-Identifier: Apache-2.0
"""A scene in Verilog by GHDL, for flows without VHDL, and a header with its sizes."""

import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from plenofir.fpga.boards import board_of
from plenofir.fpga.tools.synthesis import Generics, ghdl_version, write_verilog
from plenofir.plan.plan import Plan

_SHIFT_BITS = 16


def sizes_header(plan: Plan, top: str) -> str:
    """Verilog header with the sizes of a scene's core, for designs and benches around it.

    Macros ``SCENE_...``; ``SCENE_SHIFTS`` has a' of each slice in pixels, 16 bits in two's
    complement, slice 0 in the lowest ones. The guard is named after the entity `top`.
    """
    core, screen = plan.core, plan.screen
    slices = screen.shifts(core)
    shifts = "_".join(f"{shift % (1 << _SHIFT_BITS):04x}" for shift in reversed(slices))
    generics = core.generics()
    values = {
        "MICRO_IMAGE_SIZE": core.micro_image_size,
        "COLUMNS": plan.columns,
        "ROWS": plan.rows,
        "PIXELS_PER_CLOCK": core.pixels_per_clock,
        "CHANNELS": core.channels,
        "PIXEL_BITS": core.pixel_bits,
        "SLICES": len(slices),
        "SHIFTS": f"{_SHIFT_BITS * len(slices)}'h{shifts}",
        "CENTRED": int(bool(generics["CENTRED"])),
        "EXACT": int(core.exact),
        "INTERPOLATION_ORDER": core.order,
    }
    if screen.needs_stack:
        # Bits of a pixel that comes out.
        values["OUT_BITS"] = screen.stack_pixel_bits(core)
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


_PLACE = re.compile(r"\n */\* (\S+):(\d+):(\d+) +\*/")
_TABLE = re.compile(r"^ *reg \[\d+:0\] (n\d+)\[\d+:0\]", re.M)


def _named_tables(text: str) -> str:
    """Give tables of constants, which GHDL numbers, their names in the VHDL.

    A comment of GHDL after a table has the position where it is read: that of ``(`` in ``NAME(i)``,
    or of the ``i``. A table without such a comment keeps its number.
    """
    lines_of: dict[str, list[str]] = {}

    def name_at(file: str, line: str, column: str) -> str:
        if file not in lines_of:
            path = Path(file)
            lines_of[file] = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
        code = "".join(lines_of[file][int(line) - 1 : int(line)])
        read = re.search(r"(\w+)\($", code[: int(column)]) or re.search(
            r"(\w+)\($", code[: int(column) - 1]
        )
        return f"{read[1].lower()}_table" if read else ""

    def module(match: re.Match[str]) -> str:
        body = match[0]
        names: dict[str, str] = {}
        tables = list(_TABLE.finditer(body))
        for table, following in zip(tables, [*tables, None][1:], strict=True):
            rest = body[table.end() : following.start() if following else len(body)]
            read = re.search(rf"^[^\n]*<?= {table[1]}\[[^\n]*", rest, re.M)
            places = re.match(rf"(?:{_PLACE.pattern})+", rest[read.end() :]) if read else None
            calls = [name_at(*place) for place in _PLACE.findall(places[0] if places else "")]
            name = next(filter(None, reversed(calls)), "")
            if name:
                again = sum(re.sub(r"_\d+$", "", other) == name for other in names.values())
                names[table[1]] = f"{name}_{again + 1}" if again else name
        return re.sub(r"\bn\d+\b", lambda word: names.get(word[0], word[0]), body)

    return re.sub(r"^module .*?^endmodule", module, text, flags=re.S | re.M)


def _named_modules(text: str, entities: Sequence[str]) -> str:
    """Name modules after their entities, numbered, instead of GHDL's digests of generics."""
    of_entity: dict[str, list[str]] = {}
    for module in re.findall(r"^module (\w+_[0-9a-f]{40})$", text, re.M):
        entity = max((e for e in entities if module.startswith(f"{e}_")), key=len)
        of_entity.setdefault(entity, []).append(module)
    names = {
        module: entity if len(alike) == 1 else f"{entity}_{number}"
        for entity, alike in of_entity.items()
        for number, module in enumerate(alike, 1)
    }
    return re.sub(r"\b\w+_[0-9a-f]{40}\b", lambda word: names[word[0]], text)


def _tidy(text: str) -> str:
    """GHDL's Verilog without comments, which give positions in the VHDL, and clean for lint.

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
    return re.sub(r"^module .*?^endmodule", _without_doubles, "\n".join(lines), flags=re.S | re.M)


def _without_doubles(module: re.Match[str]) -> str:
    """A module without what GHDL writes twice or for nothing.

    A signal ``deskew_locked`` at the port ``locked`` of an instance ``deskew`` is declared again as
    the instance's net, and assigned to itself. A vector without bits is a text without characters.
    """
    lines, declared = [], set[str]()
    for line in module[0].splitlines():
        assigned = re.fullmatch(r"  assign (\w+) = (\w+);", line)
        if line in declared or (assigned and assigned[1] == assigned[2]):
            continue
        if re.fullmatch(r"  wire (?:\[\d+:0\] )?\w+;", line):
            declared.add(line)
        lines.append(line.replace(' = "";', " = 1'b0;"))
    return "\n".join(lines)


def lint_head(written_by: str) -> str:
    """First lines of a Verilog file that GHDL made, for its readers and for Verilator."""
    return (
        f"// {written_by}: the VHDL as\n"
        f"// synthesised by GHDL {ghdl_version()}. Change the scene or the VHDL, not this file.\n"
        "// Some bits of a vector follow from others of it, which is no loop of single bits:\n"
        "// verilator lint_off UNOPTFLAT\n"
    )


def synthesised(
    sources: Sequence[Path],
    top: str,
    generics: Generics,
    *,
    written: Mapping[str, str],
    library: str = "",
) -> str:
    """Modules of an entity `top` as GHDL synthesises it, by the names that the VHDL has.

    `written` are the scene's own VHDL files, name to text; `sources` are in order of analysis,
    those whose name is in `written` are taken from there. `library` has a board's primitives.
    """
    with tempfile.TemporaryDirectory(prefix="plenofir-") as work:
        folder = Path(work)
        for name, content in written.items():
            (folder / name).write_text(content, encoding="utf-8")
        places = [folder / path.name if path.name in written else path for path in sources]
        verilog = write_verilog(places, top, generics, folder, primitives=library)
        text = _named_tables(verilog.read_text(encoding="utf-8"))
    return _named_modules(_tidy(text), [path.stem for path in sources]).strip()


def verilog_files(
    plan: Plan, top: str, written: Mapping[str, str], sources: Sequence[Path]
) -> dict[str, str]:
    """Synthesise the entity `top` of a scene's project to Verilog: name to text.

    `written` and `sources` are as in `synthesised`. For a core the header `sizes_header` comes
    along. A board's primitives stay instances of its vendor's cells, whose ports Yosys knows.
    """
    board = board_of(plan.device) if plan.path != "core" else None
    # Fails first if GHDL is not installed.
    head = lint_head(f"The scene {plan.scene}, written by plenofir configure --verilog")
    library = "" if board is None else board.library
    text = synthesised(sources, top, {}, written=written, library=library)
    files = {f"{top}.v": f"{head}\n{text}\n"}
    if board is None:
        files[f"{top}.vh"] = sizes_header(plan, top)
    return files
