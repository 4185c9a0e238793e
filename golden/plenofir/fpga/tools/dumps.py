# SPDX-License-Identifier: Apache-2.0
"""Reading waveform files: VCD, FST and GHW of any simulator, by way of pywellen.

Simulators write the same signal in different ways. This module normalises names (letter case,
ranges after them, the brackets of generate indices), time units, several values at one instant
(delta cycles, of which the last counts), booleans and enumerations.
"""

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError

TIME_UNITS = {"fs": -15, "ps": -12, "ns": -9, "us": -6, "ms": -3, "s": 0}
"""Exponents of ten of the time units, in seconds."""

_RANGE = re.compile(r"\s*\[\s*-?\d+\s*(?::|to|downto)\s*-?\d+\s*\]$")
_BOOLEANS = {"false": 0, "true": 1}

Times = npt.NDArray[np.int64]
Value = int | float | str
"""Bits that are all 0 or 1 as an integer, others as text such as ``"00uu"``; reals; text."""


def canonical_name(name: str) -> str:
    """Bring the name of a signal or scope into the form that names are compared in.

    Lower case, indices in square brackets, no range at the end: ``core.data`` for
    ``Core.Data[7:0]``, ``core.channel[0].data`` for ``core.channel(0).data(7 downto 0)``.
    """
    plain = name.strip().lower().replace("(", "[").replace(")", "]").replace(".[", "[")
    return _RANGE.sub("", plain)


@dataclass(frozen=True)
class DumpSignal:
    """A signal in a waveform file."""

    name: str  # hierarchical, as the file has it
    canonical: str  # see `canonical_name`
    is_bits: bool  # if not, its values are reals or text
    width: int  # number of bits, 0 if the values are no bits
    variable: Any = field(repr=False, compare=False)


@dataclass(frozen=True)
class Changes:
    """The values of a signal, one for each instant at which it changed."""

    times: Times  # of the changes in ticks of the file, strictly ascending
    values: list[Value]  # from each instant on

    def before(self, instants: Times) -> npt.NDArray[np.intp]:
        """Index into `values` of the value just before each instant; -1: none yet."""
        return np.searchsorted(self.times, instants, side="left") - 1

    def at(self, instants: Times) -> npt.NDArray[np.intp]:
        """Index into `values` of the value at each instant, after all changes of the instant.

        Parameters and result as `before`.
        """
        return np.searchsorted(self.times, instants, side="right") - 1


@contextmanager
def _silenced() -> Iterator[None]:
    """Keep messages that the reader, native code, prints itself off the terminal."""
    streams = (1, 2)
    saved = [os.dup(stream) for stream in streams]
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in streams:
            os.dup2(null, stream)
        yield
    finally:
        os.close(null)
        for stream, copy in zip(streams, saved, strict=True):
            os.dup2(copy, stream)
            os.close(copy)


class Dump:
    """An open waveform file, VCD, FST or GHW: its content tells which.

    `tick` is its time step in seconds; of its `signals` the outer ones come first.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise InputError("no such file; give a VCD, FST or GHW file", where=str(path))
        import pywellen

        with self._reading():
            waveform = pywellen.Waveform(str(path))
            timescale = waveform.timescale
            exponent = None if timescale is None else timescale.unit.to_exponent()
            variables = list(waveform.all_vars())
        if exponent is None:
            raise InputError("has no time unit; the file needs a $timescale", where=str(path))
        self.tick = timescale.factor * Fraction(10) ** exponent
        self.signals: Sequence[DumpSignal] = [_described(variable) for variable in variables]

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Turn the reader's failures, panics included, into errors of the input."""
        try:
            with _silenced():
                yield
        except (KeyboardInterrupt, SystemExit, GeneratorExit):
            raise
        # A panic of the reader is no Exception.
        except BaseException as error:
            reason = " ".join(str(error).split())
            raise InputError(
                f"cannot be read ({reason}); give a VCD, FST or GHW file", where=str(self.path)
            ) from None

    def changes(self, signal: DumpSignal) -> Changes:
        """All values of a signal; InputError if the file turns out to be broken."""
        with self._reading():
            stored = signal.variable.signal
            # The reader takes no empty slices.
            pairs = stored[0 : len(stored)] if len(stored) else []
        names = signal.variable.enum_type
        literals = {} if names is None else {int(bits, 2): text for bits, text in names[1]}
        # The last of several values at one instant holds: a dictionary keeps that one.
        by_time: dict[int, Value] = dict(pairs)
        values = [_plain(value, literals) for value in by_time.values()]
        return Changes(np.array(list(by_time), dtype=np.int64), values)


def _described(variable: Any) -> DumpSignal:
    boolean = variable.var_type == "Boolean" or (variable.enum_type or ("",))[0] == "boolean"
    is_bits = boolean or (variable.is_bit_vector and variable.enum_type is None)
    width = 1 if boolean else variable.bitwidth
    name = variable.full_name
    return DumpSignal(name, canonical_name(name), is_bits, width if is_bits else 0, variable)


def _plain(value: Value, literals: dict[int, str]) -> Value:
    if literals and isinstance(value, int):
        value = literals.get(value, str(value))
    if isinstance(value, str):
        value = value.lower()
        return _BOOLEANS.get(value, value)
    return value


def time_text(seconds: Fraction) -> str:
    """Write a time with the largest unit that it is a whole number of, or 1 or more: 1.565 us."""
    unit = next((u for u in reversed(TIME_UNITS) if seconds >= Fraction(10) ** TIME_UNITS[u]), "fs")
    number = seconds / Fraction(10) ** TIME_UNITS[unit]
    # Enough digits for zeptoseconds below any unit; trailing zeros go.
    digits = f"{int(number)}.{int(number % 1 * 10**18):018d}".rstrip("0").rstrip(".")
    return f"{digits} {unit}"
