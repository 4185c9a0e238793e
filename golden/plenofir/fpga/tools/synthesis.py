# SPDX-License-Identifier: Apache-2.0
"""The tools: GHDL's synthesis to Verilog, and Yosys."""

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from plenofir.fpga.tools import yosys_process
from plenofir.fpga.tools.primitives import component_package, with_primitives
from plenofir.fpga.tools.simulators import find_simulator, generic_text
from plenofir.ground import project
from plenofir.ground.errors import InputError, ToolError
from plenofir.ground.locks import lock_file

Generics = Mapping[str, int | bool | str]


def run_tool(
    command: Sequence[str],
    log: Path,
    *,
    directory: Path | None = None,
    output: Path | None = None,
    environment: Mapping[str, str] | None = None,
    poll: Callable[[], None] | None = None,
) -> None:
    """Run a tool in a folder (that of the log), its standard output into a file (the log).

    `environment` holds variables beside those of this process; `poll` is called twice a second.

    ToolError with the last lines of the log if it fails.
    """
    with log.open("wb") as messages, (output or Path(os.devnull)).open("wb") as result:
        process = subprocess.Popen(
            command,
            cwd=directory or log.parent,
            stdin=subprocess.DEVNULL,
            stdout=result if output else messages,
            stderr=messages,
            env={**os.environ, **(environment or {})},
        )
        try:
            while poll is not None and process.poll() is None:
                poll()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(0.5)
            process.wait()
        except BaseException:
            process.kill()
            raise
    if process.returncode != 0:
        lines = log.read_text(errors="replace").splitlines()
        # For a failed assertion, the line with the reason, not the one that only says that it
        # failed.
        reasons = [line for line in lines if re.search(r"\(assert(ion)? failure\)", line)]
        wrong = reasons or [line for line in lines if "error" in line.lower()][-5:] or lines[-5:]
        raise ToolError(
            f"{Path(command[0]).name} failed with status {process.returncode}:\n" + "\n".join(wrong)
        )


def ghdl_version() -> str:
    """Version number of the installed GHDL, for instance ``"2.0.0"``."""
    match = re.search(r"GHDL (\d+\.\d+\.\d+)", find_simulator("ghdl").version)
    return match.group(1) if match else "unknown"


def yosys_version() -> str:
    """Version of the installed Yosys (the Python package pyosys), for instance ``"0.70"``."""
    if importlib.util.find_spec("pyosys") is None:
        raise InputError("Yosys is not installed; make venv, or pip install pyosys")
    return importlib.metadata.version("pyosys")


def plain_verilog(text: str) -> str:
    """Correct GHDL's Verilog so that all tools accept it.

    GHDL 2.0 prints constants of 0 bits (of a natural range 0 to 0), which no tool accepts;
    constants of more than 32 bits as strings, which have other values; and high impedance for
    undriven bits. Initial values of zero are removed: block RAM and Verilator begin with zeros, and
    they would take Yosys most of its time.
    """
    text = re.sub(r"^ *initial begin\n(?: *\w+\[\d+\] = \d+'b0+;\n)+ *end\n", "", text, flags=re.M)
    text = re.sub(r'"([01XZ]{33,})"', lambda bits: f"{len(bits[1])}'b{bits[1]}", text)
    text = re.sub(r"\b0'b(?:[XZxz]|(?![01]))", "1'b0", text)
    text = re.sub(r"'b[zZ](?=[,}])", "'bX", text)

    return text


_INITIAL = re.compile(r"^ *initial begin\n((?: *\w+\[\d+\] = \d+'b[01]+;\n)+) *end\n", re.M)


def move_contents(verilog: Path, least: int = 4096) -> None:
    """Move initial values of memories of `least` words or more into files beside a Verilog file.

    Yosys's time for assignments grows with the square of their number: half a minute for 8190
    words, which it reads from a file in an instant.
    """

    def moved(match: re.Match[str]) -> str:
        words = re.findall(r"(\w+)\[(\d+)\] = \d+'b([01]+);", match[1])
        name, bits_of = words[0][0], {int(place): bits for _, place, bits in words}
        if len(bits_of) < least or sorted(bits_of) != list(range(len(bits_of))):
            return match[0]
        file = verilog.with_name(f"{verilog.stem}_{match.start()}.mem")
        file.write_text("".join(f"{bits_of[place]}\n" for place in range(len(bits_of))))
        return f'  initial $readmemb("{file.name}", {name});\n'

    verilog.write_text(_INITIAL.sub(moved, verilog.read_text()))


