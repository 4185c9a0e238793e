# SPDX-License-Identifier: Apache-2.0
"""The one exception for input that the user can correct, and the exit codes of the commands."""

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError

EXIT_MISMATCH = 1
EXIT_BAD_INPUT = 2
EXIT_TOOL_FAILED = 3


class ToolError(RuntimeError):
    """A tool failed: a fault of the design or of the tool, not of the input."""


class InputError(ValueError):
    """Input that cannot be used: what is wrong and what to do, as a sentence.

    The command line prints it as one line and exits with code 2. `where` is the file, option or
    field that the sentence is about, and stands in front of it.
    """

    def __init__(self, problem: str, *, where: str = "") -> None:
        self.problem = problem
        self.where = where
        super().__init__(f"{where}: {problem}" if where else problem)


def validation_error(error: "ValidationError", *, where: str) -> InputError:
    """Say in one line what pydantic found first."""
    first = error.errors()[0]
    field, text = ".".join(str(part) for part in first["loc"]), first["msg"]
    if first["type"] == "missing":
        return InputError(f"{field} is missing", where=where)
    if first["type"] == "extra_forbidden":
        return InputError(f"there is no field {field}", where=where)
    text = re.sub("^(Value error, )?([A-Z][a-z]+ (?=should ))?", "", text)
    if isinstance(first["input"], dict):
        # A rule about several fields names them; their values would fill the line.
        return InputError(f"{field}: {text}" if field else text, where=where)
    colon = "" if text.startswith("should ") else ":"
    return InputError(f"{field} = {first['input']!r}{colon} {text}", where=where)
