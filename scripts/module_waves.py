# SPDX-License-Identifier: Apache-2.0
"""Timing diagrams of the row module, drawn from its simulation (``tb/fir/module_bench.vhd``).

They show what Figs. 6.3, 6.5, 6.7 (the filter for a' = 0, 1, 2) and 6.11 (its simulation) of the
thesis show. Each value in them is read from the waveform.
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np
import wavedrom

from plenofir.fpga import hdl
from plenofir.fpga.tools.dumps import Dump, Value
from plenofir.fpga.tools.simulators import Waves, find_simulator
from plenofir.ground import project
from plenofir.refocus.operator import gather_sums
from plenofir.refocus.switches import FilterLayout

TOP = "module_bench"
_LANE = "stage.each_module[0].lane[0]"
MICRO_IMAGE_SIZE = 3
SHIFTS = (0, 1, 2)
CLOCK_PERIOD_NS = 60
# Multiples of M, so that the stored products are no rounded values.
PIXELS = (30, 96, 150, 63, 201, 117, 240, 12, 84, 171, 45, 222)
# The output that arrows lead to is the first of a micro image: if outputs are held, only that one
# comes directly from the taps.
MARKED_OUTPUT = 6

# WaveDrom's colours: by phase of the pixel (the micro image's centre is yellow), of interim
# results and of results.
_PHASE_COLOURS = "537"
_INTERIM = "4"
_RESULT = "9"
_PLAIN = "2"
_UNDEFINED = "x"
_AS_BEFORE = "."

WaveJson = dict[str, Any]


@dataclass(frozen=True)
class RowRun:
    """A row passing through the module."""

    layout: FilterLayout
    starts_ns: list[int]  # rising edge at which each cycle begins, in ns
    # By canonical name without the bench: the values just before the edge that ends each cycle;
    # None if there is no value yet.
    signals: dict[str, list[Value | None]]

    @property
    def outputs(self) -> list[Value | None]:
        """The output pixels that are marked valid."""
        pixels, valid = self.signals["out_pixel"], self.signals["valid"]
        return [value for value, is_valid in zip(pixels, valid, strict=True) if is_valid == 1]

    @property
    def taps(self) -> list[list[Value | None]]:
        """Partial sum of each tap, in each cycle."""
        held = f"{_LANE}.fir.registers.held"
        return [self.signals[f"{held}[{tap}]"] for tap in range(self.layout.taps)]


class RowBench:
    """The bench of the row module, built for GHDL: its GHW files hold arrays."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._simulator = find_simulator("ghdl", brief=True)
        bench = project.root() / "tb" / "fir" / f"{TOP}.vhd"
        for command in self._simulator.build_commands([*hdl.hdl_sources(), bench], TOP):
            self._simulator.run(command, directory)

    def run(
        self,
        pixels: Sequence[int] = PIXELS,
        micro_image_size: int = MICRO_IMAGE_SIZE,
        shift: int = 1,
        *,
        hold: bool = False,
    ) -> RowRun:
        """Send a row of 8-bit pixels through the module: all signals in all cycles."""
        np.array(pixels, dtype="<i4").tofile(self._directory / "input.bin")
        waves = self._directory / "row.ghw"
        generics: dict[str, int | bool | str] = {
            "MICRO_IMAGE_SIZE": micro_image_size,
            "SHIFTS": str(shift),
            "HOLD": hold,
            "PIXELS": len(pixels),
            "CLOCK_PERIOD_NS": CLOCK_PERIOD_NS,
        }
        command = self._simulator.run_command(TOP, generics, waves=Waves(waves))
        self._simulator.run(command, self._directory)
        dump = Dump(waves)
        named = {signal.canonical.removeprefix(f"{TOP}."): signal for signal in dump.signals}
        changes = {name: dump.changes(signal) for name, signal in named.items()}
        clock = changes["clk"]
        edges = clock.times[[value == 1 for value in clock.values]]
        signals = {
            name: [track.values[i] if i >= 0 else None for i in track.before(edges[1:])]
            for name, track in changes.items()
        }
        per_ns = round(1 / dump.tick / 10**9)
        layout = FilterLayout(micro_image_size, (shift,), "causal", hold)
        return RowRun(layout, [int(t) // per_ns for t in edges[:-1]], signals)


Cells = Mapping[int, tuple[str, str]]
"""Colour and text of a lane, for some of its cycles."""


def _cells(name: str, cycles: Sequence[int], cells: Cells, **more: str) -> WaveJson:
    """A lane of values; in cycles without a cell it is hatched."""
    drawn = [cells.get(cycle, (_UNDEFINED, "")) for cycle in cycles]
    wave = "".join(colour for colour, _ in drawn)
    texts = [text for colour, text in drawn if colour not in (_UNDEFINED, _AS_BEFORE)]
    return {"name": name, "wave": wave, "data": texts, **more}


def _merged(name: str, texts: Sequence[str]) -> WaveJson:
    """A lane of values, each drawn once for as long as it holds."""
    cycles = range(len(texts))
    cells = {
        i: (_UNDEFINED if text == _UNDEFINED else _PLAIN, text) for i, text in enumerate(texts)
    }
    cells |= {i: (_AS_BEFORE, "") for i in cycles[1:] if texts[i] == texts[i - 1]}
    return _cells(name, cycles, cells)


def _level(name: str, bits: Sequence[str]) -> WaveJson:
    again = [i > 0 and bit == bits[i - 1] for i, bit in enumerate(bits)]
    wave = "".join(_AS_BEFORE if a else bit for a, bit in zip(again, bits, strict=True))
    return {"name": name, "wave": wave}


def _numbers(values: Iterable[Value | None]) -> list[str]:
    """Numbers as text, x where they are undefined."""
    return [str(value) if isinstance(value, int) else _UNDEFINED for value in values]


def _in_bits(values: Iterable[Value | None], width: int) -> list[str]:
    """The bits of words as text, x for each where they are undefined."""
    return [f"{v:0{width}b}" if isinstance(v, int) else _UNDEFINED * width for v in values]


class _Arrows:
    """Arrows from the right of one cell to the left of another."""

    def __init__(self) -> None:
        self.edges: list[str] = []
        self._letters = iter(ascii_uppercase)
        # WaveDrom needs a letter at each end: at the left and at the right of a cell.
        self._marks: dict[tuple[str, int], list[str]] = {}

    def add(self, start: tuple[str, int], end: tuple[str, int]) -> None:
        """Draw one; its ends are lane and cycle."""
        self.edges.append(f"{self._mark(start, 1)}->{self._mark(end, 0)}")

    def _mark(self, cell: tuple[str, int], side: int) -> str:
        letters = self._marks.setdefault(cell, [".", "."])
        if letters[side] == ".":
            letters[side] = next(self._letters)
        return letters[side]

    def nodes(self, lane: str, cycles: Sequence[int]) -> str:
        """The marks in a lane; angle brackets enclose quarters of a cell."""
        cells = (self._marks.get((lane, cycle)) for cycle in cycles)
        return "".join("." if cell is None else "<{}..{}>".format(*cell) for cell in cells)


def module_diagram(run: RowRun) -> WaveJson:
    """Timing diagram (WaveJSON) in the terms of the thesis.

    The row has more than `MARKED_OUTPUT` pixels. The diagram begins with the cycle before the
    first pixel; arrows follow one output through the filter.
    """
    signals, m, taps = run.signals, run.layout.micro_image_size, run.taps
    cycles = range(signals["strobe"].index(1) - 1, len(run.starts_ns))
    # The zeros that flush the last sums are not part of the row.
    inputs = [i for i in cycles if signals["is_pixel"][i] == 1]
    steps = [i for i in cycles if signals["stage.strobe_d2"][i] == 1][: len(inputs)]
    valid = [i for i in cycles if signals["valid"][i] == 1]
    switches = _in_bits((signals["stage.control.closed"][i] for i in cycles), len(taps))
    products = f"E_fs[x_k] / {m}"
    we = _numbers(signals["stage.update"][i] for i in cycles)

    arrows = _Arrows()
    # The last tap's sum is the output one cycle later; each cycle earlier it was one tap before.
    path = [(f"w = {tap}", valid[MARKED_OUTPUT] - len(taps) + tap) for tap in range(len(taps))]
    adding = _pixels_of_output(MARKED_OUTPUT, len(inputs), m, run.layout.shifts[0])
    entries = {steps[pixel] + 1: (products, steps[pixel]) for pixel in adding}
    begun = [cell for cell in path if cell[1] >= min(entries)]
    for cell in begun:
        if cell[1] in entries:
            arrows.add(entries[cell[1]], cell)
    for before, after in pairwise(begun):
        arrows.add(before, after)
    arrows.add(begun[-1], ("E'[x_k]", valid[MARKED_OUTPUT]))

    def lane(name: str, cells: Cells) -> WaveJson:
        return _cells(name, cycles, cells, node=arrows.nodes(name, cycles))

    def by_phase(name: str, signal: str, among: Sequence[int]) -> WaveJson:
        places = enumerate(among)
        return lane(name, {i: (_PHASE_COLOURS[n % m], str(signals[signal][i])) for n, i in places})

    lanes: list[Any] = [
        {"name": "PCLK", "wave": "p" + "." * (len(cycles) - 1)},
        by_phase("E_fs[x_k]", "pixel", inputs),
        by_phase(products, f"{_LANE}.product_d2", steps),
        by_phase("p", "stage.control.phase", steps),
        [
            "switches",
            *(_level(f"S(p, {w})", [row[w] for row in switches]) for w in range(len(taps))),
        ],
        [
            "partial sums",
            *(
                lane(f"w = {w}", {i: (_INTERIM, str(v[i])) for i in cycles if i > steps[0]})
                for w, v in enumerate(taps)
            ),
        ],
        *([_level("we", we)] if run.layout.hold else []),
        _level("valid", _numbers(signals["valid"][i] for i in cycles)),
        lane("E'[x_k]", {i: (_RESULT, str(signals["out_pixel"][i])) for i in valid}),
    ]
    return {"signal": lanes, "edge": arrows.edges}


def _pixels_of_output(output: int, pixels: int, micro_image_size: int, shift: int) -> list[int]:
    """Pixels that an output is the sum of."""
    # Row k of the response to unit impulses shows the outputs that pixel k is added to.
    impulses = np.eye(pixels, dtype=np.int64)
    sums = gather_sums(impulses, micro_image_size, shift, axis=1)
    return [int(pixel) for pixel in np.flatnonzero(sums[:, output])]


def simulation_diagram(run: RowRun) -> WaveJson:
    """Timing diagram (WaveJSON) with the simulation's names and times, from the first edge on."""
    signals = run.signals

    def bit(label: str, name: str) -> WaveJson:
        return _level(label, _numbers(signals[name]))

    def word(label: str, name: str) -> WaveJson:
        return _merged(label, _numbers(signals[name]))

    closed = _in_bits(signals["stage.control.closed"], len(run.taps))
    closed = [_UNDEFINED if _UNDEFINED in row else row for row in closed]
    lanes: list[Any] = [
        _merged("t / ns", [str(t) for t in run.starts_ns]),
        {"name": "clk", "wave": "p" + "." * (len(run.starts_ns) - 1)},
        bit("reset", "reset"),
        bit("strobe", "strobe"),
        bit("first", "first"),
        word("pixel", "pixel"),
        [
            "stage",
            word("product_d1", f"{_LANE}.product_d1"),
            word("product_d2", f"{_LANE}.product_d2"),
            word("phase", "stage.control.phase"),
            _merged("closed", closed),
            bit("restart", "stage.restart"),
            *(_merged(f"held({t})", _numbers(values)) for t, values in enumerate(run.taps)),
        ],
        bit("valid", "valid"),
        word("out_pixel", "out_pixel"),
    ]
    return {"signal": lanes}


def draw(diagram: WaveJson) -> str:
    """Draw a timing diagram (WaveJSON) as SVG on a white ground."""
    drawing = wavedrom.render(json.dumps(diagram))
    # Keep only those of the many defined shapes that are used.
    used = set(re.findall(r'xlink:href="#([^"]+)"', drawing.tostring()))
    drawing.defs.elements = [
        entry for entry in drawing.defs.elements if entry.elementname != "g" or entry["id"] in used
    ]
    # White background: the drawing has none, and black lines would vanish on a dark page.
    drawing.elements.insert(0, drawing.rect(size=("100%", "100%"), fill="white"))
    return str(drawing.tostring())


def timing_diagrams(bench: RowBench) -> dict[str, str]:
    """All timing diagrams that the documentation shows: name of the file to SVG."""
    # As in the thesis, outputs are held for a' = 0, which needs the fewest taps.
    runs = {shift: bench.run(shift=shift, hold=shift == 0) for shift in SHIFTS}
    drawn = {f"module_a{shift}.svg": draw(module_diagram(run)) for shift, run in runs.items()}
    return {**drawn, "simulation_a1.svg": draw(simulation_diagram(runs[1]))}
