"""The build with Xilinx ISE 14.7: XST, NGDBuild, Map, PAR, TRCE, BitGen.

The tools run in a folder of their own and, where their settings have to be read first, in a
subshell: ISE's libraries in the environment break other programs. Options are in ``scripts/ise``, a
file for each tool; what says which design to build (project file, part, file names) is made here.
"""

import json
import math
import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import ValidationError

from plenofir import project
from plenofir.errors import InputError
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.spartan6_sites import device
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdl_text import declarations
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic

TOP = "atlys_top"
CONSTRAINTS = project.root() / "constraints" / "atlys.ucf"
SCRIPTS = project.root() / "scripts" / "ise"
TOOLS = ("xst", "ngdbuild", "map", "par", "trce", "bitgen")
OPTION_FILES = tuple(f"{tool}.opt" for tool in TOOLS)
USUAL_PLACE = Path("/opt/Xilinx/14.7/ISE_DS")
SAVED_LIBRARY_PATH = "ISE_LD_LIBRARY_PATH"
"""Where the Makefile keeps LD_LIBRARY_PATH, which is ISE's if the caller read its settings."""

Value = int | bool | str
Progress = Callable[[str, int, int], None]


def top_source() -> Path:
    """Source of the top level.

    Returns
    -------
    Path
        The file.
    """
    return project.root() / "hdl" / "board" / f"{TOP}.vhd"


def project_lines(replaced: Mapping[Path, Path] | None = None) -> list[str]:
    """Lines of ISE's project file, in the order of ``hdl/sources.txt``.

    Parameters
    ----------
    replaced
        Sources that others take the place of.

    Returns
    -------
    list of str
        One for each source.
    """
    paths = (path if replaced is None else replaced.get(path, path) for path in _sources())
    return [f'vhdl work "{path}"' for path in paths]


def _sources() -> list[Path]:
    return hdl.board_sources()


def source_of_line(line: str) -> Path:
    """File that a line of a project file names.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the line is none of VHDL into the library work.
    """
    found = re.fullmatch(r'vhdl work "([^"]+)"', line)
    if found is None:
        raise InputError(f"{line!r}", where="project file", expected='vhdl work "path"')
    return Path(found[1])


def read_options(path: Path) -> list[str]:
    """Read an option file: an option a line, ``#`` begins a comment.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    list of str
        Options with their values.

    Raises
    ------
    InputError
        If the file is missing or a line is no option.
    """
    if not path.is_file():
        raise InputError("no such file", where=str(path), expected="an option file")
    options = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        if not re.fullmatch(r"(set )?-[a-z_0-9]+( [\w:.<>/-]+)*", text):
            raise InputError(
                f"{text!r} is no option", where=f"{path.name}:{number}", expected="-name value"
            )
        options.append(text)
    return options


def default_generics() -> dict[str, Value]:
    """Generics of the top level that decide what is built, with their defaults.

    Returns
    -------
    dict
        Name to value.
    """
    values: dict[str, Value] = {}
    for generic in declarations(top_source().read_text(), "generic"):
        if generic.type_name == "boolean":
            values[generic.name] = generic.default == "true"
        elif generic.type_name == "string":
            values[generic.name] = generic.default.strip('"')
        else:
            values[generic.name] = int(generic.default)
    return values


def top_with_generics(values: Mapping[str, Value]) -> str:
    """Source of the top level with other defaults of its generics.

    XST's own way to set generics (``-generics {A=1 B=2}``) separates them by blanks, and a set of
    slices has blanks in it; so it is the defaults that are changed. Lines stay where they are, for
    the sake of messages.

    Parameters
    ----------
    values
        Generic to value.

    Returns
    -------
    str
        The source.

    Raises
    ------
    InputError
        If there is no such generic, or the value is of another type.
    """
    text = top_source().read_text()
    known = default_generics()
    for name, value in values.items():
        if name not in known:
            raise InputError(
                f"{TOP} has no generic {name}",
                where="generics",
                expected=", ".join(known),
            )
        if type(value) is not type(known[name]):
            kind = type(known[name]).__name__
            raise InputError(f"{value!r}", where=name, expected=f"a value of type {kind}")
        if isinstance(value, str):
            if not re.fullmatch(r"[-0-9 ]*|[a-z_]+", value):
                raise InputError(f"{value!r}", where=name, expected="numbers and blanks, or a name")
            literal = f'"{value}"'
        else:
            literal = str(value).lower()
        text, found = re.subn(
            rf"^(    {name}\s*: \w+\s*:= )(\"[^\"]*\"|[^;\n]+)",
            rf"\g<1>{literal}",
            text,
            flags=re.M,
        )
        assert found == 1, name
    return text


