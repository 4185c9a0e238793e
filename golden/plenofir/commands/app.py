"""The command ``plenofir``: puts the groups of commands together and words their errors."""

import os
import sys
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

from plenofir.commands import batch, bitstream, capture, pictures, plan, rays, report, sim, waves
from plenofir.commands.make_variables import arguments_of_make
from plenofir.commands.options import called_by_make, named
from plenofir.errors import EXIT_BAD_INPUT, EXIT_TOOL_FAILED, InputError, ToolError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Real-time refocusing for standard plenoptic cameras.",
)


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        from plenofir import __version__

        typer.echo(__version__)
        raise typer.Exit


for group in (sim, rays, plan, capture, pictures, batch):
    app.registered_commands += group.app.registered_commands
for name, group in (("bitstream", bitstream), ("waves", waves), ("report", report)):
    app.add_typer(group.app, name=name)


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
        return f"{where}: is missing; expected a value"
    first = cause.errors()[0]
    text = first["msg"].partition("Input should be ")[2] or first["msg"].partition("is not ")[2]
    return f"{where}: {first['input']!r}; expected {text.partition(', unable')[0].rstrip('.')}"


def main() -> None:
    """Run the command line; user errors become one line on standard error."""
    command: Any = typer.main.get_command(app)
    arguments = sys.argv[1:]
    by_make = arguments[:1] == ["--make"]
    arguments = arguments[by_make:]
    parameters = _parameters(command, arguments)
    # Errors about make's variables name these already.
    options: Mapping[str, Any] = {} if by_make else parameters
    called_by_make(None)
    try:
        if by_make:
            found, variables = arguments_of_make(arguments[0], parameters, os.environ)
            called_by_make(variables)
            arguments += found
            options = parameters
        sys.exit(command.main(arguments, prog_name="plenofir", standalone_mode=False) or 0)
    except InputError as error:
        where = named(error.where, options)
        _fail(str(InputError(error.what, where=where, expected=error.expected)))
    except ToolError as error:
        kind = "simulation failed: " if type(error).__name__ == "SimulationError" else ""
        _fail(f"{kind}{error}", EXIT_TOOL_FAILED)
    except typer.exceptions.TyperException as error:
        _fail(_usage_error(error, options))
    except (KeyboardInterrupt, typer.Abort):
        sys.exit(130)


def _fail(message: str, code: int = EXIT_BAD_INPUT) -> None:
    if message:
        typer.echo(f"plenofir: {message}", err=True)
    sys.exit(code)
