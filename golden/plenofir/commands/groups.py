# SPDX-License-Identifier: Apache-2.0
"""Groups of options: dataclasses whose fields a command takes as options of its own."""

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from fractions import Fraction
from inspect import Parameter, Signature, signature
from math import ceil, floor, inf
from typing import Any, get_type_hints

from plenofir.commands import options

Command = Callable[..., None]


def spread(
    command: Command, groups: Mapping[str, tuple[list[Parameter], Callable[..., Any]]]
) -> Any:
    """A command that takes options in place of some parameters.

    Each of these comes with its options, and with what makes its value of them.
    """

    @functools.wraps(command)
    def with_options(**values: Any) -> None:
        together = {
            name: make(**{option.name: values.pop(option.name) for option in options})
            for name, (options, make) in groups.items()
        }
        command(**together, **values)

    parameters = [
        option.replace(kind=Parameter.KEYWORD_ONLY)
        for name, parameter in signature(command).parameters.items()
        for option in (groups[name][0] if name in groups else [parameter])
    ]
    # Typer reads options from both of these.
    with_options.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {one.name: one.annotation for one in parameters}
    return with_options


def _options_of(group: type[Any]) -> list[Parameter]:
    """The fields of a dataclass as parameters."""
    hints = get_type_hints(group, include_extras=True)
    return [
        Parameter(
            field.name,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]


def grouped(command: Command) -> Any:
    """Give a command the options of each parameter that is a dataclass, in its place."""
    groups: dict[str, tuple[list[Parameter], Callable[..., Any]]] = {}
    for parameter in signature(command).parameters.values():
        group = parameter.annotation
        if isinstance(group, type) and is_dataclass(group):
            groups[parameter.name] = _options_of(group), group
    return spread(command, groups)


@dataclass(frozen=True)
class CameraData:
    """The camera of a light field, and what it was focused on."""

    camera: options.CameraIfGiven = None
    focus: options.Focus = inf

    def check(self) -> None:
        """Refuse a focus without a camera."""
        options.require("focus", "camera", self.focus != inf and self.camera is None)


@dataclass(frozen=True)
class Pupil:
    """The views that count: of all pixels, or of each; and the tilt of the focal plane."""

    aperture: options.Aperture = None
    tilt: options.Tilt = None
    box: options.Box = None

    def how(self) -> dict[str, Any]:
        """Options of `plenofir.refocus.best_picture`."""
        from plenofir.commands.looks import aperture_of, tilt_of

        if self.box is not None:
            self.refuse_beside("--box")
        return {
            "aperture": aperture_of(self.aperture),
            "tilt": tilt_of(self.tilt),
            "box": self.box,
        }

    def words(self, m: int, settings: Iterable[Fraction]) -> list[str]:
        """Lines that name the larger boxes of focus settings that cannot have the box asked for."""
        from plenofir.refocus.operator import least_box

        lines = []
        for setting in settings if self.box else ():
            shift = setting * m
            # Between multiples of 1/M, the pictures before and after are mixed.
            size = max(least_box(m, near, self.box) for near in {floor(shift), ceil(shift)})
            if size != self.box:
                lines.append(
                    f"box: {size} in place of {self.box} at a = {setting}, the least that is a "
                    "multiple of gcd(a M, M)"
                )
        return lines

    def refuse_beside(self, other: str) -> None:
        """Refuse both beside what takes all views, and planes."""
        for name, text in (("aperture", self.aperture), ("tilt", self.tilt)):
            if text:
                options.refuse_both(name, other)


@dataclass(frozen=True)
class Operator:
    """The operator as the thesis and the VHDL have it, instead of the best picture."""

    interpolation: options.InterpolationIfGiven = None
    sharpen: options.SharpenIfGiven = None
    upsample: options.Upsample = True

    @property
    def is_set(self) -> bool:
        """Whether one of its options was given."""
        return self.interpolation is not None or self.sharpen is not None or not self.upsample


@dataclass(frozen=True)
class LookOptions:
    """Exposure and gamma of pictures to look at."""

    exposure: options.Exposure = "auto"
    gamma: options.Gamma = None


@dataclass(frozen=True)
class LookIfGiven:
    """Options of the look, for commands that also write values as they are."""

    exposure: options.ExposureIfGiven = None
    gamma: options.Gamma = None


@dataclass(frozen=True)
class Output:
    """Where numbers go besides the terminal."""

    as_json: options.AsJson = False
    csv_file: options.CsvFile = None
    plot: options.PlotFile = None
