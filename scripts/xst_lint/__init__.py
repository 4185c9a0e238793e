# SPDX-License-Identifier: Apache-2.0
"""Finds VHDL that XST is known to refuse, or to interpret otherwise than simulators and GHDL.

The sources are read as text, in the one style that they are written in (``scripts/vsg.yaml``). The
rules are in ``rules``; each names the precedent that it comes from.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from xst_lint.intervals import Names
from xst_lint.rules import RULES, Design, Source, loop_limit

__all__ = ["Finding", "lint", "loop_limit"]


@dataclass(frozen=True)
class Finding:
    """A place that a rule forbids."""

    path: Path
    line: int
    rule: str
    what: str

    def __str__(self) -> str:
        """Message in the form of compilers, with the rule's precedent."""
        return f"{self.path}:{self.line}: {self.what} ({self.rule}: {RULES[self.rule].precedent})"


def lint(paths: Sequence[Path], limit: int) -> list[Finding]:
    """Hold sources, packages before those that use them, against all rules.

    `limit`: turns of a loop that XST takes (`loop_limit`).
    """
    texts = {path: re.sub(r"--[^\n]*", "", path.read_text()) for path in paths}
    shared = Names()
    for path, text in texts.items():
        if path.stem.endswith("_pkg"):
            shared.read(text)
    design = Design(shared, "\n".join(texts.values()), limit)
    return [
        Finding(path, text.count("\n", 0, at) + 1, name, message)
        for path, text in texts.items()
        for name, rule in RULES.items()
        for at, message in rule.find(Source(text, design))
    ]
