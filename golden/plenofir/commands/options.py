# SPDX-License-Identifier: Apache-2.0
"""Options, declared once: their flags, types and ranges, and how a message names them."""

import re
from collections.abc import Callable, Container, Iterable, Mapping
from fractions import Fraction
from math import floor, inf, isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NoReturn

import typer

from plenofir.commands.option_names import FIELDS, VARIABLES
from plenofir.fpga.names import (
    ENGINE_ROWS,
    SLICE_ENGINE_NAMES,
    VHDL_SIMULATORS,
    EngineName,
    SliceEngineName,
    engines_with,
)
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.refocus.arithmetic import Arithmetic

ArithmeticKind = Literal["exact", "stored"]
InterpolationName = Literal["nearest", "linear", "0", "1", "2", "3"]
Bayer = Literal["rggb", "grbg", "gbrg", "bggr"]
Pixels = Literal["1", "2", "4", "8", "16", "32"]

# Each entry: an option, the option that decides whether it can be used, and with which values.
_REQUIRES: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("parallel_rows", "engine", engines_with("parallel_rows")),
    ("any_rows", "engine", engines_with("any_rows")),
    ("pixels", "engine", (*engines_with("pixels_per_clock"), "stack")),
    ("pixels", "arith", ("exact",)),
    ("radius", "engine", ("stack",)),
    ("interpolation", "engine", SLICE_ENGINE_NAMES),
    ("sharpen", "engine", SLICE_ENGINE_NAMES),
    ("sharpen", "arith", ("exact",)),
    ("sharpen", "chain", ("core", "csi")),
    ("box", "chain", ("core", "csi")),
    ("border", "arith", ("exact",)),
    ("border", "chain", ("core", "csi")),
    ("arith", "engine", SLICE_ENGINE_NAMES),
    ("fraction", "arith", ("stored",)),
    ("guard", "arith", ("stored",)),
    ("chain", "engine", SLICE_ENGINE_NAMES),
    ("board", "chain", ("hdmi",)),
    ("lanes", "chain", ("csi",)),
    ("raw_bits", "chain", ("csi",)),
    ("parallel_rows", "chain", ("core", "csi")),
    ("any_rows", "chain", ("core", "csi")),
    ("pixels", "chain", ("core",)),
    ("chain", "simulator", VHDL_SIMULATORS),
    ("waves", "simulator", VHDL_SIMULATORS),
    ("waves_depth", "waves", ("all",)),
)

# A mistyped step (0:1:0.0001) would fill a disk with pictures before anyone notices.
MAX_SETTINGS = 1000
# Decimals are taken for a multiple of 1/M that is at most this share of a step away.
_NEAR = Fraction(1, 4)

_of_make: dict[str, str] | None = None


def called_by_make(variables: dict[str, str] | None) -> None:
    """Say which variable of make each option came from; None after a call by hand."""
    global _of_make
    _of_make = variables


def typed(option: str, value: str = "") -> str:
    """An option, or its value, as the user typed or would type it."""
    if _of_make is None:
        return " ".join(filter(None, ("--" + option.replace("_", "-"), value)))
    # Makefiles have a variable for stacks, whose value is the slices.
    if option == "engine" and value == "stack":
        return "STACK"
    first = next((name for name, of in VARIABLES.items() if of == option), option)
    return "=".join(filter(None, (_of_make.get(option, first), value)))


def named(field: str, options: Container[str]) -> str:
    """A field as the user typed it, where it is one of these options of the command."""
    option = field if field in options else {**VARIABLES, **FIELDS}.get(field, field)
    return typed(option) if option in options else field


def check_combinations(used: Iterable[str], decided: Mapping[str, str]) -> None:
    """Refuse options that cannot be combined.

    `used` names those that are not at their default, `decided` has the values that decide.
    """
    used = set(used)
    for option, other, values in _REQUIRES:
        if option in used and other in decided and decided[other] not in values:
            possible = " or ".join(typed(other, value) for value in values)
            refuse_both(option, typed(other, decided[other]), f"it is for {possible}")


def arithmetic(kind: str, fraction: int | None, guard: int | None) -> "Arithmetic":
    """Arithmetic of the options arith, fraction and guard."""
    from pydantic import ValidationError

    from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic

    if kind == "exact":
        return ExactArithmetic()
    bits = {"fraction_bits": fraction, "guard_bits": guard}
    try:
        return StoredProductArithmetic.model_validate(
            {name: value for name, value in bits.items() if value is not None}
        )
    except ValidationError as error:
        guard_option, fraction_option = typed("guard"), typed("fraction")
        raise InputError(
            f"{error.errors()[0]['msg'].removeprefix('Value error, ')}; 0 <= "
            f"{guard_option} <= {fraction_option} <= 12",
            where=guard_option,
        ) from None


