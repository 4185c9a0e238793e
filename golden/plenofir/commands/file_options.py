# SPDX-License-Identifier: Apache-2.0
"""Options of all commands that read light fields: what a person may say about a file."""

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, Literal

import typer

from plenofir.commands.options import MicroImageIfGiven

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
        from plenofir.camera.captures.colours import told_gains

        told_gains(value)
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


def takes_light_fields(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of `Hints`; the command gets them together, as `hints`."""

    @functools.wraps(command)
    def with_hints(**values: Any) -> None:
        from plenofir.camera.recognise.source import Hints

        command(hints=Hints(**{name: values.pop(name) for name in _HINTS}), **values)

    def keyword(name: str, annotation: Any, default: Any) -> inspect.Parameter:
        kind = inspect.Parameter.KEYWORD_ONLY
        return inspect.Parameter(name, kind, default=default, annotation=annotation)

    signature = inspect.signature(command)
    own = [
        keyword(name, one.annotation, one.default)
        for name, one in signature.parameters.items()
        if name != "hints"
    ]
    added = [keyword(name, *of) for name, of in _HINTS.items()]
    with_hints.__signature__ = inspect.Signature(own + added)  # type: ignore[attr-defined]
    with_hints.__annotations__ = {one.name: one.annotation for one in own + added}
    return with_hints
