# SPDX-License-Identifier: Apache-2.0
"""Times on a GPU, predicted where none is at hand: from instructions and bytes.

NVIDIA's compiler gives the code, `gpu_counts` counts what its warps execute in a block in the
middle of the picture, and every block counts like that one. A picture takes as long as its
instructions at the rate of `TRIAL`, or as its bytes at the rate of a copy, whichever is longer.
"""

import json
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from math import prod
from time import process_time
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from plenofir.refocus import first_calls, refocus_stack, sharpest_slices
from plenofir.refocus.gpu.constants import LENS_TILE, depth_source, lens_grid, source, tiles_of
from plenofir.refocus.sharpness import Search
from plenofir.refocus.slices import Slice
from plenofir_studies import DATA
from plenofir_studies.energy import STATIC_MW, energy_of, grey, load_measured, name_of
from plenofir_studies.gpu_counts import Kernel, compiled
from plenofir_studies.gpu_host import host_seconds
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import machine, table

FILE = DATA / "gpu.json"
SIZE, M = 3201, 11
CARD = "H100 of 80 GB"
TRIAL = 391e9
"""Instructions of PTX that warps of the H100 executed in a second.

A trial of this kernel (grey, 8 bit, 3201 x 3201, M = 11; measured on 2026-11-28, every pixel
compared) took 18.0, 18.7, 18.2 and 18.2 us for a' = 1, 32, -21 and 3. Its code, which is not a part
of plenofir, counts 6.94, 7.42, 7.29 and 6.97 million by `gpu_counts` with tiles of 14 rows and 416
threads: 383 to 400 10^9 a second. That was a third of the card's issue slots.
"""
COPY = 2 * SIZE**2 / 10.2e-6
"""Bytes read and written in a second by a copy in its memory, over 24 frames (measured)."""
LAUNCH = 5.4e-6
"""Seconds of the host for a launch by cuda-core 1.2.0 (measured)."""
BUS = 63e9
"""Bytes that a PCI Express bus of 16 lanes, generation 5.0, moves each way in a second at most."""
FULL_WATTS, IDLE_WATTS = 441.0, 133.0
"""Power of the card in the trial's loop and without work, by NVML over 5 s (measured)."""
MEASURED_PJ = 850.0
"""Energy of a pixel in the trial's loop (measured)."""
_SHARED_BYTES = 115_712  # of a block, if two of them share a multiprocessor of the H100
_NUMBERS = 16  # slices of a stack
_FRAME, _OUT, _MORE = 1 << 50, 1 << 51, 1 << 52  # addresses
_VOTE = 2


class Predicted(BaseModel):
    """A frame's work on a GPU, and the CPU's time for it, measured."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    work: str
    instructions: int  # of warps
    moved_bytes: int  # frames read and pictures written
    pixels: int  # refocused: those of all slices
    cpu_seconds: float  # of all threads

    @property
    def seconds(self) -> float:
        """Predicted for the GPU, without what the host takes."""
        return max(self.instructions / TRIAL, self.moved_bytes / COPY)

    @property
    def picojoules(self) -> float:
        """Predicted for each refocused pixel, at the power of full load."""
        return 1e12 * FULL_WATTS * self.seconds / self.pixels


class Recorded(BaseModel):
    """Predictions, and the machine whose CPU is beside them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    machine: str
    frames: list[Predicted]
    host_copy_seconds: float  # of a grey frame of 8 bit within its memory, by one thread
    host_seconds: dict[str, float]  # of a call, without library and driver (`gpu_host`)


def _slices(size: int, shifts: Sequence[int], channels: int, bits: int, **how: int) -> list[Slice]:
    shape = (size, size) if channels == 1 else (size, size, channels)
    both = range(size), range(size)
    return [Slice(shape, bits, M, shift, both, **how) for shift in shifts]  # type: ignore[arg-type]


