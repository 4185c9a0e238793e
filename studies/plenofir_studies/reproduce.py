# SPDX-License-Identifier: Apache-2.0
"""``plenofir reproduce``: a table or a figure of the thesis by its number, computed anew."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands.console import print_json, print_table
from plenofir.commands.options import AsJson, finite
from plenofir.commands.results import check_file
from plenofir.ground.errors import InputError
from plenofir_studies.thesis_tables import TABLES

if TYPE_CHECKING:
    from plenofir.refocus.operator import Image

app = typer.Typer()


@dataclass(frozen=True)
class Figure:
    """A figure of the thesis that can be drawn anew."""

    what: str
    draw: "Callable[[], Image]"


def _rays(name: str) -> "Callable[[], Image]":
    def draw() -> "Image":
        from plenofir_studies import ray_pictures

        picture: Callable[[], Image] = getattr(ray_pictures, name)
        return picture()

    return draw


def _sharpness() -> "Image":
    from plenofir_studies.experiments_report import sharpness_pictures

    return sharpness_pictures()


def _disparity(number: str) -> "Callable[[], Image]":
    def draw() -> "Image":
        from plenofir_studies.experiments_report import disparity_maps

        return disparity_maps(number)[1]

    return draw


FIGURES = {
    "5.1": Figure("dispersion of the micro lenses' glass", _rays("dispersion_picture")),
    "5.6": Figure("real rays around refocused planes, by the f100 lens", _rays("meetings_picture")),
    "5.7": Figure("the same for other sizes of micro images", _rays("meetings_picture")),
    "5.9": Figure("distances of Tables 5.5 to 5.7", _rays("distances_picture")),
    "5.10": Figure("depths of field, focused to 3 m", _rays("depths_of_field_picture")),
    "5.16": Figure("sharpness over the focus setting, by the synthetic camera", _sharpness),
    "5.17": Figure("disparity maps, focus at infinity, synthetic camera", _disparity("5.17")),
    "5.18": Figure("disparity maps, focus at 4 m, synthetic camera", _disparity("5.18")),
}
ELSEWHERE = {
    "2.12": "`plenofir report calibration` compares Fourier slices with the other ways",
    "4.2": "`plenofir inspect a.tif b.tif c.tif --position ...` finds the sharpest picture",
    "4.3": "`plenofir inspect WHITE --collimator STAR` tells how far off infinity the lens is",
    "4.4": "`plenofir inspect WHITE` tells whether micro images overlap, touch or leave gaps",
    "4.6": "`plenofir calibrate WHITE --picture FILE` draws the centres that it found",
    "4.12": "`plenofir report numbers` measures what rounded centres cost",
    "5.2": "`plenofir lens f100` computes what it shows from the shipped prescription",
    **dict.fromkeys(
        ("5.3", "5.4", "5.5"), "`plenofir cameras --json` has what it shows of f193, f90 and f197"
    ),
    "5.8": "`plenofir distance --camera f193-mla2 --focus 3000 --a 1 --plot FILE` draws it",
    "5.11": "`plenofir calibrate WHITE --camera CAMERA` measures the pupil of a white image",
    **dict.fromkeys(
        ("6.3", "6.5", "6.7", "6.11"), "`make waves` draws the timing diagrams from simulations"
    ),
    **dict.fromkeys(
        ("6.2", "6.4", "6.6", "6.8", "6.9", "6.10"), "docs/fir-array.md draws the architecture"
    ),
    **dict.fromkeys(
        ("5.12", "5.13", "5.14", "5.15"),
        "it shows the author's captures; `plenofir reproduce figure 5.16` measures the sharpness "
        "of the synthetic camera's",
    ),
    "6.12": "`make sim` refocuses a photograph in the VHDL",
    "6.13": "`plenofir report numbers` measures the resolution of each interpolation",
}
"""Figures whose content another command or page has."""


def table_or_figure(words: Sequence[str]) -> tuple[str, str]:
    """Kind and number from ``5.5``, ``table 5.5``, ``figure 5.9`` or ``Fig. 5.9``.

    A number alone means the table, or the figure where there is no such table.
    """
    match = re.fullmatch(
        r"(table|tab\.?|figure|fig\.?)?\s*(\d+\.\d+)", " ".join(words).strip().lower()
    )
    if match is None:
        raise InputError(
            f"{' '.join(words)!r} names no table or figure; write 5.5, table 5.5 or figure 5.9"
        )
    kind, number = match.groups()
    if kind is None:
        kind = "table" if number in TABLES else "figure"
    return "table" if kind.startswith("tab") else "figure", number


def _table_rows(number: str) -> list[dict[str, object]]:
    """Printed numbers of a table beside the model's, from both kinds of image distances."""
    from plenofir_studies.ray_validation import all_checks

    unrounded = all_checks(rounded=False)
    return [
        {
            "part": check.table.removeprefix(number),
            "row": check.row,
            "quantity": check.quantity,
            "printed": check.printed.text,
            "computed": check.computed,
            "decimals": check.printed.decimals,
            "from_own_image_distance": alone.computed,
            "agrees": check.agrees,
            "agrees_alone": alone.agrees,
            "erratum": check.erratum,
        }
        for check, alone in zip(all_checks(), unrounded, strict=True)
        if re.fullmatch(rf"{re.escape(number)}[a-c]?", check.table)
    ]


