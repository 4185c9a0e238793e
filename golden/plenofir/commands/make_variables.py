# SPDX-License-Identifier: Apache-2.0
"""``plenofir --make``: make's variables, as the environment hands them over, become options."""

import re
from collections.abc import Mapping
from typing import Any

from plenofir.commands.option_names import VARIABLES
from plenofir.ground.errors import InputError

# Variables of make itself or of other targets; harmless everywhere.
_IGNORED = {"JOBS", "SHELL", "MAKE"}
_EXCLUSIVE = ("A", "SWEEP", "STACK", "SCENE")


def _on_command_line(flags: str) -> set[str]:
    """Variables that MAKEFLAGS says were set on make's command line."""
    _, _, overrides = flags.partition("-- ")
    return set(re.findall(r"(?<![^\s])(?<!\\\s)(\w+)\s*:*=", overrides))


def arguments_of_make(
    target: str, parameters: Mapping[str, Any], environment: Mapping[str, str]
) -> tuple[list[str], dict[str, str]]:
    """Arguments of a command, and the variable that each option came from.

    `parameters` are the command's own. A variable of make's command line that the command does not
    take is refused; one that merely is in the environment is left alone.
    """
    variables = {name: of for name, of in VARIABLES.items() if of in parameters}
    if "radius" not in parameters:  # The command has no engine stack.
        variables.pop("STACK", None)
    for name in sorted(
        _on_command_line(environment.get("MAKEFLAGS", "")) - _IGNORED - set(variables)
    ):
        if environment.get(name, "").strip():
            names = ", ".join(variables)
            raise InputError(f"make {target} has no variable {name}; it takes {names}")
    values = {name: environment.get(name, "").strip() for name in variables}
    nonempty = {name: value for name, value in values.items() if value}
    together = [name for name in _EXCLUSIVE if name in nonempty]
    if len(together) > 1:
        raise InputError(f"{together[1]} cannot be combined with {together[0]}; use one of them")
    if "STACK" in nonempty and "ENGINE" in nonempty:
        raise InputError("ENGINE cannot be combined with STACK; use one of them")
    arguments = ["--engine=stack"] if "STACK" in nonempty else []
    for name, value in nonempty.items():
        parameter = parameters[variables[name]]
        flag = parameter.opts[0]
        if parameter.param_type_name == "argument":
            arguments.append(value)
        elif not parameter.is_flag:
            arguments.append(f"{flag}={value}")
        elif value not in ("0", "1"):
            raise InputError(f"{value!r} must be 0 or 1", where=name)
        elif value == "1":
            arguments.append(flag)
    return arguments, {variables[name]: name for name in nonempty}