def configuration(values: Mapping[str, Value]) -> CoreConfiguration:
    """Configuration of the refocuser that a set of generics means.

    Parameters
    ----------
    values
        Generics of the top level, complete.

    Returns
    -------
    CoreConfiguration
        With three channels of 8 bits.

    Raises
    ------
    InputError
        If a value is out of its range.
    """
    try:
        return _configuration(values)
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(
            first["msg"],
            where=".".join(map(str, first["loc"])) or "generics",
            expected="generics in their ranges",
        ) from None


def board_generics(core: CoreConfiguration) -> dict[str, Value]:
    """Generics of the top level that mean a configuration of the refocuser.

    Parameters
    ----------
    core
        Configuration.

    Returns
    -------
    dict
        Generic to value.

    Raises
    ------
    InputError
        If the board's refocuser has no such configuration (three channels of 8 bits, one row at
        once, centred outputs).
    """
    known = default_generics()
    values = {name: value for name, value in core.generics().items() if name in known}
    if configuration({**known, **values}) != core:
        raise InputError(
            "the board has no such refocuser",
            where=TOP,
            expected="three channels of 8 bits, one row at once, centred outputs",
        )
    return values


def _configuration(values: Mapping[str, Value]) -> CoreConfiguration:
    arithmetic: Arithmetic = ExactArithmetic()
    if not values["EXACT"]:
        arithmetic = StoredProductArithmetic.model_validate(
            {"fraction_bits": values["FRACTION_BITS"], "guard_bits": values["GUARD_BITS"]}
        )
    engine = {"kind": values["ENGINE"]}
    if values["ENGINE"] == "fir":
        engine |= {"hold": values["HOLD"], "broadcast_taps": values["BROADCAST_TAPS"]}
    return CoreConfiguration.model_validate(
        {
            "micro_image_size": values["MICRO_IMAGE_SIZE"],
            "shifts": tuple(int(word) for word in str(values["SHIFTS"]).split()),
            "max_columns": values["MAX_COLUMNS"],
            "channels": 3,
            "pixel_bits": 8,
            "arithmetic": arithmetic,
            "order": values["INTERPOLATION_ORDER"],
            "engine": engine,
        }
    )


def block_rams(core: CoreConfiguration) -> int:
    """Block RAMs (RAMB16BWER) that the line buffers and the input FIFO take at least.

    A block of 18 Kbit has words of 36 bits (512 of them), 18, 9, 4, 2 or 1 (DS160).

    Parameters
    ----------
    core
        Configuration.

    Returns
    -------
    int
        Number of blocks.
    """

    def blocks(depth: int, width: int) -> int:
        depth = max(512, 1 << (depth - 1).bit_length())
        across = 18432 // depth if depth <= 2048 else max(1, 16384 // depth)
        return math.ceil(width / across) * math.ceil(depth / 16384)

    words = 1 << (core.max_columns - 1).bit_length()
    sums = core.line_buffer_bits // (core.channels * words) if core.line_buffer_bits else 0
    pixel = core.channels * core.pixel_bits + 2
    return core.channels * blocks(words, sums) + blocks(core.max_columns + 2, pixel)


def check_fit(core: CoreConfiguration) -> None:
    """Refuse what the device has no block RAM for.

    Parameters
    ----------
    core
        Configuration.

    Raises
    ------
    InputError
        With the numbers.
    """
    core.check_limits()
    needed, there = block_rams(core), device().sites["RAMB16BWER"]
    if needed > there:
        raise InputError(
            f"{needed} block RAMs for {core.taps - 1} lines of partial sums, "
            f"{core.max_columns} columns",
            where="M, A, MAX_COLUMNS",
            expected=f"at most {there}: smaller M or |a|, fewer columns, or ARITH=stored",
        )