def boxes_of(text: str | None, shifts: tuple[int, ...], where: str = "box") -> tuple[int, ...]:
    """Samples of the box of each slice: one number for all, or one for each; empty for none."""
    words = (text or "").replace(",", " ").split()
    if not all(word.isdecimal() and word.isascii() for word in words):
        raise InputError(f"{text!r} must be whole numbers of samples", where=where)
    if len(words) not in (0, 1, len(shifts)):
        raise InputError(
            f"has {len(words)} numbers for {len(shifts)} focus settings; give one for all, or one "
            "for each",
            where=where,
        )
    numbers = tuple(map(int, words))
    return numbers * len(shifts) if len(words) == 1 else numbers


def focus_settings(
    texts: Iterable[str], micro_image_size: int, *, rounded: bool = True, where: str = "a"
) -> tuple[Fraction, ...]:
    """Focus settings of an option: fractions, decimals and ranges, each setting once.

    `rounded`: decimals stand for a multiple of 1/M that is near, which is noted.
    """
    settings: list[Fraction] = []
    rounded_words: dict[str, Fraction] = {}

    def setting(text: str) -> Fraction:
        return _focus_setting(text, micro_image_size if rounded else None, rounded_words, where)

    words = [word for text in texts for word in re.split(r"[,\s]+", text.strip()) if word]
    for word in words:
        parts = word.split(":")
        if len(parts) == 1:
            settings.append(setting(word))
            continue
        if len(parts) > 3:
            raise InputError(f"{word!r} is not a range; write FIRST:LAST[:STEP]", where=where)
        first, last = (setting(part) for part in parts[:2])
        step = setting(parts[2]) if parts[2:] else Fraction(1, micro_image_size)
        if step <= 0 or first > last:
            raise InputError(
                f"{word!r} is empty: FIRST must not be above LAST, and STEP must be positive",
                where=where,
            )
        # Counted before a list is made: the range may have any number of settings.
        count = (last - first) // step + 1
        if count > MAX_SETTINGS:
            raise InputError(
                f"{word!r} has {count} settings, more than {MAX_SETTINGS}", where=where
            )
        settings += [first + n * step for n in range(count)]
    if not settings:
        raise InputError("give a focus setting, such as -3/5", where=where)
    # Files of slices are named by their setting: the second would replace the first.
    twice = next((a for n, a in enumerate(settings) if a in settings[:n]), None)
    if twice is not None:
        raise InputError(f"{twice} is given twice", where=where)
    if rounded_words:
        notes = ", ".join(f"{text} as {value}" for text, value in rounded_words.items())
        typer.echo(f"note: a = {notes}, in steps of 1/{micro_image_size}", err=True)
    return tuple(settings)


def _focus_setting(
    text: str, micro_image_size: int | None, rounded_words: dict[str, Fraction], where: str
) -> Fraction:
    """A focus setting; decimals stand for the multiple of 1/M within a quarter of a step."""
    from plenofir.refocus.shifts import parse_focus, shift_to_text

    decimal = re.fullmatch(r"[+-]?(\d+\.\d*|\.\d+)", text)
    if decimal is None:
        return parse_focus(text, where=where)
    exact = Fraction(text)
    if micro_image_size is None:
        return exact
    m = micro_image_size
    nearest = round(exact * m)
    if abs(exact * m - nearest) > _NEAR:
        below = floor(exact * m)
        neighbours = " and ".join(shift_to_text(shift, m) for shift in (below, below + 1))
        raise InputError(f"{text} lies between {neighbours}; use a multiple of 1/{m}", where=where)
    nearest_setting = Fraction(nearest, m)
    if nearest_setting != exact:
        rounded_words[text] = nearest_setting
    return nearest_setting


def finite(value: float) -> float | None:
    """Number for JSON, which has no infinity."""
    return value if isfinite(value) else None


def require(option: str, other: str, missing: bool) -> None:
    """Refuse an option that another one is missing for."""
    if missing:
        raise InputError(f"{typed(option)} requires {typed(other)}")


def refuse_both(option: str, other: str, advice: str = "use one of them") -> NoReturn:
    """Refuse an option beside something else that was typed."""
    raise InputError(f"{typed(option)} cannot be combined with {other}; {advice}")


def refuse_used(used: Mapping[str, object], reason: str) -> None:
    """Refuse the first option with a value, which is for something else."""
    for option in filter(used.get, used):
        raise InputError(f"{reason}; leave it out", where=typed(option))


