# SPDX-License-Identifier: Apache-2.0
"""The one exception for input that the user can correct, and the exit codes of the commands."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError

EXIT_MISMATCH = 1
EXIT_BAD_INPUT = 2
EXIT_TOOL_FAILED = 3


class ToolError(RuntimeError):
    """A tool failed: a fault of the design or of the tool, not of the input."""


class InputError(ValueError):
    """Input that cannot be used: what is wrong and what to do.

    The command line prints it as one line and exits with code 2.

    `what`: what is wrong; a whole sentence if there is nothing else. `expected`: what would be
    accepted.
    """

    def __init__(self, what: str, *, where: str = "", expected: str = "") -> None:
        self.what = what
        self.where = where
        self.expected = expected
        place = f"{where}: " if where else ""
        super().__init__(place + what + (f"; expected {expected}" if expected else ""))


def validation_error(error: "ValidationError", *, where: str) -> InputError:
    """Say in one line what pydantic found first."""
    first = error.errors()[0]
    field = ".".join(str(part) for part in first["loc"])
    kind = first["type"]
    if kind == "missing":
        return InputError(field, where=where, expected="this field")
    if kind == "extra_forbidden":
        return InputError(f"{field} = {first['input']!r}", where=where, expected="no such field")
    if isinstance(first["input"], dict):
        # A rule about several fields: their values would fill the line.
        what = f"{field or 'the file'} cannot be used"
    else:
        what = f"{field} = {first['input']!r}"
    text = first["msg"]
    for prefix in ("Input should be ", "String should ", "Value error, "):
        text = text.removeprefix(prefix)
    return InputError(what, where=where, expected=text[0].lower() + text[1:])
