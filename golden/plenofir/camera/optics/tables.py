# SPDX-License-Identifier: Apache-2.0
"""Reading of text files and numbers, with errors that name the place."""

import math
from pathlib import Path

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file


def read_text(path: Path) -> str:
    """Read a text file."""
    try:
        return input_file(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(error.strerror or "cannot be read", where=str(path)) from None
    except UnicodeDecodeError:
        raise InputError("is not a text file in UTF-8", where=str(path)) from None


def parse_number(
    text: str, *, where: str, least: float = -math.inf, exclusive: bool = False
) -> float:
    """Read a finite number."""
    if math.isinf(least):
        wanted = "a number"
    else:
        wanted = f"a number {'above' if exclusive else 'of at least'} {least:g}"
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{text!r} is not a number; use {wanted}", where=where) from None
    if not math.isfinite(value) or value < least or (exclusive and value == least):
        raise InputError(f"{text!r} is not allowed; use {wanted}", where=where)
    return value
