# SPDX-License-Identifier: Apache-2.0
"""The focus setting a and the shift a' = a * M in pixels."""

from collections.abc import Sequence
from fractions import Fraction
from numbers import Integral

from plenofir.ground.errors import InputError


def parse_focus(a: int | str | Fraction, *, where: str = "a") -> Fraction:
    """Read a focus setting.

    `a`: an integer, a `Fraction`, or text such as ``"-3/5"`` or ``"1"``. Result: the focus setting
    in units of the micro lens pitch. Raises `InputError` if `a` is not a rational number.
    """
    advice = "use an integer or a fraction, such as -3/5 or 1"
    if isinstance(a, bool) or not isinstance(a, (Integral, str, Fraction)):
        raise InputError(f"{a!r} is not a focus setting; {advice}", where=where)
    if isinstance(a, str) and any(c in a for c in ".eE_"):
        raise InputError(f"{a!r} is not a focus setting; {advice}", where=where)
    try:
        # A fraction of NumPy's integers could overflow.
        return Fraction(int(a) if isinstance(a, Integral) else a)
    except (ValueError, ZeroDivisionError):
        raise InputError(f"{a!r} is not a focus setting; {advice}", where=where) from None


def focus_to_shift(a: int | str | Fraction, micro_image_size: int, *, where: str = "a") -> int:
    """Convert a focus setting to a shift in pixels, a' = a * M (Eq. 6.1).

    `a`: focus setting, a fraction whose denominator divides M. Result: a' in pixels. Raises
    `InputError` if a * M is not an integer.
    """
    focus = parse_focus(a, where=where)
    shift = focus * int(micro_image_size)
    if shift.denominator != 1:
        raise InputError(
            f"{focus} is not on the grid of M = {micro_image_size}; use a fraction whose "
            f"denominator divides {micro_image_size}",
            where=where,
        )
    return int(shift)


def shift_to_text(shift: int, micro_image_size: int) -> str:
    """Write a shift as a focus setting with denominator M, or as an integer.

    Result: for instance ``"-3/5"`` or ``"1"``.
    """
    whole, rest = divmod(shift, micro_image_size)
    return str(whole) if rest == 0 else f"{shift}/{micro_image_size}"


def shift_to_name(shift: int, micro_image_size: int) -> str:
    """Focus setting as a part of a file name: `shift_to_text` with ``_`` for the stroke."""
    return shift_to_text(shift, micro_image_size).replace("/", "_")


def setting_names(settings: Sequence[Fraction], micro_image_size: int) -> list[str]:
    """Focus settings as parts of file names that sort in the order of a.

    Result: for each its place among them, where there are several, and a: ``"1_a-3_5"``, off the
    grid of M ``"2_a0.2062"``.
    """

    def named(a: Fraction) -> str:
        shift = a * micro_image_size
        if shift.denominator > 1:
            return f"a{float(a):.6g}"
        return f"a{shift_to_name(int(shift), micro_image_size)}"

    names = [named(a) for a in settings]
    if len(names) == 1:
        return names
    digits, order = len(str(len(settings))), sorted(settings)
    return [
        f"{order.index(a) + 1:0{digits}}_{name}" for a, name in zip(settings, names, strict=True)
    ]