_CASE = re.compile(r"^ *case \(.*?^ *endcase", re.S | re.M)
_CHOICE = re.compile(r"^ *(\d+)'b[01]+:", re.M)
_SELECT = re.compile(r"^ *with .*? select (\w+) <=\n.*?([^\n]*) when others;$", re.S | re.M)


def _is_complete(case: str) -> bool:
    """Whether a case has a default, or a choice for each value."""
    choices = _CHOICE.findall(case)
    return "default:" in case or (bool(choices) and len(choices) == 1 << int(choices[0]))


def with_defaults(verilog: str, vhdl: str) -> str:
    """Verilog of ``ghdl --synth`` with the default of each case, which its VHDL has.

    For a case with one-hot choices GHDL 2.0 leaves out ``when others``, so tools infer latches. Its
    VHDL output of the same design has it, in the same order. GHDL 5.0 has it in its Verilog, too;
    complete cases are not changed. ToolError if both do not have the same cases, or a value is not
    understood.
    """
    defaults = _SELECT.findall(vhdl)
    count = len(_CASE.findall(verilog))
    if len(defaults) != count:
        raise ToolError(f"GHDL's Verilog has {count} cases, its VHDL {len(defaults)}")
    following = iter(defaults)

    def completed(match: re.Match[str]) -> str:
        body = match.group(0)
        name, value = next(following)
        if _is_complete(body):
            return body
        target = re.search(r": (\w+) (<?=) ", body)
        if target is None or target.group(1) != name:
            raise ToolError(f"GHDL's Verilog has another case where its VHDL has that of {name}")
        place = body.rindex("endcase")
        default = f"  default: {name} {target.group(2)} {_verilog_value(value.strip())};\n    "
        return body[:place] + default + body[place:]

    return _CASE.sub(completed, verilog)


def _verilog_value(vhdl: str) -> str:
    """A constant, a signal or a part of one, in Verilog."""
    bits = re.fullmatch(r"\"([01XZ]+)\"|'([01XZ])'", vhdl)
    if bits:
        text = bits[1] or bits[2]
        return f"{len(text)}'b{text.replace('Z', 'X')}"
    alike = re.fullmatch(r"\((\d+) downto 0 => '([01XZ])'\)", vhdl)
    if alike:
        width = int(alike[1]) + 1
        return f"{width}'b{alike[2].replace('Z', 'X') * width}"
    part = re.fullmatch(r"(\w+)(?: \((\d+)(?: downto (\d+))?\))?", vhdl)
    if not part:
        raise ToolError(f"GHDL's VHDL has a value that is not understood: {vhdl}")
    name, high, low = part.groups()
    return name if high is None else f"{name}[{high}{f':{low}' if low else ''}]"


_ATTRIBUTE = re.compile(r"attribute (\w+) of ([\w, ]+?)\s*: signal is ([^;]+);")
# A register with an initial value, in GHDL's Verilog: its signal is a copy of a variable.
_COPIED = re.compile(
    r"^ */\*[^*]*\*/\n *always @\*\n *(crossing_\w+) = (n\d+_q); // \(isignal\)\n"
    r" *initial\n *\1 <= [^;]+;\n",
    re.M,
)
_COPIED_ITSELF = re.compile(_COPIED.pattern.replace(r"(n\d+_q)", r"\1"), re.M)


def with_crossings(verilog: str, sources: Iterable[Path]) -> str:
    """GHDL's Verilog with the names and attributes that registers between clocks have in VHDL.

    GHDL 2.0 names a register anew and leaves its attributes out, so no constraint would match it,
    and a tool could merge it with another.
    """
    attributes: dict[str, list[str]] = {}
    for source in sources:
        for key, names, value in _ATTRIBUTE.findall(source.read_text()):
            for name in names.split(", "):
                attribute = f"{key} = {'1' if value == 'true' else value}"
                attributes.setdefault(name, []).append(attribute)

    def named(module: str) -> str:
        for name, register in _COPIED.findall(module):
            module = re.sub(rf"^ *reg [^;\n]*\b{register};\n", "", module, flags=re.M)
            module = re.sub(rf"\b{register}\b", name, module)
            prefix = f"(* {', '.join(attributes[name])} *)\n" if name in attributes else ""
            module = re.sub(rf"^( *reg [^;\n]*\b{name};)", rf"  {prefix}\1", module, flags=re.M)
        return _COPIED_ITSELF.sub("", module)

    return "".join(named(module) for module in re.split(r"(?<=\nendmodule\n)", verilog))


