# SPDX-License-Identifier: Apache-2.0
"""Comparing two waveform files cycle by cycle.

**Which signals.** Signals are matched by `plenofir.fpga.tools.dumps.canonical_name`, without the
outer levels of the hierarchy that all signals of a file share, as far as that matches more.

**When.** Just before each rising edge of a clock: the values that the edge takes over. Cycle n is
the n-th rising edge of each file, from 0, so neither time units nor clock periods matter. Without
a clock: after each instant at which any of the signals changes in either file.

**Which values.** Simulators differ in what they write for a bit that is neither 0 nor 1, and in
when they write it. So L and H count as 0 and 1, and everything else (U, X, Z, W, -) as one
undefined value. A bit is compared from the moment on at which it has had a defined value in both
files. From then on defined against undefined is a difference, and so is a bit that gets a defined
value in one of the files only. Strict comparison wants the same characters from the start.
"""

import difflib
import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import ceil, floor, gcd
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plenofir.fpga.tools.dumps import (
    TIME_UNITS,
    Changes,
    Dump,
    DumpSignal,
    Times,
    Value,
    canonical_name,
    time_text,
)
from plenofir.ground.errors import InputError

CLOCK_NAME = "clk"
"""Name of the clock where none is given."""
NO_CLOCK = "none"

Bound = int | Fraction
"""One end of what is compared: a cycle, or a time in seconds."""
Pair = tuple[DumpSignal, DumpSignal]
_Symbols = npt.NDArray[np.signedinteger]

_UNDEFINED = -1
_LEVELS = np.full(256, _UNDEFINED, np.int8)
_LEVELS[list(b"0l")], _LEVELS[list(b"1h")] = 0, 1


@dataclass(frozen=True)
class Difference:
    """Where a signal first differs."""

    signal: str  # its canonical name, without the outer levels
    cycle: int | None  # of the clock; None without a clock
    time_a: Fraction  # when, in seconds of each file
    time_b: Fraction
    value_a: str  # the differing values
    value_b: str

    def __str__(self) -> str:
        """One line for a person."""
        at = time_text(self.time_a)
        if self.time_a != self.time_b:
            at += f" in A, {time_text(self.time_b)} in B"
        cycle = "" if self.cycle is None else f"cycle {self.cycle}, "
        return f"{self.signal}, {cycle}{at}: {self.value_a} in A, {self.value_b} in B"


@dataclass(frozen=True)
class DumpComparison:
    """Result of a comparison."""

    clock: str | None
    samples: int  # cycles compared; without a clock, instants
    signals: int  # number of signals compared
    # First difference of each signal that differs, in the order of time.
    differences: tuple[Difference, ...]
    only_in_a: tuple[str, ...]  # signals that the other file lacks
    only_in_b: tuple[str, ...]
    not_comparable: tuple[str, ...]  # signals with different types or widths in the files
    never_defined: tuple[str, ...]  # signals with bits that neither file ever defines
    # Rising edges of the clock in each file up to `end`; 0 without a clock.
    cycles_a: int
    cycles_b: int

    @property
    def equal(self) -> bool:
        """Whether no signal differs and both files have all cycles."""
        return not self.differences and self.cycles_a == self.cycles_b


def parse_bound(text: str, where: str) -> Bound:
    """Read one end of the range to compare: the number of a cycle, or a time such as ``120ns``.

    Times become seconds. `where` is the option that it belongs to.
    """
    if match := re.fullmatch(r"(\d+)(?:\.(\d+))?\s*([a-z]*)", text.strip().lower(), re.ASCII):
        whole, decimals, unit = match.groups(default="")
        if unit in TIME_UNITS:
            return Fraction(f"{whole}.{decimals or 0}") * Fraction(10) ** TIME_UNITS[unit]
        if not unit and not decimals:
            return int(whole)
    raise InputError(
        f"{text!r} is neither a time such as 120ns or 1.5us nor a cycle such as 40", where=where
    )


