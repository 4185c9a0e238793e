# SPDX-License-Identifier: Apache-2.0
"""Parsers of ISE's logs and reports: messages, timing, utilisation."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from plenofir.ground.errors import InputError


@dataclass(frozen=True)
class Message:
    """A message of the tools and how often it came: ``Xst:653`` and its first line."""

    tool: str
    code: str
    text: str
    times: int


# XST indents the messages of a unit; a few messages have no number.
_MESSAGE = re.compile(r"^\s*(WARNING|ERROR):(\w+(?::\d+)?) - (.*)$")


def messages(tool: str, log: str, severity: str) -> list[Message]:
    """Messages of a log, those with one code and text together."""
    counts: dict[tuple[str, str], int] = {}
    lines = log.splitlines()
    for i, line in enumerate(lines):
        begin = _MESSAGE.match(line)
        if begin is None or begin[1] != severity:
            continue
        # Long messages continue in indented lines.
        text = begin[3].strip()
        for more in lines[i + 1 :]:
            if not re.match(r"^   ?\S", more):
                break
            text += " " + more.strip()
        counts[begin[2], text] = counts.get((begin[2], text), 0) + 1
    return [Message(tool, code, text, times) for (code, text), times in counts.items()]


class Treatment(StrEnum):
    """What the build does with a warning that it does not simply list."""

    FATAL = "fatal"
    UNIMPORTANT = "unimportant"


def treatments(path: Path) -> dict[str, Treatment]:
    """Read what is done with which warnings: a treatment and a code a line, then ``#`` and why."""
    out: dict[str, Treatment] = {}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if len(words) != 2 or words[0] not in list(Treatment) or words[1] in out:
            raise InputError(
                f"{line.strip()!r} is not understood; write one of {', '.join(Treatment)} "
                "and a code that is not there yet",
                where=f"{path}:{number}",
            )
        out[words[1]] = Treatment(words[0])
    return out


@dataclass(frozen=True)
class Timing:
    """TRCE's result for one constraint."""

    constraint: str
    paths: int  # analysed
    errors: int  # paths that are too slow or too fast
    # Shortest period or delay that would be met, in ns; None: nothing was analysed.
    best: float | None


def read_timing(report: str) -> list[Timing]:
    """Read TRCE's report (``.twr``): one entry for each constraint."""
    out = []
    for section in report.split("Timing constraint: ")[1:]:
        constraint = " ".join(re.split(r";|\n\s*\n|\nFor more", section, maxsplit=1)[0].split())
        paths = re.search(r"^\s*(\d+) paths? analyzed", section, re.M)
        errors = re.search(r"^\s*(\d+) timing errors? detected", section, re.M)
        best = re.search(r"(?:Minimum period is|Maximum delay is)\s+([\d.]+)ns", section)
        out.append(
            Timing(
                constraint,
                int(paths[1]) if paths else 0,
                int(errors[1]) if errors else 0,
                float(best[1]) if best else None,
            )
        )
    return out


_PERIOD = re.compile(
    r'(TS_\w+) = PERIOD TIMEGRP "[^"]+" (TS_\w+)(?: ([*/]) ([\d.]+))?(?: PHASE \S+ ns)? HIGH'
)


def derived(timing: Sequence[Timing], root: str) -> dict[str, tuple[int, float]]:
    """Find the constraints that NGDBuild derived from one, through PLLs and PLLs behind them.

    Text of each to how many PLLs it is behind, and how many times the root's frequency it has; the
    root's period is in ns.
    """
    entries = [(match, entry) for entry in timing if (match := _PERIOD.match(entry.constraint))]
    names = {root: (0, 1.0)}
    out: dict[str, tuple[int, float]] = {}
    # TRCE lists a derived constraint before or after the one that it comes from.
    for _ in entries:
        for match, entry in entries:
            name, parent, sign, factor = match.groups()
            if parent in names:
                depth, frequency = names[parent]
                ratio = float(factor or 1)
                # Periods in ns: "TS_x / 2" is half the period.
                frequency = frequency * ratio if sign == "/" else frequency / ratio
                names[name] = out[entry.constraint] = (depth + 1, frequency)
    return out


_UTILISATION = re.compile(
    r"^\s*Number (?:of|used as) ([\w/ ]+?):\s+([\d,]+) out of\s+([\d,]+)", re.M
)
_LISTED_SITES = (
    *(
        "Slice Registers",
        "Slice LUTs",
        "occupied Slices",
        "bonded IOBs",
        "RAMB16BWERs",
        "RAMB8BWERs",
    ),
    *("DSP48A1s", "BUFG/BUFGMUXs", "BUFPLLs", "PLL_ADVs"),
)


def read_utilisation(report: str) -> dict[str, tuple[int, int]]:
    """Read Map's report (``.mrp``): kind of site to how many are used, and how many there are."""
    used = {
        match[1]: (int(match[2].replace(",", "")), int(match[3].replace(",", "")))
        for match in _UTILISATION.finditer(report)
    }
    return {name: used[name] for name in _LISTED_SITES if name in used}