def shifts_of(settings: Iterable[Fraction], micro_image_size: int) -> tuple[int, ...]:
    """The shifts a' = a M of focus settings, all of them on the grid of M."""
    from plenofir.refocus.shifts import focus_to_shift

    return tuple(focus_to_shift(a, micro_image_size, where="a") for a in settings)


def one_focus_setting(
    texts: Iterable[str], micro_image_size: int, *, rounded: bool = True
) -> Fraction:
    """The only focus setting of a command that takes one; `rounded` as in `focus_settings`."""
    settings = focus_settings(texts, micro_image_size, rounded=rounded)
    if len(settings) > 1:
        raise InputError(f"takes one focus setting, not {len(settings)}", where="a")
    return settings[0]


def _finite(param: typer.CallbackParam, value: float | None) -> float | None:
    if value is not None and not isfinite(value):
        raise InputError(f"{value} is not a finite number", where=str(param.name))
    return value


def _distance(param: typer.CallbackParam, value: float | None) -> float | None:
    if value is not None and (isnan(value) or value == -inf):
        raise InputError(
            f"{value} is not a distance; give a number of mm, or inf", where=str(param.name)
        )
    return value


def _sharpening(param: typer.CallbackParam, value: str | None) -> str | None:
    from plenofir.refocus.sharpening import check_sharpen

    if value is None:
        return None
    # As make's switches are set.
    value = {"0": "off", "1": "auto"}.get(value, value)
    check_sharpen(value, where=str(param.name))
    return value


def number(flag: str, help_text: str, callback: Callable[..., float | None] = _finite) -> object:
    """Declare an option that takes a finite number."""
    return typer.Option(flag, help=help_text, callback=callback)


def numbers(flag: str, help_text: str) -> object:
    """Declare an option that takes finite numbers, repeated."""

    def all_finite(param: typer.CallbackParam, values: list[float] | None) -> list[float]:
        for value in values or ():
            _finite(param, value)
        return values or []

    return typer.Option(flag, help=help_text, callback=all_finite)


_MM = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3}


def length_mm(text: str | float) -> float:
    """Length in mm of a number, or of one with its unit: 50mm, 3m, 5um."""
    match = re.fullmatch(r"(.*?)\s*(um|mm|cm|m)", str(text).strip())
    try:
        return float(text) if match is None else float(match[1]) * _MM[match[2]]
    except ValueError:
        raise InputError(
            f"{text!r} is not a length; write a number of mm, or one with its unit: 50mm, 5um, 3m"
        ) from None


def distance(flag: str, help_text: str) -> object:
    """Declare an option that takes a distance in mm, or inf."""
    return typer.Option(
        flag, help=help_text, callback=_distance, parser=length_mm, metavar="LENGTH"
    )


# What several commands take.
_MICRO_IMAGE = typer.Option("--micro-image", "-M", min=1, help="M: micro image size in pixels.")
_SETTINGS = typer.Option(
    "--a",
    "-a",
    metavar="LIST",
    help="Focus settings a: multiples of 1/M such as -3/5, decimals close to one, or ranges "
    "FIRST:LAST[:STEP]; blanks or commas between them. May be repeated.",
)
_FRACTION = typer.Option(help="Fraction bits F of stored products (arith stored).", min=0, max=12)
_GUARD = typer.Option(help="Guard bits G of stored products (arith stored).", min=0, max=12)
_RADIUS = typer.Option(
    help="Depth index: sharpness is averaged over this many micro images to each side.",
    min=0,
    max=8,
)
_ENGINES = ", ".join(f"{name} ({row.method})" for name, row in ENGINE_ROWS.items())
_ENGINE = typer.Option(help=f"How the core computes: {_ENGINES}.")
_ENGINE_OR_STACK = typer.Option(
    help=f"How the core computes: {_ENGINES}, stack (all focus settings in one pass)."
)
_INTERPOLATION = typer.Option(
    help="Interpolation between micro lenses: nearest, linear, or the order of a B-spline."
)
_SHARPEN = typer.Option(
    help="Undo the blur that refocusing adds where a is no integer: auto, off, or the weight b "
    "(such as 1/16) of a filter with the taps -b, 1 + 2b, -b, one micro lens apart.",
    callback=_sharpening,
)
_ARITH = typer.Option(
    help="Arithmetic: exact (integer sums, one division), or stored (products by 1/M from a table)."
)
_SCENE = typer.Option(
    help="Scene, a TOML file or the name of a shipped one; it sets all options of the core."
)

