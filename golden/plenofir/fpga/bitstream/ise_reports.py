"""What the logs and reports of ISE say: messages, timing, utilisation."""

import re
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Message:
    """A message of the tools, as often as it came: ``Xst:653`` and its first line."""

    tool: str
    code: str
    text: str
    times: int


_MESSAGE = re.compile(r"^(WARNING|ERROR):(\w+:\d+) - (.*)$")


def messages(tool: str, log: str, severity: str) -> list[Message]:
    """Messages of a log, those with one code and text together.

    Parameters
    ----------
    tool
        Whose log it is.
    log
        Its text.
    severity
        WARNING or ERROR.

    Returns
    -------
    list of Message
        In the order of their first appearance.
    """
    found: dict[tuple[str, str], int] = {}
    lines = log.splitlines()
    for i, line in enumerate(lines):
        begin = _MESSAGE.match(line)
        if begin is None or begin[1] != severity:
            continue
        # Long messages go on in lines that are set in.
        text = begin[3].strip()
        for more in lines[i + 1 :]:
            if not re.match(r"^   ?\S", more):
                break
            text += " " + more.strip()
        found[begin[2], text] = found.get((begin[2], text), 0) + 1
    return [Message(tool, code, text, times) for (code, text), times in found.items()]


def unimportant(path: Path) -> set[str]:
    """Codes of warnings that are left out of the list.

    Parameters
    ----------
    path
        File with a code a line, and the reason behind ``#``.

    Returns
    -------
    set of str
        Codes.
    """
    lines = (line.split("#", 1)[0].strip() for line in path.read_text().splitlines())
    return {line for line in lines if line}


@dataclass(frozen=True)
class Timing:
    """What TRCE says of one constraint.

    Attributes
    ----------
    constraint
        Its text.
    paths
        Number of paths analysed.
    errors
        Number of those that are too slow or too fast.
    best
        Shortest period or delay that would be met, in ns; None if nothing was analysed.
    """

    constraint: str
    paths: int
    errors: int
    best: float | None


def read_timing(report: str) -> list[Timing]:
    """Read TRCE's report.

    Parameters
    ----------
    report
        Text of the ``.twr`` file.

    Returns
    -------
    list of Timing
        One for each constraint.
    """
    out = []
    for section in report.split("Timing constraint: ")[1:]:
        constraint = " ".join(section.split(";", 1)[0].split())
        paths = re.search(r"^\s*(\d+) paths analyzed", section, re.M)
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


_UTILISATION = re.compile(
    r"^\s*Number (?:of|used as) ([\w/ ]+?):\s+([\d,]+) out of\s+([\d,]+)", re.M
)
_SHOWN = (
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
    """Read Map's report.

    Parameters
    ----------
    report
        Text of the ``.mrp`` file.

    Returns
    -------
    dict
        Kind of site to how many are used, and how many there are.
    """
    found = {
        match[1]: (int(match[2].replace(",", "")), int(match[3].replace(",", "")))
        for match in _UTILISATION.finditer(report)
    }
    return {name: found[name] for name in _SHOWN if name in found}