def write_verilog(
    sources: Sequence[Path],
    top: str,
    generics: Generics,
    directory: Path,
    *,
    primitives: str = "",
    contents_in_files: bool = False,
) -> Path:
    """Synthesise VHDL-93 files in order of analysis to a Verilog file in a folder.

    The sources of a board instantiate primitives of a library: ``"unisim"``, ``"ecp5u"``,
    ``"gw2a"`` or ``"lifcl"``. Initial values of large memories are in files beside it.
    """
    environment = find_simulator("ghdl").environment
    verilog = directory / f"{top}.v"
    overrides = [f"-g{name}={generic_text(value)}" for name, value in generics.items()]
    library = []
    if primitives:
        # Only the component declarations: unbound components become cells.
        components = component_package(primitives)
        library = [f"-P{directory.resolve()}"]
        run_tool(
            [
                *("ghdl", "-a", "--std=93", f"--work={primitives}"),
                *(f"--workdir={directory.resolve()}", str(components)),
            ],
            directory / f"{primitives}.ghdl.log",
            environment=environment,
        )

    def synthesised(form: str, output: Path) -> str:
        run_tool(
            [
                *("ghdl", "--synth", "--std=93", f"--out={form}", *library, *overrides),
                *(str(source.resolve()) for source in sources),
                *("-e", top),
            ],
            directory / f"{top}.ghdl.log",
            output=output,
            environment=environment,
        )
        return output.read_text()

    text = synthesised("verilog", verilog)
    if not all(_is_complete(case) for case in _CASE.findall(text)):
        as_vhdl = directory / f"{top}.vhdl"
        text = with_defaults(text, synthesised("vhdl", as_vhdl))
        as_vhdl.unlink()
    if primitives:
        text = with_primitives(text, components, cell_declarations(primitives))
        # The library of components is no longer needed.
        for name in (f"{primitives}-obj93.cf", f"{components.stem}.o"):
            (directory / name).unlink(missing_ok=True)
    verilog.write_text(with_crossings(plain_verilog(text), sources))
    if contents_in_files:
        move_contents(verilog)
    return verilog


_CELLS = {
    "unisim": ("xilinx/cells_xtra.v",),
    "ecp5u": ("ecp5/cells_bb.v",),
    "gw2a": ("gowin/cells_xtra_gw2a.v", "gowin/cells_sim.v"),
    "lifcl": ("lattice/cells_bb_nexus.v",),
}


def cell_declarations(library: str = "unisim") -> list[Path]:
    """Verilog files of the installed Yosys that declare the cells of a library."""
    yosys_version()
    package = importlib.util.find_spec("pyosys")
    assert package is not None
    assert package.origin is not None
    return [Path(package.origin).parent / "share" / file for file in _CELLS[library]]


def run_yosys(
    commands: Sequence[str], log: Path, *, reads: Sequence[Path] = (), writes: Sequence[str] = ()
) -> None:
    """Run Yosys in the folder of the log.

    In a checkout, results of the same commands and files are cached in ``build/yosys``. `reads` are
    Verilog files, `writes` names of all files that the commands write; if there are none, Yosys
    always runs.
    """
    version = yosys_version()
    command = [sys.executable, "-m", yosys_process.__name__, *commands]
    if not writes or not (project.in_checkout() and os.access(project.root(), os.W_OK)):
        run_tool(command, log)
        return
    # Comments only give locations in the sources.
    texts = [re.sub(r"/\*.*?\*/", "", file.read_text(), flags=re.S) for file in reads]
    key = hashlib.sha256("\0".join([version, *commands, *texts]).encode()).hexdigest()
    kept = project.root() / "build" / "yosys" / f"{key[:32]}.zip"
    kept.parent.mkdir(parents=True, exist_ok=True)
    with kept.with_suffix(".lock").open("w") as lock:
        lock_file(lock.fileno(), wait=True)
        if kept.exists():
            with zipfile.ZipFile(kept) as archive:
                archive.extractall(log.parent)
            return
        run_tool(command, log)
        part = kept.with_suffix(".part")
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name in (*writes, log.name):
                archive.write(log.parent / name, name)
        part.replace(kept)