@dataclass(frozen=True)
class Installation:
    """Where the tools are.

    Attributes
    ----------
    folder
        ISE_DS folder whose settings are read first, or None if the tools are on the PATH.
    """

    folder: Path | None

    def command(self, words: Sequence[str]) -> list[str]:
        """Command that runs a tool.

        Parameters
        ----------
        words
            The tool and its arguments.

        Returns
        -------
        list of str
            With the settings of ISE, if they have to be read.
        """
        if self.folder is None:
            return list(words)
        # The settings file takes its own place as its argument; what it prints is of no use.
        script = 'ise=$1; shift; . "$ise/settings64.sh" "$ise" >/dev/null && exec "$@"'
        return ["bash", "-c", script, "bash", str(self.folder), *words]

    def environment(self) -> dict[str, str]:
        """Environment of a tool.

        Returns
        -------
        dict
            That of the caller, with the library path as it was before the Makefile took it away.
        """
        environment = dict(os.environ)
        library_path = environment.pop(SAVED_LIBRARY_PATH, "")
        if library_path:
            environment["LD_LIBRARY_PATH"] = library_path
        return environment


def find_installation(ise: str = "") -> Installation:
    """Find ISE: where the user says, on the PATH, or where its installer puts it.

    Parameters
    ----------
    ise
        ISE_DS folder, or empty.

    Returns
    -------
    Installation
        Where the tools are.

    Raises
    ------
    InputError
        If there is none.
    """
    if ise:
        if not (Path(ise) / "settings64.sh").is_file():
            raise InputError(
                "no settings64.sh there",
                where=f"ISE={ise}",
                expected="the folder ISE_DS of ISE 14.7",
            )
        return Installation(Path(ise).resolve())
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if not missing:
        return Installation(None)
    if (USUAL_PLACE / "settings64.sh").is_file():
        return Installation(USUAL_PLACE)
    raise InputError(
        f"Xilinx ISE is not installed ({', '.join(missing)} not on the PATH)",
        where="bitstream",
        expected=f"ISE 14.7, with make bitstream ISE={USUAL_PLACE}",
    )


@dataclass(frozen=True)
class Message:
    """A message of the tools, as often as it came: ``Xst:653`` and its first line."""

    tool: str
    code: str
    text: str
    times: int


_MESSAGE = re.compile(r"^(WARNING|ERROR):(\w+:\d+) - (.*)$")


def messages(tool: str, log: str, severity: str) -> list[Message]:
    """Messages of a log, those with one code and text together.

    Parameters
    ----------
    tool
        Whose log it is.
    log
        Its text.
    severity
        WARNING or ERROR.

    Returns
    -------
    list of Message
        In the order of their first appearance.
    """
    found: dict[tuple[str, str], int] = {}
    lines = log.splitlines()
    for i, line in enumerate(lines):
        begin = _MESSAGE.match(line)
        if begin is None or begin[1] != severity:
            continue
        # Long messages go on in lines that are set in.
        text = begin[3].strip()
        for more in lines[i + 1 :]:
            if not re.match(r"^   ?\S", more):
                break
            text += " " + more.strip()
        found[begin[2], text] = found.get((begin[2], text), 0) + 1
    return [Message(tool, code, text, times) for (code, text), times in found.items()]


def unimportant(path: Path) -> set[str]:
    """Codes of warnings that are left out of the list.

    Parameters
    ----------
    path
        File with a code a line, and the reason behind ``#``.

    Returns
    -------
    set of str
        Codes.
    """
    lines = (line.split("#", 1)[0].strip() for line in path.read_text().splitlines())
    return {line for line in lines if line}


@dataclass(frozen=True)
class Timing:
    """What TRCE says of one constraint.

    Attributes
    ----------
    constraint
        Its text.
    paths
        Number of paths analysed.
    errors
        Number of those that are too slow or too fast.
    best
        Shortest period or delay that would be met, in ns; None if nothing was analysed.
    """

    constraint: str
    paths: int
    errors: int
    best: float | None


def read_timing(report: str) -> list[Timing]:
    """Read TRCE's report.

    Parameters
    ----------
    report
        Text of the ``.twr`` file.

    Returns
    -------
    list of Timing
        One for each constraint.
    """
    out = []
    for section in report.split("Timing constraint: ")[1:]:
        constraint = " ".join(section.split(";", 1)[0].split())
        paths = re.search(r"^\s*(\d+) paths analyzed", section, re.M)
        errors = re.search(r"^\s*(\d+) timing errors? detected", section, re.M)
        best = re.search(r"(?:Minimum period is|Maximum delay is)\s+([\d.]+)ns", section)
        out.append(
            Timing(
                constraint,
                int(paths[1]) if paths else 0,
                int(errors[1]) if errors else 0,
                float(best[1]) if best else None,
            )
        )
    return out