MicroImage = Annotated[int, _MICRO_IMAGE]
FocusSettings = Annotated[list[str], _SETTINGS]
FocusSetting = Annotated[
    list[str] | None,
    typer.Option("--a", "-a", metavar="FRACTION", help="Focus setting, such as -3/5."),
]
Interpolation = Annotated[InterpolationName, _INTERPOLATION]
Sharpen = Annotated[str, _SHARPEN]
Radius = Annotated[int, _RADIUS]
OutFolder = Annotated[str, typer.Option("--out", help="Folder for the results.")]
OutPng = Annotated[str, typer.Option("--out", help="PNG file to write.")]
PlotFile = Annotated[
    Path | None, typer.Option("--plot", help="Draw the result into this file: .svg, .pdf or .png.")
]
CsvFile = Annotated[
    Path | None, typer.Option("--csv", help="Write the numbers into this CSV file.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
_CAMERA = typer.Option(
    "--camera", help="Camera, a TOML file or the name of a shipped one (plenofir cameras)."
)
Camera = Annotated[str, _CAMERA]
Focus = Annotated[
    float,
    distance(
        "--focus", "Distance that the camera was focused on, in mm from the micro lenses, or inf."
    ),
]
LightField = Annotated[
    str,
    typer.Argument(
        help="Light field: an aligned raw image (micro images of exactly M x M pixels), or views "
        "in a folder, a mosaic, a film or a .mat file."
    ),
]
_BORDER = typer.Option(
    "--border",
    help="Near the border some views are missing: normalise divides by the number of the others, "
    "zero counts the missing ones as black, which darkens the border.",
)
Border = Annotated[Literal["normalise", "zero"], _BORDER]
_EXPOSURE = typer.Option(
    help="Exposure: auto, the default, takes black and white levels from the picture; a number "
    "adds EV (1 doubles the light) to the values as they are, auto+1 to auto; off changes nothing."
)
Exposure = Annotated[str, _EXPOSURE]
ExposureIfGiven = Annotated[str | None, _EXPOSURE]
Gamma = Annotated[
    float | None,
    typer.Option(
        help="Gamma of the result; by default 2.2 if the file holds linear light, else 1.",
        min=0.2,
        max=5.0,
    ),
]
Box = Annotated[
    int | None,
    typer.Option(
        "--box",
        metavar="B",
        help="Average B of the M views along a dimension, or where that is no multiple of "
        "gcd(a M, M), the next larger number that is one; M by default.",
        min=1,
    ),
]
Boxes = Annotated[
    str | None,
    typer.Option(
        "--box",
        metavar="LIST",
        help="Average B of the M views along a dimension: a multiple of gcd(a M, M) for all focus "
        "settings, or one for each, with blanks or commas between them; M by default.",
    ),
]
Upsample = Annotated[
    bool,
    typer.Option(
        "--upsample/--no-upsample",
        help="Size of the result: that of the raw image, or one pixel for each micro lens.",
    ),
]

Aperture = Annotated[
    str | None,
    typer.Option(
        "--aperture",
        metavar="SIZE[,RIGHT,DOWN]",
        help="Round aperture: its diameter, 1 for that of the pupil, and its centre, -1 to 1 from "
        "the pupil's left to its right edge and from top to bottom. By default all views count.",
    ),
]
Tilt = Annotated[
    str | None,
    typer.Option(
        "--tilt",
        metavar="RIGHT,DOWN",
        help="Tilt the focal plane: by how much a grows from the middle of the picture to its "
        "right edge and to its bottom.",
    ),
]

# Options of a command that has defaults of its own, or can do without.
SharpenIfGiven = Annotated[str | None, _SHARPEN]
BorderIfGiven = Annotated[Literal["normalise", "zero"] | None, _BORDER]
CameraIfGiven = Annotated[str | None, _CAMERA]
MicroImageIfGiven = Annotated[int | None, _MICRO_IMAGE]
SettingsIfGiven = Annotated[list[str] | None, _SETTINGS]
Heights = Annotated[
    list[str] | None,
    typer.Option(
        "--z",
        metavar="LIST",
        help="Planes by their heights in um over the plane in focus, towards the objective, in "
        "place of -a: FIRST:LAST[:STEP]. Of volumes, with a microscope as --camera.",
    ),
]
EngineIfGiven = Annotated[SliceEngineName | None, _ENGINE]
EngineOrStack = Annotated[EngineName, _ENGINE_OR_STACK]
InterpolationIfGiven = Annotated[InterpolationName | None, _INTERPOLATION]
Arith = Annotated[ArithmeticKind, _ARITH]
ArithIfGiven = Annotated[ArithmeticKind | None, _ARITH]
FractionIfGiven = Annotated[int | None, _FRACTION]
GuardIfGiven = Annotated[int | None, _GUARD]
SceneIfGiven = Annotated[str | None, _SCENE]
