# SPDX-License-Identifier: Apache-2.0
"""Commands for waveform files: waves compare."""

from collections.abc import Sequence
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import options
from plenofir.commands.console import print_json, progress_bar
from plenofir.ground.errors import EXIT_MISMATCH

if TYPE_CHECKING:
    from plenofir.fpga.simulate.dump_compare import DumpComparison

app = typer.Typer(no_args_is_help=True, help="Compare waveform files.")

# What lies behind the first difference of a pipeline differs by it: more lines tell little.
_MOST_DIFFERENCES = 8


def _content(value: Any) -> Any:
    """Value for JSON: times as text."""
    if isinstance(value, Fraction):
        from plenofir.fpga.tools.dumps import time_text

        return time_text(value)
    if isinstance(value, dict):
        return {key: _content(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_content(entry) for entry in value]
    return value


def _line(name: str, text: str) -> None:
    typer.echo(f"{name:<15} {text}")


def _signals(number: int) -> str:
    return f"{number} signal{'' if number == 1 else 's'}"


def _print_names(name: str, signals: Sequence[str], listed: bool) -> None:
    hint = " (--list names them)" if signals and not listed else ""
    _line(name, f"{_signals(len(signals))}{hint}")
    for signal in signals if listed else ():
        typer.echo(f"  {signal}")


def _print_comparison(result: "DumpComparison", listed: bool) -> None:
    unit = f"cycles of {result.clock}" if result.clock else "instants"
    _line("compared", f"{_signals(result.signals)}, {result.samples} {unit}")
    for name, signals in (
        ("only in A", result.only_in_a),
        ("only in B", result.only_in_b),
        ("not comparable", result.not_comparable),
        ("never defined", result.never_defined),
    ):
        # "only in A: none" is news of a comparison, an empty list of the others is not.
        if signals or name.startswith("only"):
            _print_names(name, signals, listed)
    if result.cycles_a != result.cycles_b:
        _line("length differs", f"{result.cycles_a} cycles in A, {result.cycles_b} in B")
    for number, difference in enumerate(result.differences):
        if number == _MOST_DIFFERENCES and not listed:
            rest = _signals(len(result.differences) - number)
            _line("", f"{rest} more (--list names them)")
            break
        _line(("first differs", "then", "")[min(number, 2)], str(difference))
    _line("result", "equal" if result.equal else "different")


# A callback makes `compare` a word of the command line even though it stands alone.
@app.callback()
def _group() -> None:
    pass


@app.command()
def compare(
    a: Annotated[
        str, typer.Argument(help="First waveform file: VCD, FST or GHW.", show_default=False)
    ],
    b: Annotated[
        str, typer.Argument(help="Second waveform file: VCD, FST or GHW.", show_default=False)
    ],
    signals: Annotated[
        list[str] | None,
        typer.Option(
            "--signals",
            "-s",
            help="Signals or scopes to compare, with the wildcards * and ?; may be repeated. "
            "By default all.",
        ),
    ] = None,
    begin: Annotated[
        str, typer.Option("--from", help="First time (120ns, 1.5us) or cycle (40) to compare.")
    ] = "",
    end: Annotated[str, typer.Option("--to", help="Last time or cycle to compare.")] = "",
    clock: Annotated[
        str,
        typer.Option(
            "--clock",
            help="Clock at whose edges to compare; by default the outermost clk. none compares at "
            "every change.",
        ),
    ] = "",
    strict: Annotated[
        bool, typer.Option("--strict", help="Compare undefined values (U, X, Z, ...) too.")
    ] = False,
    listed: Annotated[
        bool,
        typer.Option(
            "--list", help="List the signals that only one file has or that cannot be compared."
        ),
    ] = False,
    as_json: options.AsJson = False,
) -> None:
    """Compare two waveform files cycle by cycle: exit code 0 if equal, 1 if not."""
    from plenofir.fpga.simulate.dump_compare import compare_dumps, parse_bound

    bounds = {
        name: parse_bound(text, option) if text else None
        for name, text, option in (("begin", begin, "--from"), ("end", end, "--to"))
    }
    with progress_bar("compare") as show:
        result = compare_dumps(
            Path(a),
            Path(b),
            signals=signals or (),
            clock=clock,
            strict=strict,
            progress=show,
            **bounds,
        )
    if as_json:
        content = {"a": a, "b": b, "equal": result.equal, **_content(asdict(result))}
        print_json(content)
    else:
        _print_comparison(result, listed)
    if not result.equal:
        raise typer.Exit(EXIT_MISMATCH)
