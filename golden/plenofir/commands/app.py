# SPDX-License-Identifier: Apache-2.0
"""The command ``plenofir``: puts the groups of commands together and words their errors."""

import os
import signal
import sys
import traceback
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from io import TextIOWrapper
from typing import Annotated, Any, TextIO

import typer

from plenofir.commands import (
    batch,
    bitstream,
    board,
    capture,
    design,
    develop,
    inspect,
    light_fields,
    plan,
    rays,
    refocusing,
    shipped,
    sim,
    view,
    waves,
)
from plenofir.commands.console import print_notes
from plenofir.commands.make_variables import arguments_of_make
from plenofir.commands.options import called_by_make, named
from plenofir.ground import compiling
from plenofir.ground.errors import EXIT_BAD_INPUT, EXIT_TOOL_FAILED, InputError, ToolError
from plenofir.ground.extras import missing
from plenofir.ground.files import inputs_kept, unusable

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Real-time refocusing for standard and focused plenoptic cameras.",
)


GROUPS = "plenofir.commands"
"""Entry points that are Typer applications: groups of commands by their names."""
STUDIES = ("report", "reproduce")
"""Commands of plenofir-studies, a distribution of its own."""


# Windows has no such signal; the exit code is the same.
_SIGPIPE = 13
# A command that compiles for longer says so.
COMPILING_SECONDS = 2.0


class UsageError(ValueError):
    """Arguments that Typer refuses: one line."""


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug", help="Print the traceback of an error; may stand anywhere on the line."
        ),
    ] = False,
) -> None:
    if version:
        from plenofir import __version__

        typer.echo(__version__)
        raise typer.Exit


# Headings and order of the help.
_PHOTOGRAPHS = (develop, view, inspect, capture, refocusing, light_fields, batch)
_FPGA = "VHDL and FPGA"
_STUDIES = "Studies"
for heading, groups in (
    ("Photographs", _PHOTOGRAPHS),
    (_FPGA, (sim, plan)),
    ("Cameras and distances", (design, rays, shipped)),
):
    for group in groups:
        for registered in group.app.registered_commands:
            registered.rich_help_panel = registered.rich_help_panel or heading
        app.registered_commands += group.app.registered_commands
for name, group in (("bitstream", bitstream), ("board", board), ("waves", waves)):
    app.add_typer(group.app, name=name, rich_help_panel=_FPGA)


def command_line(words: Sequence[str] = ()) -> Any:
    """The command, with the groups that other packages add to it (entry points of `GROUPS`).

    They are not looked up where `words` begin with a command of this package: that takes a sixth of
    the time in which the command line loads.
    """
    command: Any = typer.main.get_command(app)
    if not words or words[0] not in command.commands:
        _add_groups()
        command = typer.main.get_command(app)
    return command


@cache
def _add_groups() -> None:
    from importlib.metadata import entry_points

    for point in sorted(entry_points(group=GROUPS), key=lambda point: point.name):
        group = point.load()
        # An application of one command is that command.
        if group.registered_callback is None and len(group.registered_commands) == 1:
            group.registered_commands[0].rich_help_panel = _STUDIES
            app.registered_commands += group.registered_commands
        else:
            app.add_typer(group, name=point.name, rich_help_panel=_STUDIES)


def _parameters(command: Any, words: Sequence[str]) -> Mapping[str, Any]:
    """Parameters of the command that the first words name."""
    for word in words:
        if word not in getattr(command, "commands", {}):
            break
        command = command.commands[word]
    return {parameter.name: parameter for parameter in command.params}


def _usage_error(error: Any, options: Mapping[str, Any]) -> str:
    """One line for what Typer found wrong with the arguments."""
    cause, parameter = error.__cause__, getattr(error, "param", None)
    if parameter is None:
        return str(error.format_message())
    where = named(parameter.name, options) if parameter.opts[0][0] == "-" else parameter.name
    if cause is None:
        return f"{where} is missing"
    first = cause.errors()[0]
    text = first["msg"].partition("Input should be ")[2] or first["msg"].partition("is not ")[2]
    return f"{where}: {first['input']!r} must be {text.partition(', unable')[0].rstrip('.')}"


