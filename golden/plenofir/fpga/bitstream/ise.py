# SPDX-License-Identifier: Apache-2.0
"""The build with Xilinx ISE 14.7: XST, NGDBuild, Map, PAR, TRCE, BitGen.

The tools run in a folder of their own and, where their settings have to be read first, in a
subshell: ISE's libraries in the environment break other programs. ``scripts/ise`` has a file of
options for each tool; those that depend on the design (project file, part, file names) are made
here.
"""

import json
import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise_reports import (
    Message,
    Timing,
    Treatment,
    derived,
    messages,
    read_timing,
    read_utilisation,
    treatments,
)
from plenofir.fpga.bitstream.top_level import (
    PART,
    TOP,
    Value,
    check_fit,
    configuration,
    default_generics,
    project_lines,
    top_with_generics,
)
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.names import DEFAULT_BOARD
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish, remove_results

TOOLS = ("xst", "ngdbuild", "map", "par", "trce", "bitgen")
USUAL_PLACE = Path("/opt/Xilinx/14.7/ISE_DS")
SAVED_LIBRARY_PATH = "ISE_LD_LIBRARY_PATH"
"""Where the Makefile keeps LD_LIBRARY_PATH, which is ISE's if the caller read its settings."""

ROOT_CONSTRAINT = "TS_tmds"
DERIVED_CLOCKS = {"clk": (1, 1.0), "clk_x2": (1, 2.0), "tx_clk": (2, 1.0), "tx_clk_x2": (2, 2.0)}
"""Clocks whose periods the tools must derive: PLLs on the way from the TMDS clock, its multiple."""

Progress = Callable[[str, int, int], None]


def constraints_file() -> Path:
    """Pins and clocks of the board."""
    return BOARDS[DEFAULT_BOARD].constraints


def option_folder() -> Path:
    """Option files of the tools, and how their warnings are treated."""
    return project.root() / "scripts" / "ise"


def warning_file() -> Path:
    """What becomes of the tools' warnings."""
    return option_folder() / "warnings.txt"


def read_options(path: Path) -> list[str]:
    """Read an option file: an option a line, ``#`` begins a comment."""
    if not path.is_file():
        raise InputError("no such file of options", where=str(path))
    options = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        if not re.fullmatch(r"-[a-z_0-9]+( [\w:.<>/-]+)*", text):
            raise InputError(
                f"{text!r} is not an option; write -name value", where=f"{path.name}:{number}"
            )
        options.append(text)
    return options


@dataclass(frozen=True)
class Installation:
    """Where the tools are."""

    folder: Path | None  # ISE_DS, whose settings are read first; None: the tools are on the PATH

    def command(self, words: Sequence[str]) -> list[str]:
        """Command that runs a tool, with the settings of ISE if they have to be read."""
        if self.folder is None:
            return list(words)
        # The settings file takes its own folder as an argument; its output is not needed.
        script = 'ise=$1; shift; . "$ise/settings64.sh" "$ise" >/dev/null && exec "$@"'
        return ["bash", "-c", script, "bash", str(self.folder), *words]

    def environment(self) -> dict[str, str]:
        """The caller's environment, with the library path from before the Makefile emptied it."""
        environment = dict(os.environ)
        library_path = environment.pop(SAVED_LIBRARY_PATH, "")
        if library_path:
            environment["LD_LIBRARY_PATH"] = library_path
        return environment


def find_installation(ise: str = "") -> Installation:
    """Find ISE: where the user says, on the PATH, or where its installer puts it."""
    if ise:
        if not (Path(ise) / "settings64.sh").is_file():
            raise InputError(
                "holds no settings64.sh; name the folder ISE_DS of ISE 14.7", where=f"ISE={ise}"
            )
        return Installation(Path(ise).resolve())
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if not missing:
        return Installation(None)
    if (USUAL_PLACE / "settings64.sh").is_file():
        return Installation(USUAL_PLACE)
    raise InputError(
        f"Xilinx ISE 14.7 is not installed ({', '.join(missing)} not on the PATH); "
        f"if it is, say where: make bitstream ISE={USUAL_PLACE}",
        where="bitstream",
    )