_UTILISATION = re.compile(
    r"^\s*Number (?:of|used as) ([\w/ ]+?):\s+([\d,]+) out of\s+([\d,]+)", re.M
)
_SHOWN = (
    *(
        "Slice Registers",
        "Slice LUTs",
        "occupied Slices",
        "bonded IOBs",
        "RAMB16BWERs",
        "RAMB8BWERs",
    ),
    *("DSP48A1s", "BUFG/BUFGMUXs", "BUFPLLs", "PLL_ADVs"),
)


def read_utilisation(report: str) -> dict[str, tuple[int, int]]:
    """Read Map's report.

    Parameters
    ----------
    report
        Text of the ``.mrp`` file.

    Returns
    -------
    dict
        Kind of site to how many are used, and how many there are.
    """
    found = {
        match[1]: (int(match[2].replace(",", "")), int(match[3].replace(",", "")))
        for match in _UTILISATION.finditer(report)
    }
    return {name: found[name] for name in _SHOWN if name in found}


@dataclass(frozen=True)
class BuildReport:
    """What ``report.json`` holds.

    Attributes
    ----------
    part
        Device, package, speed grade.
    generics
        Generics of the top level.
    utilisation
        Kind of site: used, there.
    timing
        What TRCE says of each constraint.
    warnings
        Those that matter.
    other_warnings
        Number of warnings of the kinds in ``scripts/ise/unimportant.txt``.
    seconds
        Time that each tool took.
    """

    part: str
    generics: dict[str, Value]
    utilisation: dict[str, tuple[int, int]]
    timing: list[Timing]
    warnings: list[Message]
    other_warnings: int
    seconds: dict[str, float]


def _commands(constraints: Path, options: Mapping[str, list[str]]) -> dict[str, list[str]]:
    """Each tool's command, in its order."""
    part = device().part
    words = {tool: [word for line in options[tool] for word in line.split()] for tool in TOOLS}
    return {
        "xst": ["xst", "-intstyle", "xflow", "-ifn", f"{TOP}.xst", "-ofn", f"{TOP}.syr"],
        "ngdbuild": [
            *("ngdbuild", *words["ngdbuild"], "-p", part, "-uc", str(constraints)),
            *(f"{TOP}.ngc", f"{TOP}.ngd"),
        ],
        "map": [
            *("map", *words["map"], "-p", part, "-o", f"{TOP}_map.ncd"),
            *(f"{TOP}.ngd", f"{TOP}.pcf"),
        ],
        "par": ["par", *words["par"], f"{TOP}_map.ncd", f"{TOP}.ncd", f"{TOP}.pcf"],
        "trce": ["trce", *words["trce"], f"{TOP}.ncd", f"{TOP}.pcf", "-o", f"{TOP}.twr"],
        "bitgen": ["bitgen", *words["bitgen"], f"{TOP}.ncd", f"{TOP}.bit", f"{TOP}.pcf"],
    }


# What each tool leaves if it was successful.
_RESULTS = {
    "xst": f"{TOP}.ngc",
    "ngdbuild": f"{TOP}.ngd",
    "map": f"{TOP}_map.ncd",
    "par": f"{TOP}.ncd",
    "trce": f"{TOP}.twr",
    "bitgen": f"{TOP}.bit",
}


def xst_script(options: Sequence[str], top: str = TOP, part: str = "") -> str:
    """The script that XST runs.

    Parameters
    ----------
    options
        Options of ``scripts/ise/xst.opt``.
    top
        Entity, also the name of the project file.
    part
        Device, speed grade and package; the board's if empty.

    Returns
    -------
    str
        Its text; the folder ``xst`` beside it is for XST's temporary files.
    """
    settings = [option for option in options if option.startswith("set ")]
    rest = [option for option in options if not option.startswith("set ")]
    lines = [
        *('set -tmpdir "xst"', 'set -xsthdpdir "xst"', *settings, "run", f"-ifn {top}.prj"),
        *(f"-ofn {top}", "-ofmt NGC", f"-p {part or device().part}", f"-top {top}", *rest),
    ]
    return "\n".join([*lines, ""])