class _Tiles:
    """The kernel of a stack, compiled, and its counts."""

    def __init__(self, slices: Sequence[Slice]) -> None:
        tiles = tiles_of(slices, _SHARED_BYTES)
        assert tiles is not None, "tiles of these sizes fit"
        self._slices, self._threads = slices, tiles[0].threads
        self._kernel = Kernel(compiled(source(slices, tiles)), "refocus_tiles")
        self._grid = tiles[0].blocks(len(slices), slices[0].region)
        self._blocks = self._grid[0] * self._grid[1] // len(slices)

    def of(self, number: int, sums: int = 0, sharpest: int = 0, of_lenses: int = 0) -> int:
        """Instructions for one slice; lenses take any of the first `of_lenses`."""
        rows, columns = self._slices[0].shape[:2]
        across, down = self._grid
        block = across // len(self._slices) // 2 * len(self._slices) + number, down // 2
        numbers = rows, columns, 0, rows, 0, columns, 0
        pointers = _FRAME, _OUT, 0, 0, sums, sharpest
        taken = {}
        if of_lenses:
            lenses = -(-rows // M) * -(-columns // M)
            drawn = np.random.default_rng(0).integers(0, of_lenses, lenses)
            taken = dict(enumerate(drawn.tolist(), sharpest))
        one = self._kernel.executed((*pointers, *numbers), block, self._threads, self._grid, taken)
        return one * self._blocks

    def pictures(self) -> int:
        """All slices as pictures."""
        return sum(map(self.of, range(len(self._slices))))

    def depth(self, needed: int) -> int:
        """Depth and the picture in focus, where the lenses of a tile take `needed` slices."""
        numbers = range(len(self._slices))
        sums = sum(self.of(n, sums=_MORE) for n in numbers)
        return (
            sums
            + self._lenses()
            + sum(self.of(n, sharpest=_MORE, of_lenses=needed) for n in numbers)
        )

    def _lenses(self) -> int:
        """The search for the sharpest slice, and the vote."""
        shifts = tuple(each.shift for each in self._slices)
        text = compiled(depth_source(self._slices, Search(1, 1, _VOTE, shifts)))
        rows, columns = (-(-length // M) for length in self._slices[0].shape[:2])
        grid = lens_grid(self._slices)
        block = grid[0] // 2, grid[1] // 2
        return prod(grid) * sum(
            Kernel(text, name).executed(
                (*(_MORE + (n << 40) for n in range(pointers)), rows, columns),
                block,
                prod(LENS_TILE),
                grid,
            )
            for name, pointers in (("find_sharpest", 5), ("vote", 3), ("fill", 3))
        )


_KINDS: tuple[tuple[str, int, int, int, dict[str, int]], ...] = (
    *((f"grey, 8 bit, a' = {shift}", shift, 1, 8, {}) for shift in (-21, 1, 11, 32)),
    ("RGB, 8 bit, a' = 1", 1, 3, 8, {}),
    ("grey, 16 bit, a' = 1", 1, 1, 16, {}),
    ("grey, 8 bit, a' = 1, linear", 1, 1, 8, {"order": 1}),
    ("grey, 8 bit, a' = 1, sharpened", 1, 1, 8, {"units": 12}),
)


def predict(
    size: int = SIZE,
    numbers: int = _NUMBERS,
    kinds: Sequence[tuple[str, int, int, int, dict[str, int]]] = _KINDS,
) -> list[Predicted]:
    """Predict pictures of some kinds, and a stack of `numbers` slices; takes a minute.

    Raises ImportError or RuntimeError where NVIDIA's compiler cannot run.
    """
    frames = []
    for work, shift, channels, bits, how in kinds:
        slices = _slices(size, [shift], channels, bits, **how)
        frames.append(_predicted(work, _Tiles(slices).pictures(), slices, _cpu_stack(slices)))
    first = 1 - numbers // 2
    slices = _slices(size, range(first, first + numbers), 1, 8)
    stack = _Tiles(slices)
    work = f"{numbers} slices, grey, 8 bit"
    frames.append(_predicted(work, stack.pictures(), slices, _cpu_stack(slices)))
    cpu = _cpu_depth(slices)
    for needed, words in ((numbers // 4 or 1, "a quarter"), (numbers, "each")):
        work = f"depth and in focus of {numbers} slices, where tiles need {words} of them"
        frames.append(_predicted(work, stack.depth(needed), slices, cpu, passes=2))
    return frames


def _predicted(
    work: str, instructions: int, slices: Sequence[Slice], cpu_seconds: float, passes: int = 1
) -> Predicted:
    """A prediction; of several `passes` over a frame, one picture is left."""
    one = slices[0]
    frame = one.pixel_bits // 8 * one.channels * one.shape[0] * one.shape[1]
    pictures = len(slices) if passes == 1 else 1
    return Predicted(
        work=work,
        instructions=instructions,
        moved_bytes=(passes + pictures) * frame,
        pixels=len(slices) * one.shape[0] * one.shape[1],
        cpu_seconds=cpu_seconds,
    )


def _noise(one: Slice) -> Any:
    random = np.random.default_rng(0)
    return random.integers(0, one.white, one.shape, f"uint{one.pixel_bits}", endpoint=True)


def _cpu_stack(slices: Sequence[Slice]) -> float:
    """Time of the CPU for a stack."""
    one = slices[0]
    settings = [Fraction(each.shift, M) for each in slices]
    how: dict[str, Any] = {"interpolation": one.order, "sharpen": Fraction(one.units, 64)}
    raw = _noise(one)
    out = refocus_stack(raw, M, settings, **how)
    return _least(partial(refocus_stack, raw, M, settings, out=out, **how), 4)


def _cpu_depth(slices: Sequence[Slice]) -> float:
    """Time of the CPU for depth and the picture in focus."""
    settings = [Fraction(each.shift, M) for each in slices]
    find = partial(sharpest_slices, _noise(slices[0]), M, settings)
    return _least(partial(find, vote_radius=_VOTE, between=True), 2)


def _least(work: Callable[[], object], runs: int) -> float:
    """Least processor time of some runs, by compiled code."""
    before, times = first_calls.patient, []
    first_calls.patient = True
    try:
        for _ in range(runs):
            start = process_time()
            work()
            times.append(process_time() - start)
    finally:
        first_calls.patient = before
    return min(times)


def page(recorded: Recorded) -> list[str]:
    """What is predicted, in Markdown, and beside it what is measured."""
    heads = [f"a frame of {SIZE} x {SIZE}, M = {M}", "GPU, predicted", "pJ a pixel, predicted"]
    heads += ["instructions a pixel", "CPU, measured"]
    return [
        f"Predicted for an {CARD}, on no GPU: NVIDIA's compiler gives the code, `plenofir report "
        "gpu` counts what its warps execute, and they execute as many instructions a second as a "
        f"trial's kernel did on that card ({TRIAL / 1e9:.0f} 10^9, from four settings that differ "
        "by 4 %). Bytes take as long as in a copy. Kernels that overlap better or worse than the "
        "trial's differ from it. Pixels are those of all slices; for depth, lenses take theirs of "
        "the needed slices at random.",
        "",
        *table(
            heads,
            (
                [
                    each.work,
                    f"{1e6 * each.seconds:.0f} us",
                    f"{each.picojoules:.0f}",
                    f"{32 * each.instructions / each.pixels:.1f}",
                    f"{1e3 * each.cpu_seconds:.1f} ms",
                ]
                for each in recorded.frames
            ),
        ),
        f"CPU: {recorded.machine}; processor time of all threads.",
        "",
        "Frames that come from the host's memory and go back there are bounded by the host, though "
        "upload, kernel and download overlap. Its bus (PCI Express 5.0, 16 lanes) moves "
        f"{BUS / 1e9:.0f} GB/s each way at most: {1e6 * SIZE**2 / BUS:.0f} us for a grey frame of "
        "8 bit, predicted. A thread that copies such a frame into memory that the card reads takes "
        f"{1e6 * recorded.host_copy_seconds:.0f} us on the CPU above, measured.",
        "",
        "A call for pictures like the one before takes the host, on the CPU above, measured with "
        "stand-ins for the array's library and the driver, "
        + ", ".join(f"{1e6 * t:.0f} us for {work}" for work, t in recorded.host_seconds.items())
        + f". Their own time comes on top: cuda-core's launch took {1e6 * LAUNCH:.1f} us on the "
        "machine of the trial.",
    ]


def answer(measured: Sequence[tuple[str, str, str]] = ()) -> list[str]:
    """The thesis's question after a GPU's power, in Markdown.

    `measured`: rows of what was measured besides, see the table's heads.
    """
    core = energy_of(load_measured()[name_of(grey())])
    film = 1e6 * IDLE_WATTS / (60 * SIZE**2)
    rows = [
        *measured,
        (f"{CARD}, a trial's kernel, in a loop", "measured", f"{MEASURED_PJ:.0f}"),
        (
            "the same card, one camera of 60 frames a second: its idle power alone",
            "measured",
            f"{1e6 * film:.0f}",
        ),
        (
            f"FPGA, {name_of(grey())}",
            "estimated from toggles",
            f"{core.total / core.factor:.0f} to {core.total * core.factor:.0f}",
        ),
        (
            "the static power of such an FPGA, at 100 Mpx/s",
            "data sheets",
            " to ".join(f"{10 * power:.0f}" for power in STATIC_MW),
        ),
    ]
    low, high = (MEASURED_PJ / core.total * factor for factor in (1 / core.factor, core.factor))
    return [
        "Section 6.3 names a GPU as the alternative, expects worse power efficiency of it, and "
        "leaves the benchmark to future work.",
        "",
        *table(["what refocuses", "how known", "pJ a pixel"], rows),
        f"At full load the GPU takes {low:.1f} to {high:.1f} times the energy of the FPGA's logic "
        "alone, and with the FPGA's static power at one pixel a clock both are alike: the FPGA's "
        "figures leave out pins and clocks, the GPU's has all of the card. Which is better is not "
        "shown. For one camera the text is right: a card that waits for frames takes more than "
        f"{1e6 * film / (core.total * core.factor + 10 * STATIC_MW[1]):.0f} times as much.",
    ]


def load_recorded() -> Recorded:
    """What was kept for the documentation."""
    return Recorded.model_validate(json.loads(FILE.read_text()))


def recorded_here(frames: Sequence[Predicted]) -> Recorded:
    """Predictions beside this machine's CPU."""
    raw, copy = np.ones((2, SIZE, SIZE), np.uint8)
    seconds = _least(partial(np.copyto, copy, raw), 9)
    return Recorded(
        machine=machine(),
        frames=list(frames),
        host_copy_seconds=seconds,
        host_seconds=host_seconds(M, SIZE, _NUMBERS),
    )


def record(recorded: Recorded) -> None:
    """Keep predictions for the documentation."""
    save_records(FILE, recorded.model_dump(), levels=2)