@dataclass(frozen=True)
class BuildReport:
    """What ``report.json`` holds."""

    part: str  # device, package, speed grade
    generics: dict[str, Value]
    utilisation: dict[str, tuple[int, int]]  # kind of site: used, there
    timing: list[Timing]
    clocks: dict[str, str]  # clock behind a PLL to the constraint that the tools derived for it
    warnings: list[Message]  # those that matter
    other_warnings: int  # those that ``scripts/ise/warnings.txt`` calls unimportant
    seconds: dict[str, float]  # of each tool


def _commands(constraints: Path, options: Mapping[str, list[str]]) -> dict[str, list[str]]:
    """Each tool's command, in its order."""
    words = {tool: [word for line in options[tool] for word in line.split()] for tool in TOOLS}
    return {
        "xst": ["xst", "-intstyle", "xflow", "-ifn", f"{TOP}.xst", "-ofn", f"{TOP}.syr"],
        "ngdbuild": [
            *("ngdbuild", *words["ngdbuild"], "-p", PART, "-uc", str(constraints)),
            *(f"{TOP}.ngc", f"{TOP}.ngd"),
        ],
        "map": [
            *("map", *words["map"], "-p", PART, "-o", f"{TOP}_map.ncd"),
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


def xst_options() -> list[str]:
    """Options of XST, the same wherever ISE builds: here, by `configure`, a project, FuseSoC."""
    return read_options(option_folder() / "xst.opt")


def xst_script(top: str = TOP, part: str = "") -> str:
    """The script that XST runs for the project file named `top`; an empty part is the board's.

    The folder ``xst`` beside it is for XST's temporary files.
    """
    lines = [
        *('set -tmpdir "xst"', 'set -xsthdpdir "xst"', "run", f"-ifn {top}.prj", f"-ofn {top}"),
        *("-ofmt NGC", f"-p {part or PART}", f"-top {top}", *xst_options()),
    ]
    return "\n".join([*lines, ""])


def build(
    installation: Installation,
    changed: Mapping[str, Value],
    out: Path,
    progress: Progress,
    packages: Mapping[str, str] | None = None,
) -> BuildReport:
    """Build the bitstream; what is returned is also written to ``report.json``.

    `changed` are generics of the top level that differ from their defaults, `packages` VHDL
    packages in place of the board's own (name to text). There is no bitstream if the device is too
    small, a tool fails or gives a warning that is fatal, a clock or a path is not timed, or timing
    is not met.
    """
    generics = {**default_generics(), **changed}
    source = top_with_generics(changed)
    # A focal stack comes from a scene, whose plan has been checked.
    if SCREEN_PACKAGE not in (packages or {}):
        check_fit(configuration(generics))
    options = {tool: read_options(option_folder() / f"{tool}.opt") for tool in TOOLS}
    treated = treatments(warning_file())
    work = out / "work"
    logs = [out / f"{tool}.log" for tool in TOOLS]
    remove_results([out / "plenofir.bit", out / "report.json", work, *logs])
    (work / "xst").mkdir(parents=True)
    sources = hdl.with_packages(hdl.board_sources(), {**(packages or {}), TOP: source}, work)
    (work / f"{TOP}.prj").write_text("\n".join([*project_lines(sources), ""]))
    (work / f"{TOP}.xst").write_text(xst_script())
    constraints = constraints_file()
    seconds: dict[str, float] = {}
    warnings: list[Message] = []
    timing: list[Timing] = []
    clocks: dict[str, str] = {}
    for number, (tool, command) in enumerate(_commands(constraints, options).items()):
        progress(tool, number, len(TOOLS))
        begin = time.monotonic()
        log = _run(installation, tool, command, work, out)
        seconds[tool] = round(time.monotonic() - begin, 1)
        tool_warnings = messages(tool, log, "WARNING")
        _check_warnings(tool_warnings, treated, out / f"{tool}.log")
        warnings += tool_warnings
        if tool == "trce":
            timing = read_timing((work / f"{TOP}.twr").read_text(errors="replace"))
            clocks = check_timing(timing, work / f"{TOP}.twr")
    progress(TOOLS[-1], len(TOOLS), len(TOOLS))

    map_report = work / f"{TOP}_map.mrp"
    report = BuildReport(
        part=PART,
        generics=generics,
        utilisation=read_utilisation(map_report.read_text(errors="replace"))
        if map_report.is_file()
        else {},
        timing=timing,
        clocks=clocks,
        warnings=[warning for warning in warnings if warning.code not in treated],
        other_warnings=sum(warning.times for warning in warnings if warning.code in treated),
        seconds=seconds,
    )
    bits = (work / f"{TOP}.bit").read_bytes()
    content = json.dumps(asdict(report), indent=2) + "\n"
    publish({"plenofir.bit": bits, "report.json": content}, out)
    return report


def _run(
    installation: Installation, tool: str, command: Sequence[str], work: Path, out: Path
) -> str:
    """Run one tool; its output goes to a log, which is returned."""
    log = out / f"{tool}.log"
    try:
        with log.open("wb") as output:
            process = subprocess.run(
                installation.command(command),
                cwd=work,
                env=installation.environment(),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                check=False,
            )
    except OSError as error:
        raise InputError(
            f"{tool} cannot be run ({error.strerror}); is this ISE 14.7?", where="ISE"
        ) from None
    text = log.read_text(errors="replace")
    if process.returncode != 0 or not (work / _RESULTS[tool]).is_file():
        errors = messages(tool, text, "ERROR")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        if errors:
            reason = f"{errors[0].code}: {errors[0].text}"
        elif lines:
            reason = lines[-1]
        else:
            reason = f"exit status {process.returncode}"
        raise InputError(f"{tool} failed: {reason}", where=str(log))
    return text


def _check_warnings(
    warnings: Sequence[Message], treated: Mapping[str, Treatment], where: Path
) -> None:
    """Refuse what no build may contain."""
    fatal = [warning for warning in warnings if treated.get(warning.code) == Treatment.FATAL]
    if fatal:
        raise InputError(
            f"{fatal[0].code}: {fatal[0].text} ({len(fatal)} warnings that "
            f"{warning_file().name} calls fatal)",
            where=str(where),
        )


def check_timing(timing: Sequence[Timing], report: Path) -> dict[str, str]:
    """Refuse a design that was not timed as a whole, or is too slow.

    Returns the constraint that the tools derived for each clock behind a PLL.
    """
    places = derived(timing, ROOT_CONSTRAINT)
    pll_places = {entry.constraint: places.get(entry.constraint) for entry in timing if entry.paths}
    clocks: dict[str, str] = {}
    for clock, (plls, multiple) in DERIVED_CLOCKS.items():
        # A derived constraint without paths is written all the same: such a clock is not timed.
        mine = [text for text, place in pll_places.items() if place == (plls, multiple)]
        if not mine:
            raise InputError(
                f"clock {clock} is not timed: no constraint derived from {ROOT_CONSTRAINT}, "
                f"{plls} PLL{'' if plls == 1 else 's'} behind it at {multiple:g} times its "
                "frequency, has paths; what NGDBuild derived is in ngdbuild.log "
                "(ConstraintSystem:178)",
                where=str(report),
            )
        clocks[clock] = mine[0]
    for entry in timing:
        # Timing that is met tells nothing of paths that nobody asked about.
        if entry.constraint.startswith("Unconstrained") and entry.paths:
            raise InputError(
                f"{entry.paths} paths are in no constraint: {entry.constraint}; time them, "
                f"or add a TIG to constraints/{constraints_file().name}",
                where=str(report),
            )
    failed = [entry for entry in timing if entry.errors]
    if failed:
        worst = failed[0]
        best = "" if worst.best is None else f", {worst.best:g} ns would be met"
        raise InputError(
            f"timing is not met: {worst.constraint} ({worst.errors} errors{best}); "
            f"{len(failed)} of {len(timing)} constraints fail",
            where=str(report),
        )
    return clocks