def compare_dumps(
    a: Path,
    b: Path,
    *,
    signals: Sequence[str] = (),
    begin: Bound | None = None,
    end: Bound | None = None,
    clock: str = "",
    strict: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> DumpComparison:
    """Compare two waveform files (VCD, FST or GHW).

    `signals` are names of signals or scopes, ``*`` and ``?`` standing for any characters; outer
    levels may be left out; none: all. `begin` and `end` are the first and last cycle or time, in
    times of `a`. `clock` names the clock: empty for the outermost signal named clk, if there is
    one, ``"none"`` for no clock. `strict` compares undefined values too. `progress` is called with
    the number of compared signals and of all.

    InputError if a file cannot be read, a name or the range selects nothing, or there is no such
    clock.
    """
    dumps = (Dump(a), Dump(b))
    pairs, lone_a, lone_b = _matched(*dumps)
    if not pairs:
        raise InputError(
            "no signal of one file is in the other; compare two runs of one design",
            where=f"{a}, {b}",
        )
    lone = {str(a): lone_a, str(b): lone_b}
    clock_name = _clock_name(clock, pairs, lone)
    selected = [_pattern(text) for text in signals] or [re.compile("")]
    for text, pattern in zip(signals, selected, strict=False):
        if not any(_is_selected([pattern], n, p) for n, p in pairs.items()):
            raise _no_such_signal(text, "--signals", pairs, lone)
    chosen = {
        name: pair
        for name, pair in pairs.items()
        if name != clock_name and _is_selected(selected, name, pair)
    }
    compared = {n: (a, b) for n, (a, b) in chosen.items() if strict or _are_alike(a, b)}
    if not compared:
        problem = f"no signal besides the clock {clock_name}"
        if chosen:
            problem = f"{', '.join(chosen)}: the files have them with different types or widths"
        raise InputError(f"{problem}; choose signals that can be compared", where="--signals")

    if clock_name is None:
        samples = _all_instants(dumps, list(compared.values()), begin, end)
    else:
        samples = _cycles(dumps, clock_name, pairs[clock_name], begin, end)
    entries: list[tuple[int, Difference]] = []
    never_defined = []
    for count, (name, pair) in enumerate(compared.items()):
        if progress is not None:
            progress(count, len(compared))
        changes = [dump.changes(signal) for dump, signal in zip(dumps, pair, strict=True)]
        held = [c.before(i) for c, i in zip(changes, samples.instants, strict=True)]
        codes: dict[str, int] = {}
        tracks = [
            _symbols(c, signal, codes, strict)[index + 1]
            for c, signal, index in zip(changes, pair, held, strict=True)
        ]
        at, all_defined = _first_difference(*tracks)
        if not all_defined:
            never_defined.append(name)
        if at is not None:
            values = [
                _value_text(c.values[i[at]] if i[at] >= 0 else None, s, strict)
                for c, i, s in zip(changes, held, pair, strict=True)
            ]
            entries.append((at, Difference(name, *samples.place(at), values[0], values[1])))
    # Sorting keeps the order of the file, outer signals first, within a cycle.
    entries.sort(key=lambda entry: entry[0])
    return DumpComparison(
        clock=clock_name,
        samples=samples.count,
        signals=len(compared),
        differences=tuple(difference for _, difference in entries),
        only_in_a=_names(lone_a, selected),
        only_in_b=_names(lone_b, selected),
        not_comparable=tuple(name for name in chosen if name not in compared),
        never_defined=tuple(never_defined),
        cycles_a=samples.cycles[0],
        cycles_b=samples.cycles[1],
    )


def _are_alike(a: DumpSignal, b: DumpSignal) -> bool:
    return a.is_bits == b.is_bits and a.width == b.width


def _characters(value: Value, width: int) -> str:
    return f"{value:0{width}b}" if width and isinstance(value, int) else str(value)


def _symbols(changes: Changes, signal: DumpSignal, codes: dict[str, int], strict: bool) -> _Symbols:
    """Values of a signal, as numbers: before its first change, and from each change on.

    There is one column for each bit; or a single one for other types and for strict comparison, in
    which `codes` assigns the numbers for both files.
    """
    texts = [_characters(value, signal.width) for value in changes.values]
    if signal.is_bits and not strict:
        joined = "".join(text.rjust(signal.width, "-") for text in ["", *texts])
        levels: _Symbols = _LEVELS[np.frombuffer(joined.encode(), np.uint8)]
        return levels.reshape(-1, signal.width)
    first = 0 if strict else _UNDEFINED
    numbers = [first, *(codes.setdefault(text, len(codes) + 1) for text in texts)]
    return np.array(numbers, np.int64)[:, np.newaxis]


def _first_difference(a: _Symbols, b: _Symbols) -> tuple[int | None, bool]:
    """First sample at which two signals differ, and whether all of their bits are ever defined."""
    defined_a, defined_b = a != _UNDEFINED, b != _UNDEFINED
    seen_a, seen_b = np.logical_or.accumulate(defined_a), np.logical_or.accumulate(defined_b)
    # A bit that only one file ever defines differs from that moment on.
    lone = seen_a[-1] ^ seen_b[-1]
    counts = seen_a & seen_b | (defined_a | defined_b) & lone
    wrong = ((a != b) & counts).any(axis=1)
    at = int(np.argmax(wrong)) if wrong.any() else None
    return at, bool((seen_a[-1] | seen_b[-1]).all())


def _value_text(value: Value | None, signal: DumpSignal, strict: bool) -> str:
    """A value as a person reads it."""
    if value is None:
        return "nothing yet"
    if not signal.is_bits:
        return str(value)
    if isinstance(value, str) or strict:
        return f'"{_characters(value, signal.width).upper()}"'
    return str(value) if signal.width == 1 else f"{value} (0x{value:x})"


def _by_name(dump: Dump, levels: int) -> dict[str, DumpSignal]:
    """Signals by canonical name without its outer levels; a name that comes again is numbered."""
    signals: dict[str, DumpSignal] = {}
    times: dict[str, int] = defaultdict(int)
    for signal in dump.signals:
        name = ".".join(signal.canonical.split(".")[levels:])
        times[name] += 1
        signals[name if times[name] == 1 else f"{name} ({times[name]})"] = signal
    return signals


def _shared_levels(dump: Dump) -> int:
    """Number of outer levels that all signals share."""
    if not dump.signals:
        return 0
    paths = [signal.canonical.split(".")[:-1] for signal in dump.signals]
    lowest, highest = min(paths), max(paths)
    return next(
        (i for i, (x, y) in enumerate(zip(lowest, highest, strict=False)) if x != y),
        min(len(lowest), len(highest)),
    )


def _matched(
    a: Dump, b: Dump
) -> tuple[dict[str, Pair], dict[str, DumpSignal], dict[str, DumpSignal]]:
    """Signals in both files, and those in one only."""
    named_a, named_b = (
        [_by_name(dump, levels) for levels in range(_shared_levels(dump) + 1)] for dump in (a, b)
    )
    # Among equally good choices the first, which leaves out the fewest levels.
    depths = sorted(product(range(len(named_a)), range(len(named_b))), key=sum)
    best = max(depths, key=lambda d: len(named_a[d[0]].keys() & named_b[d[1]].keys()))
    in_a, in_b = named_a[best[0]], named_b[best[1]]
    pairs = {name: (signal, in_b[name]) for name, signal in in_a.items() if name in in_b}
    lone_a = {name: signal for name, signal in in_a.items() if name not in in_b}
    lone_b = {name: signal for name, signal in in_b.items() if name not in in_a}
    return pairs, lone_a, lone_b


def _pattern(text: str) -> re.Pattern[str]:
    """Regular expression for a name that a user gave."""
    literal = re.escape(canonical_name(text).strip("."))
    wild = literal.replace(r"\*", ".*").replace(r"\?", ".")
    return re.compile(rf"(?:.*\.)?{wild}(?:[.\[ ].*)?\Z")


def _is_selected(
    patterns: Sequence[re.Pattern[str]], name: str, pair: Sequence[DumpSignal]
) -> bool:
    names = [name, *(signal.canonical for signal in pair)]
    return any(pattern.match(n) for pattern in patterns for n in names)


def _names(lone: Mapping[str, DumpSignal], patterns: Sequence[re.Pattern[str]]) -> tuple[str, ...]:
    return tuple(name for name, signal in lone.items() if _is_selected(patterns, name, [signal]))


def _no_such_signal(
    text: str,
    where: str,
    pairs: Mapping[str, Pair],
    lone: Mapping[str, Mapping[str, DumpSignal]],
) -> InputError:
    for path, signals in lone.items():
        if _names(signals, [_pattern(text)]):
            return InputError(f"{text!r} is only in {path}", where=where)
    name = canonical_name(text)
    candidates = {n.rpartition(".")[2]: n for n in pairs} | {n: n for n in pairs}
    close = [candidates[n] for n in difflib.get_close_matches(name, candidates, n=3)]
    hint = ", ".join(dict.fromkeys(close)) or "a name in both files"
    return InputError(
        f"there is no signal {text!r} in both files" + (f"; did you mean {hint}?" if hint else ""),
        where=where,
    )


def _clock_name(
    clock: str, pairs: Mapping[str, Pair], lone: Mapping[str, Mapping[str, DumpSignal]]
) -> str | None:
    """Name of the clock: the outermost that fits."""
    if canonical_name(clock) == NO_CLOCK:
        return None
    typed = canonical_name(clock or CLOCK_NAME)
    fitting = [
        name
        for name, pair in pairs.items()
        if typed in (name, pair[0].canonical, pair[1].canonical) or name.endswith(f".{typed}")
    ]
    if not fitting:
        if clock:
            raise _no_such_signal(clock, "--clock", pairs, lone)
        return None
    depth = min(name.count(".") for name in fitting)
    outermost = [name for name in fitting if name.count(".") == depth]
    if len(outermost) > 1:
        raise InputError(
            f"{len(outermost)} signals fit {typed!r}; choose {', '.join(outermost)}, or {NO_CLOCK}",
            where="--clock",
        )
    return outermost[0]


@dataclass(frozen=True)
class _Samples:
    """Instants of comparison: the values just before each of them are compared."""

    # In ticks of each file.
    instants: tuple[Times, Times]
    # In ticks of each file, for the report.
    reported: tuple[Times, Times]
    ticks: tuple[Fraction, Fraction]
    # Number of the first cycle, None without a clock.
    first_cycle: int | None
    # Cycles that each file has.
    cycles: tuple[int, int]

    @property
    def count(self) -> int:
        return int(self.instants[0].size)

    def place(self, at: int) -> tuple[int | None, Fraction, Fraction]:
        times = [
            int(reported[at]) * tick
            for reported, tick in zip(self.reported, self.ticks, strict=True)
        ]
        return None if self.first_cycle is None else self.first_cycle + at, times[0], times[1]


def _no_instants() -> InputError:
    return InputError("nothing happens in this range; widen it", where="--from, --to")


def _cycles(
    dumps: tuple[Dump, Dump],
    name: str,
    clock: Pair,
    begin: Bound | None,
    end: Bound | None,
) -> _Samples:
    edges = []
    for dump, signal in zip(dumps, clock, strict=True):
        changes = dump.changes(signal)
        levels = _symbols(changes, signal, {}, strict=False)[1:, 0]
        edges.append(changes.times[1:][(levels[:-1] == 0) & (levels[1:] == 1)])
        if signal.width != 1 or not edges[-1].size:
            raise InputError(
                f"{name} never rises; name another clock with --clock", where=str(dump.path)
            )
    first = 0
    available = [len(edges[0]), len(edges[1])]
    if isinstance(begin, Fraction):
        first = int(np.searchsorted(edges[0], ceil(begin / dumps[0].tick), side="left"))
    elif begin is not None:
        first = begin
    if isinstance(end, Fraction):
        counts = [
            int(np.searchsorted(rising, floor(end / dump.tick), side="right"))
            for rising, dump in zip(edges, dumps, strict=True)
        ]
        # The last cycle is that of A's clock; if A ends earlier, B may have more cycles.
        last = counts[0] if counts[0] < available[0] else max(counts)
        available = [min(n, last) for n in available]
    elif end is not None:
        available = [min(n, end + 1) for n in available]
    cycles = slice(first, min(available))
    instants = (edges[0][cycles], edges[1][cycles])
    if not instants[0].size:
        raise _no_instants()
    return _Samples(
        instants, instants, (dumps[0].tick, dumps[1].tick), first, (available[0], available[1])
    )


def _all_instants(
    dumps: tuple[Dump, Dump],
    pairs: Sequence[Pair],
    begin: Bound | None,
    end: Bound | None,
) -> _Samples:
    for bound, option in ((begin, "--from"), (end, "--to")):
        if isinstance(bound, int):
            raise InputError(
                "a cycle needs a clock; give a time such as 120ns, or --clock", where=option
            )
    # The ticks of both files are whole numbers of this step.
    over = dumps[0].tick.denominator * dumps[1].tick.denominator
    step = Fraction(gcd(*(int(dump.tick * over) for dump in dumps)), over)
    scales = [int(dump.tick / step) for dump in dumps]
    times = [
        dump.changes(signal).times * scale
        for pair in pairs
        for dump, signal, scale in zip(dumps, pair, scales, strict=True)
    ]
    instants = np.unique(np.concatenate(times))
    if begin is not None:
        instants = instants[instants >= ceil(begin / step)]
    if end is not None:
        instants = instants[instants <= floor(end / step)]
    if not instants.size:
        raise _no_instants()
    at_ticks = (instants // scales[0], instants // scales[1])
    # The values after an instant hold just before the next tick.
    after = (at_ticks[0] + 1, at_ticks[1] + 1)
    return _Samples(after, at_ticks, (dumps[0].tick, dumps[1].tick), None, (0, 0))