def build(
    installation: Installation, changed: Mapping[str, Value], out: Path, progress: Progress
) -> BuildReport:
    """Build the bitstream.

    Parameters
    ----------
    installation
        Where the tools are.
    changed
        Generics of the top level that differ from their defaults.
    out
        Folder for bitstream, reports and logs.
    progress
        Called with the tool's name, how many are done, and how many there are.

    Returns
    -------
    BuildReport
        Also written to ``report.json``.

    Raises
    ------
    InputError
        If the device is too small, a tool fails, or timing is not met. Then there is no bitstream.
    """
    generics = {**default_generics(), **changed}
    source = top_with_generics(changed)
    check_fit(configuration(generics))
    options = {tool: read_options(SCRIPTS / f"{tool}.opt") for tool in TOOLS}
    for name in ("plenofir.bit", "report.json"):
        (out / name).unlink(missing_ok=True)
    work = out / "work"
    shutil.rmtree(work, ignore_errors=True)
    (work / "xst").mkdir(parents=True)
    top = work / f"{TOP}.vhd"
    top.write_text(source)
    (work / f"{TOP}.prj").write_text("\n".join([*project_lines({top_source(): top}), ""]))
    (work / f"{TOP}.xst").write_text(xst_script(options["xst"]))
    constraints = CONSTRAINTS
    seconds: dict[str, float] = {}
    warnings: list[Message] = []
    timing: list[Timing] = []
    for number, (tool, command) in enumerate(_commands(constraints, options).items()):
        progress(tool, number, len(TOOLS))
        begin = time.monotonic()
        log = _run(installation, tool, command, work, out)
        seconds[tool] = round(time.monotonic() - begin, 1)
        warnings += messages(tool, log, "WARNING")
        if tool == "trce":
            timing = read_timing((work / f"{TOP}.twr").read_text(errors="replace"))
            _check_timing(timing, out / "work" / f"{TOP}.twr")
    progress(TOOLS[-1], len(TOOLS), len(TOOLS))
    left_out = unimportant(SCRIPTS / "unimportant.txt")
    map_report = work / f"{TOP}_map.mrp"
    report = BuildReport(
        part=device().part,
        generics=generics,
        utilisation=read_utilisation(map_report.read_text(errors="replace"))
        if map_report.is_file()
        else {},
        timing=timing,
        warnings=[w for w in warnings if w.code not in left_out],
        other_warnings=sum(w.times for w in warnings if w.code in left_out),
        seconds=seconds,
    )
    (out / "report.json").write_text(json.dumps(asdict(report), indent=2) + "\n")
    os.replace(work / f"{TOP}.bit", out / "plenofir.bit")
    return report


def _run(
    installation: Installation, tool: str, command: Sequence[str], work: Path, out: Path
) -> str:
    """Run one tool; its output goes to a log, which is returned."""
    log = out / f"{tool}.log"
    try:
        with log.open("wb") as output:
            done = subprocess.run(
                installation.command(command),
                cwd=work,
                env=installation.environment(),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                check=False,
            )
    except OSError as error:
        raise InputError(f"{tool}: {error.strerror}", where="ISE", expected="ISE 14.7") from None
    text = log.read_text(errors="replace")
    if done.returncode != 0 or not (work / _RESULTS[tool]).is_file():
        errors = messages(tool, text, "ERROR")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        if errors:
            reason = f"{errors[0].code}: {errors[0].text}"
        elif lines:
            reason = lines[-1]
        else:
            reason = f"exit status {done.returncode}"
        raise InputError(
            f"{tool} failed: {reason}", where=str(log), expected="a run without errors"
        )
    return text


def _check_timing(timing: Sequence[Timing], report: Path) -> None:
    """Refuse a design that is too slow, or was not looked at."""
    if not any(entry.paths for entry in timing):
        raise InputError("no path was timed", where=str(report), expected="timing constraints")
    failed = [entry for entry in timing if entry.errors]
    if failed:
        worst = failed[0]
        best = "" if worst.best is None else f", {worst.best:g} ns would be met"
        raise InputError(
            f"timing is not met: {worst.constraint} ({worst.errors} errors{best})",
            where=str(report),
            expected=f"no timing errors ({len(failed)} of {len(timing)} constraints fail)",
        )