def run(arguments: Sequence[str]) -> int:
    """Run a command and return its exit code; errors name options as the user typed them."""
    by_make = arguments[:1] == ["--make"]
    words = list(arguments[by_make:])
    command = command_line(words)
    if words[:1] and words[0] in STUDIES and words[0] not in command.commands:
        raise InputError(
            "plenofir-studies is not installed; in a clone of plenofir: pip install ./studies",
            where=words[0],
        )
    parameters = _parameters(command, words)
    # Errors about make's variables name these already.
    options: Mapping[str, Any] = {} if by_make else parameters
    called_by_make(None)
    try:
        if by_make:
            more, variables = arguments_of_make("".join(words[:1]), parameters, os.environ)
            called_by_make(variables)
            words += more
            options = parameters
        # Not command.main, which ends the program at a broken pipe.
        with inputs_kept(), command.make_context("plenofir", words) as context:
            # Notes that an earlier command of this process left are not this one's.
            print_notes(drop=True)
            command.invoke(context)
            print_notes()
    except typer.Exit as done:
        return done.exit_code
    except InputError as error:
        where = named(error.where, options)
        raise InputError(error.problem, where=where) from error
    except typer.exceptions.TyperException as error:
        raise UsageError(_usage_error(error, options)) from error
    return 0


def explained(error: BaseException) -> tuple[int, str]:
    """Exit code and message for whatever ended a command."""
    match error:
        case InputError() | UsageError():
            return EXIT_BAD_INPUT, _one_line(str(error))
        case ToolError():
            kind = "simulation failed: " if type(error).__name__ == "SimulationError" else ""
            return EXIT_TOOL_FAILED, f"{kind}{error}"
        # The reader has closed the pipe; Rich turns that into an exit.
        case BrokenPipeError() | SystemExit(__context__=BrokenPipeError()):
            return 128 + _SIGPIPE, ""
        case SystemExit(code=int(code)):
            return code, ""
        case KeyboardInterrupt():
            return 128 + signal.SIGINT, "interrupted"
        case MemoryError():
            cause = f" ({error})" if str(error) else ""
            problem = f"not enough memory{cause}; use smaller images or ranges"
        case RecursionError():
            problem = "the input is nested too deeply"
        case OverflowError():
            problem = f"a number in the input is too large ({error})"
        case ModuleNotFoundError():
            problem = missing(error.name or str(error)).problem
        case OSError():
            problem = str(unusable(error))
        case _:
            text = "".join(traceback.format_exception_only(error)).partition("\n")[0]
            problem = f"internal error ({text[:200]}); run again with --debug and report the output"
    return EXIT_BAD_INPUT, _one_line(problem)


def _one_line(message: str) -> str:
    """Escape what would break or hide a line of a terminal."""
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in message
    )


def _flush(stream: TextIO | None) -> None:
    """Flush a stream; what it cannot write is dropped, or Python would complain at its end."""
    if stream is None:
        return
    try:
        stream.flush()
    except OSError as error:
        # Python flushes once more at its end: the buffer needs a place that takes it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        error.filename = "standard output"
        raise


def _stopped(number: int, _: object) -> None:
    sys.exit(128 + number)


def _note_now(text: str) -> None:
    """Print a note at once, from whatever thread."""
    with suppress(OSError, ValueError):
        typer.echo(f"note: {text}", err=True)


def _wait_for_compilers(code: int) -> None:
    """Let loops be compiled that a thread compiles for later calls; all results are written."""
    first_calls = sys.modules.get("plenofir.refocus.first_calls")
    try:
        if first_calls:
            first_calls.wait_for_compilers()
    except (KeyboardInterrupt, SystemExit):
        # Python's own end would wait for the thread.
        os._exit(code)


def main() -> None:
    """Run the command line: whatever happens, one line on standard error and an exit code.

    0 done; 1 a difference or a failed frame; 2 input or surroundings that cannot be used; 3 a tool
    failed; 128 and the signal's number after a signal. With ``--debug`` the traceback comes first.
    """
    words = [word for word in sys.argv[1:] if word != "--debug"]
    compiling.tell = _note_now
    compiling.tell_of_long_ones(COMPILING_SECONDS, _note_now)
    for name in ("SIGTERM", "SIGHUP"):
        # Windows has no terminal that hangs up.
        if number := getattr(signal, name, None):
            signal.signal(number, _stopped)
    if isinstance(sys.stdout, TextIOWrapper):
        # File names need not be text.
        sys.stdout.reconfigure(errors="backslashreplace")
    message = ""
    try:
        try:
            code = run(words)
        finally:
            _flush(sys.stdout)
    except BaseException as error:
        code, message = explained(error)
        if len(words) < len(sys.argv) - 1:
            traceback.print_exception(error)
    with suppress(OSError):
        if message:
            typer.echo(f"plenofir: {message}", err=True)
        _flush(sys.stderr)
    _wait_for_compilers(code)
    sys.exit(code)