def _verdict(row: dict[str, object]) -> str:
    if row["erratum"]:
        return "erratum"
    if not row["agrees"]:
        return "differs"
    return "agrees" if row["agrees_alone"] else "agrees from rounded b_U"


def _digits(value: object, decimals: object) -> str:
    assert isinstance(value, float)
    assert isinstance(decimals, int)
    return "inf" if value == inf else f"{value:.{decimals + 2}f}"


def errata_of(kind: str, number: str) -> list[tuple[str, str, str]]:
    """Errata about a table or figure: where, printed, holds."""
    from plenofir_studies.errata import ERRATA

    return [
        (erratum.where, erratum.printed, erratum.holds)
        for erratum in ERRATA.values()
        if _mentions(erratum.where, kind, number)
    ]


def _mentions(where: str, kind: str, number: str) -> bool:
    name = "Tables?" if kind == "table" else r"Figs?\."
    chapter, _, local = number.partition(".")
    for listed in re.findall(rf"{name} ([\d.a-c(), and]+(?: to [\d.]+)?)", where):
        numbers = [int(n) for n in re.findall(rf"{chapter}\.(\d+)", listed)]
        if " to " in listed and len(numbers) == 2:
            numbers = list(range(numbers[0], numbers[1] + 1))
        if int(local) in numbers:
            return True
    return False


def _print_table(number: str, as_json: bool) -> None:
    from plenofir_studies.thesis_tables import load_table

    if number not in TABLES:
        raise InputError(
            f"the project has no table {number}; it has {TABLES[0]} to {TABLES[-1]}, all that the "
            "ray model predicts"
        )
    rows = _table_rows(number)
    errata = errata_of("table", number)
    if as_json:
        print_json(
            {
                "table": number,
                "topic": load_table(number).topic,
                "rows": [
                    {k: finite(v) if isinstance(v, float) else v for k, v in row.items()}
                    for row in rows
                ],
                "errata": [
                    dict(zip(("where", "printed", "holds"), e, strict=True)) for e in errata
                ],
            }
        )
        return
    cells = [
        [
            str(row["part"]),
            str(row["row"]),
            str(row["quantity"]),
            str(row["printed"]),
            _digits(row["computed"], row["decimals"]),
            _digits(row["from_own_image_distance"], row["decimals"]),
            _verdict(row),
        ]
        for row in rows
    ]
    heads = ["part", "row", "quantity", "printed", "computed", "from own b_U", ""]
    if not any(row["part"] for row in rows):
        heads, cells = heads[1:], [row[1:] for row in cells]
    print_table(
        heads,
        cells,
        title=f"Table {number}: {load_table(number).topic}",
        left=("part", "row", "quantity", ""),
        width=150,
    )
    agree = sum(bool(row["agrees"]) for row in rows)
    alone = sum(bool(row["agrees_alone"]) for row in rows)
    typer.echo(
        f"{agree} of {len(rows)} agree in every printed digit from the rounded image distances b_U "
        f"of Table 5.2 (computed), {alone} from the distance in focus alone (from own b_U)"
    )
    _print_errata(errata)


def _print_errata(errata: Sequence[tuple[str, str, str]]) -> None:
    for where, printed, holds in errata:
        typer.echo(f"erratum: {where}\n  printed: {printed}\n  holds: {holds}")


@app.command()
def reproduce(
    what: Annotated[
        list[str],
        typer.Argument(help="Number of a table or figure: 5.5, table 5.5, figure 5.9."),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="PNG of a figure; figure_5_9.png without it.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """A table or figure of the thesis, computed anew beside what is printed, with its errata."""
    kind, number = table_or_figure(what)
    if kind == "table":
        if out is not None:
            raise InputError("--out is the PNG of a figure; a table is printed")
        _print_table(number, as_json)
        return
    if as_json:
        raise InputError("--json is for tables; a figure is written as PNG")
    if number in ELSEWHERE:
        raise InputError(f"figure {number} is not drawn here; {ELSEWHERE[number]}")
    if number not in FIGURES:
        raise InputError(
            f"figure {number} is not drawn anew (docs/thesis.md says where its content is); these "
            f"are: {', '.join(FIGURES)}"
        )
    from plenofir.ground.images import write_png

    path = check_file(str(out or f"figure_{number.replace('.', '_')}.png"), (".png",))
    write_png(path, FIGURES[number].draw())
    typer.echo(f"Figure {number}: {FIGURES[number].what}")
    typer.echo(f"picture: {path}")
    _print_errata(errata_of("figure", number))
