"""Commands for the bitstream of the Atlys board: bitstream build, bitstream check."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from plenofir.commands.options import arithmetic_options
from plenofir.commands.rays import integer
from plenofir.errors import InputError
from plenofir.fpga.bitstream import ise, top_level
from plenofir.fpga.bitstream.check import run_checks
from plenofir.refocus import focus_to_shift, interpolation_order
from plenofir.refocus.arithmetic import StoredProductArithmetic

_SHOWN_WARNINGS = 20


def _line(name: str, text: str) -> None:
    typer.echo(f"{name:<11} {text}")


def board_generics(
    *,
    micro_image: str = "",
    focus: Sequence[str] = (),
    columns: str = "",
    interpolation: str = "",
    arith: str = "",
    fraction: str = "",
    guard: str = "",
) -> dict[str, top_level.Value]:
    """Generics of the top level that options mean; those not given keep the top level's defaults.

    Parameters
    ----------
    micro_image
        M in pixels.
    focus
        The set of a, fractions whose denominators divide M.
    columns
        Longest line in pixels.
    interpolation
        As in ``make sim``.
    arith, fraction, guard
        Arithmetic, as in ``make sim``.

    Returns
    -------
    dict
        Generic to value.

    Raises
    ------
    InputError
        If an option means nothing.
    """
    values: dict[str, top_level.Value] = {}
    if micro_image:
        values["MICRO_IMAGE_SIZE"] = integer(micro_image, "M")
    if focus:
        size = values.get("MICRO_IMAGE_SIZE", top_level.default_generics()["MICRO_IMAGE_SIZE"])
        shifts = [focus_to_shift(a, int(size), where="A") for a in focus]
        values["SHIFTS"] = " ".join(map(str, shifts))
    elif micro_image:
        raise InputError("M without a focus setting", where="A", expected="A or SWEEP with M")
    if columns:
        values["MAX_COLUMNS"] = integer(columns, "MAX_COLUMNS")
    if interpolation:
        values["INTERPOLATION_ORDER"] = interpolation_order(interpolation, where="INTERPOLATION")
    if arith:
        arithmetic = arithmetic_options(arith, fraction, guard)
        values["EXACT"] = not isinstance(arithmetic, StoredProductArithmetic)
        if isinstance(arithmetic, StoredProductArithmetic):
            values["FRACTION_BITS"] = arithmetic.fraction_bits
            values["GUARD_BITS"] = arithmetic.guard_bits
    elif fraction or guard:
        raise InputError("bits without an arithmetic", where="FRACTION, GUARD", expected="ARITH")
    for name, option in (("MICRO_IMAGE_SIZE", "M"), ("MAX_COLUMNS", "MAX_COLUMNS")):
        if int(values.get(name, 1)) < 1:
            raise InputError(f"{values[name]}", where=option, expected="an integer, 1 or more")
    return values


def scene_generics(path: str) -> dict[str, top_level.Value]:
    """Generics of the top level that a scene means.

    Parameters
    ----------
    path
        Scene profile.

    Returns
    -------
    dict
        Generic to value.

    Raises
    ------
    InputError
        If the scene cannot be built, or has no video path: then there is no board for it.
    """
    from plenofir.plan import load_scene, make_plan

    plan = make_plan(load_scene(path))
    if plan.path != "video":
        raise InputError(
            f"{plan.scene} is a core without pins of a board",
            where=f"{path}: build.path",
            expected='path = "video"; for a core: make synth, or plenofir configure and ISE',
        )
    return top_level.board_generics(plan.core)


def build(
    micro_image: Annotated[
        str, typer.Option("--micro-image", "-M", help="M: micro image size in pixels.")
    ] = "",
    a: Annotated[
        str, typer.Option("--a", "-a", help="Focus setting: a fraction, denominator M.")
    ] = "",
    sweep: Annotated[
        str, typer.Option(help="Several focus settings, to choose from on the board.")
    ] = "",
    columns: Annotated[str, typer.Option(help="Longest line in pixels.")] = "",
    interpolation: Annotated[
        str, typer.Option(help="nearest, linear, or the order of a B-spline, 0 to 3.")
    ] = "",
    arith: Annotated[str, typer.Option(help="exact, or stored (stored products).")] = "",
    fraction: Annotated[str, typer.Option(help="Stored products: fraction bits.")] = "",
    guard: Annotated[str, typer.Option(help="Stored products: guard bits.")] = "",
    scene: Annotated[str, typer.Option(help="Scene profile, instead of all of these.")] = "",
    out: Annotated[str, typer.Option(help="Folder for the results.")] = "build/bitstream",
    folder: Annotated[
        str, typer.Option("--ise", help="ISE_DS folder, if the tools are not on the PATH.")
    ] = "",
) -> None:
    """Build the bitstream of the Atlys board with Xilinx ISE 14.7."""
    given = board_generics(
        micro_image=micro_image,
        focus=tuple(sweep.replace(",", " ").split()) or ((a,) if a else ()),
        columns=columns,
        interpolation=interpolation,
        arith=arith,
        fraction=fraction,
        guard=guard,
    )
    if scene and given:
        raise InputError(
            f"settles {', '.join(given)} by itself", where="SCENE", expected="no other option"
        )
    generics = scene_generics(scene) if scene else given
    installation = ise.find_installation(folder)
    bars = Progress(
        TextColumn("{task.description:<20}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    )
    with bars:
        task = bars.add_task("bitstream", total=None)
        report = ise.build(
            installation,
            generics,
            Path(out),
            lambda tool, done, total: bars.update(
                task, description=tool, completed=done, total=total
            ),
        )
    for site, (used, there) in report.utilisation.items():
        _line(site, f"{used} of {there}")
    for entry in report.timing:
        best = "no path" if entry.best is None else f"{entry.best:g} ns would be met"
        _line("timing", f"{entry.constraint}: met, {best}")
    for warning in report.warnings[:_SHOWN_WARNINGS]:
        times = f" ({warning.times} times)" if warning.times > 1 else ""
        _line("warning", f"{warning.tool}: {warning.code}: {warning.text}{times}")
    rest = len(report.warnings) - _SHOWN_WARNINGS
    if rest > 0:
        _line("", f"{rest} more in report.json")
    _line("files", f"{out}/plenofir.bit, report.json, logs, work/")


def check() -> None:
    """Check without ISE what of a bitstream build can be checked."""

    def report(name: str, problems: Sequence[str], found: str) -> None:
        _line(name, f"{len(problems)} problems" if problems else f"ok: {found}")
        for problem in problems:
            typer.echo(f"  {problem}", err=True)

    number = run_checks(report)
    if number:
        raise InputError(
            f"{number} problem{'' if number == 1 else 's'}",
            where="bitstream check",
            expected="what is listed above put right",
        )


def register(app: typer.Typer) -> None:
    """Add the commands.

    Parameters
    ----------
    app
        The command line.
    """
    bitstream = typer.Typer(no_args_is_help=True, help="Bitstream of the Atlys board.")
    bitstream.command()(build)
    bitstream.command()(check)
    app.add_typer(bitstream, name="bitstream")
