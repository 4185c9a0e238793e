"""Reading of text files and numbers, with errors that name the place."""

import math
from pathlib import Path

from plenofir.errors import InputError


def read_text(path: Path) -> str:
    """Read a text file.

    Parameters
    ----------
    path
        File in UTF-8, with or without a byte order mark.

    Returns
    -------
    str
        Its text.

    Raises
    ------
    InputError
        If the file is missing, unreadable or not text.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(
            error.strerror or "cannot be read", where=str(path), expected="a readable CSV file"
        ) from None
    except UnicodeDecodeError:
        raise InputError(
            "not a text file", where=str(path), expected="a CSV file in UTF-8"
        ) from None


def parse_number(
    text: str, *, where: str, least: float = -math.inf, exclusive: bool = False
) -> float:
    """Read a finite number.

    Parameters
    ----------
    text
        The field.
    where
        File, row and field for the error message.
    least
        Smallest value allowed.
    exclusive
        Whether the value must be above `least`, not only at least that.

    Returns
    -------
    float
        The number.

    Raises
    ------
    InputError
        If the text is no finite number, or too small.
    """
    if math.isinf(least):
        expected = "a number"
    else:
        expected = f"a number {'above' if exclusive else 'of at least'} {least:g}"
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{text!r} is no number", where=where, expected=expected) from None
    if not math.isfinite(value) or value < least or (exclusive and value == least):
        raise InputError(f"{text!r} is not allowed", where=where, expected=expected)
    return value
