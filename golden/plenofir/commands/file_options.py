# SPDX-License-Identifier: Apache-2.0
"""Options of all commands that read light fields: what a person may say about a file."""

from inspect import Parameter
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from plenofir.commands.groups import Command, grouped, spread
from plenofir.commands.options import MicroImageIfGiven

if TYPE_CHECKING:
    from plenofir.camera.recognise.source import Hints

BayerIfGiven = Annotated[
    Literal["rggb", "grbg", "gbrg", "bggr", "none"] | None,
    typer.Option(
        "--bayer",
        help="Colours of a sensor's first four pixels, if it has a colour mosaic; none if it is "
        "taken for one.",
        case_sensitive=False,
    ),
]


def _balance(value: str) -> str:
    # Colours of what is read come long after the command begins.
    if value not in ("auto", "off"):
        from plenofir.camera.captures.colours import gains_of_text

        gains_of_text(value)
    return value


WhiteBalance = Annotated[
    str,
    typer.Option(
        "--white-balance",
        metavar="auto|off|RED,BLUE",
        help="auto: captures by the white image, or by the neutral of a DNG. RED,BLUE: what their "
        "red and blue are multiplied by, over green, instead; of other pictures, what their light "
        "is. off: captures as the sensor has them.",
        callback=_balance,
    ),
]
Roi = Annotated[
    str | None,
    typer.Option(
        "--roi",
        metavar="COLUMN,ROW",
        help="Where captures begin that are a part of the white image's pixels.",
    ),
]

# What a person may say about a light field: `plenofir.camera.recognise.Hints`, by its fields.
_HINTS: dict[str, tuple[Any, Any]] = {
    "micro_image": (MicroImageIfGiven, None),
    "layout": (
        Annotated[
            Literal["auto", "mosaic", "raster"],
            typer.Option(
                help="How the views lie in a picture: mosaic (side by side) or raster (micro "
                "images)."
            ),
        ],
        "auto",
    ),
    "order": (
        Annotated[
            Literal["rows", "columns"] | None,
            typer.Option(
                help="What the first number of the views counts; without it their motion tells."
            ),
        ],
        None,
    ),
    "flip": (
        Annotated[
            Literal["none", "rows", "columns", "both"] | None,
            typer.Option(
                help="Views counted from below (rows), from the right (columns) or both; without "
                "it their motion tells, but for both."
            ),
        ],
        None,
    ),
    "bayer": (BayerIfGiven, None),
    "white_balance": (WhiteBalance, "auto"),
    "roi": (Roi, None),
    "crop": (
        Annotated[
            str | None,
            typer.Option(
                "--crop",
                metavar="LEFT,TOP,WIDTH,HEIGHT",
                help="Take a part of the light field only, in pixels of a refocused picture (of "
                "views: of a view), rounded outwards to whole micro images.",
            ),
        ],
        None,
    ),
}


def takes_light_fields(command: Command) -> Any:
    """Give a command the options of `Hints`, which it gets together as `hints`, and its groups."""

    def hints(**values: Any) -> "Hints":
        from plenofir.camera.recognise.source import Hints

        return Hints(**values)

    parameters = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, (annotation, default) in _HINTS.items()
    ]
    return grouped(spread(command, {"hints": (parameters, hints)}))
