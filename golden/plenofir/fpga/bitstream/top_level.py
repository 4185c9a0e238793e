# SPDX-License-Identifier: Apache-2.0
"""The board's top level: its sources, its generics, and whether the device has room for it."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

from pydantic import ValidationError

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import SLICE_ENGINES, CoreConfiguration
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.names import SliceEngineName
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic

TOP = "atlys_top"
PART = "xc6slx45-csg324-3"
"""The Atlys' device, as ISE's tools name it."""

Value = int | bool | str

# Generics of a top level that also apply to a focal stack.
_STACK_GENERICS = ("MICRO_IMAGE_SIZE", "SHIFTS", "MAX_COLUMNS", "BOX")


def top_source(top: str = TOP) -> Path:
    return project.root() / "hdl" / "board" / f"{top}.vhd"


def project_lines(sources: Sequence[Path] | None = None) -> list[str]:
    """Lines of ISE's project file in the order of analysis; None: the board's own sources."""
    return [f'vhdl work "{path}"' for path in sources or hdl.board_sources()]


def default_generics(top: str = TOP) -> dict[str, Value]:
    """Generics of a top level that decide what is built, with their defaults."""
    values: dict[str, Value] = {}
    for generic in declarations(top_source(top).read_text(), "generic"):
        if generic.type_name == "boolean":
            values[generic.name] = generic.default == "true"
        elif generic.type_name == "string":
            values[generic.name] = generic.default.strip('"')
        else:
            values[generic.name] = int(generic.default)
    return values


def top_with_generics(values: Mapping[str, Value], top: str = TOP) -> str:
    """Source of a top level with other defaults of its generics.

    XST's own way to set generics (``-generics {A=1 B=2}``) separates them by blanks, and a set of
    slices has blanks in it; so it is the defaults that are changed. Lines stay where they are, for
    the sake of messages.
    """
    text = top_source(top).read_text()
    defaults = default_generics(top)
    for name, value in values.items():
        if name not in defaults:
            raise InputError(f"{top} has no generic {name}; it has {', '.join(defaults)}")
        if type(value) is not type(defaults[name]):
            kind = type(defaults[name]).__name__
            raise InputError(f"{value!r} is not of type {kind}", where=name)
        if isinstance(value, str):
            if not re.fullmatch(r"[-0-9 ]*|[a-z_]+", value):
                raise InputError(f"{value!r} must be numbers and blanks, or a name", where=name)
            literal = f'"{value}"'
        else:
            literal = str(value).lower()
        text, replaced = re.subn(
            rf"^(    {name}\s*: \w+(?: range \d+ to \d+)?\s*:= )(\"[^\"]*\"|[^;\n]+)",
            rf"\g<1>{literal}",
            text,
            flags=re.M,
        )
        assert replaced == 1, name
    return text


def configuration(values: Mapping[str, Value]) -> CoreConfiguration:
    """Configuration of the refocuser that a complete set of generics means.

    It has three channels of 8 bits, a channel of PIXEL_BITS, or, with several pixels a clock, of
    10.
    """
    try:
        return _configuration(values)
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(
            first["msg"], where=".".join(map(str, first["loc"])) or "generics"
        ) from None


def board_generics(core: CoreConfiguration, top: str = TOP) -> dict[str, Value]:
    """Generics of a top level that mean a configuration of the refocuser.

    Refused is what no board's refocuser has: it takes three channels of 8 bits, one row at once,
    and centred outputs.
    """
    defaults = default_generics(top)
    if isinstance(core.engine, StackEngine):
        stack = core.generics()
        # The rest has no meaning then, see picture_core.
        is_rgb8 = core.channels == 3 and core.pixel_bits == 8 and core.align == "centred"
        if is_rgb8 and "PIXEL_BITS" not in defaults:
            return {name: stack[name] for name in _STACK_GENERICS if name in stack}
        raise _no_such_refocuser(top)
    values = {name: value for name, value in core.generics().items() if name in defaults}
    if configuration({**defaults, **values}) != core:
        raise _no_such_refocuser(top)
    return values


def camera_generics(core: CoreConfiguration, top: str) -> dict[str, Value]:
    """Generics of a top level with a camera that mean a configuration of the refocuser.

    Channels and bits stand in ``camera_pkg``. Refused is what `camera_refocuser` has not: several
    rows at once, sharpening, normalised borders, other than centred outputs.
    """
    defaults, values = default_generics(top), core.generics()
    plain = core.model_copy(update={"align": "centred", "sharpening": (), "border": "zero"})
    if plain != core or core.parallel_rows != 1 or values.get("ANY_ROWS", False):
        raise _no_such_refocuser(top)
    pixels = {"PIXELS_PER_CLOCK": 1} if "PIXELS_PER_CLOCK" in defaults else {}
    return {**pixels, **{name: value for name, value in values.items() if name in defaults}}


def _no_such_refocuser(top: str) -> InputError:
    return InputError(
        "has no such refocuser; it takes three channels of 8 bits (a camera any), one row at once, "
        "centred outputs, no sharpening, and borders of zero",
        where=top,
    )


def _configuration(values: Mapping[str, Value]) -> CoreConfiguration:
    arithmetic: Arithmetic = ExactArithmetic()
    if not values["EXACT"]:
        arithmetic = StoredProductArithmetic.model_validate(
            {"fraction_bits": values["FRACTION_BITS"], "guard_bits": values["GUARD_BITS"]}
        )
    kind = SLICE_ENGINES[cast(SliceEngineName, values["ENGINE"])]
    fields = {
        field: values[field.upper()] for field in kind.model_fields if field.upper() in values
    }
    shifts, boxes = (
        tuple(int(word) for word in str(values[name]).split()) for name in ("SHIFTS", "BOX")
    )
    return CoreConfiguration.model_validate(
        {
            "micro_image_size": values["MICRO_IMAGE_SIZE"],
            "shifts": shifts,
            # One number stands for all slices.
            "boxes": boxes * len(shifts) if len(boxes) == 1 else boxes,
            "max_columns": values["MAX_COLUMNS"],
            # Pixels of a camera are grey, with the camera's number of bits.
            "channels": 1 if {"PIXEL_BITS", "PIXELS_PER_CLOCK"} & set(values) else 3,
            "pixel_bits": values.get("PIXEL_BITS", 10 if "PIXELS_PER_CLOCK" in values else 8),
            "arithmetic": arithmetic,
            "order": values["INTERPOLATION_ORDER"],
            "engine": kind.model_validate(fields),
        }
    )


def block_rams(core: CoreConfiguration) -> int:
    """Least number of block RAMs (RAMB16BWER) for line buffers and input FIFO.

    A block of 18 Kbit has words of 36 bits (512 of them), 18, 9, 4, 2 or 1 (DS160).
    """

    def blocks(depth: int, width: int) -> int:
        depth = max(512, 1 << (depth - 1).bit_length())
        across = 18432 // depth if depth <= 2048 else max(1, 16384 // depth)
        return math.ceil(width / across) * math.ceil(depth / 16384)

    words = 1 << (core.max_columns - 1).bit_length()
    sums = core.line_buffer_bits // (core.channels * words) if core.line_buffer_bits else 0
    pixel = core.channels * core.pixel_bits + 2
    return core.channels * blocks(words, sums) + blocks(core.max_columns + 2, pixel)


def check_fit(core: CoreConfiguration) -> None:
    """Refuse what the device has no block RAM for."""
    core.check_limits()
    needed, there = block_rams(core), DEVICES["xc6slx45"].total.block_rams
    if needed > there:
        raise InputError(
            f"{core.taps - 1} lines of partial sums of {core.max_columns} columns need "
            f"{needed} of {there} block RAMs; use a smaller M or |a|, fewer columns, or "
            "ARITH=stored"
        )
