# SPDX-License-Identifier: Apache-2.0
"""The benchmark of section 6.1.2 of the thesis: its numbers beside ours, on the same frame.

Counts by formulas or simulation are the same everywhere; times are recorded in
``data/thesis_benchmark.json`` with their machine (``make bench RECORD=1`` measures them again).
"""

import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import MAX_PARALLEL_ROWS
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, refocus, scatter_sums
from plenofir.refocus.operator import Image, divide_half_up, output_offset
from plenofir_studies import DATA
from plenofir_studies.clock_counts import ClockCase
from plenofir_studies.many_pixels import GRADE, SCENE, load_placed
from plenofir_studies.methods import running_sums
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import machine, table

FILE = DATA / "thesis_benchmark.json"

SIZE, M, SHIFT = 3201, 11, 1
"""K = L in pixels, M and a' of the example."""
THESIS_CLOCK_HZ = 100e6
THESIS_FIRST_S = 96.24e-6
THESIS_NEXT_S = 64e-6
THESIS_SAVED_PERCENT = 99.91
THESIS_SOFTWARE_S = 12.1369
PEREZ_S = 105.9334e-3
PEREZ_SIDE = 589
SPARTAN6 = [device for device in DEVICES.values() if device.family == "spartan6"]
_ROWS_AT_ONCE = (1, 3, 11, SIZE)
_BITS = 8
_LEAST_RUNS, _MOST_RUNS, _LEAST_SECONDS = 3, 200, 1.0

Step = Callable[[], None]


class Simulated(BaseModel):
    """Clocks of the raster core in simulation."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    first_frame: int  # from the first pixel in to the last pixel of the first frame out
    next_frame: int  # for a further frame


class Recorded(BaseModel):
    """What was measured."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    machine: str  # where the software was timed
    seconds: dict[str, float]  # way in software to its time for a frame
    simulated: dict[str, Simulated]  # engine to its clocks; empty without Verilator


def raster_core(engine: FirEngine | MovingSumEngine) -> CoreConfiguration:
    """Core for the frame of the example: grey, 8 bit, exact arithmetic."""
    return CoreConfiguration(micro_image_size=M, shifts=(SHIFT,), max_columns=SIZE, engine=engine)


def _array(rows_at_once: int) -> ClockCase:
    return ClockCase(SIZE, SIZE, raster_core(FirEngine(parallel_rows=rows_at_once)))


def as_printed(raw: Image, m: int, shift: int) -> Image:
    """Eq. (6.1) as it is printed: each pixel adds to M outputs, in loops over pixels.

    Correctly rounded; rows and columns of the grey image are vectors of NumPy.
    """
    offset = output_offset(m, shift, "centred")
    rows = scatter_sums(raw, m, shift, axis=1, offset=offset)
    sums = scatter_sums(rows, m, shift, axis=0, offset=offset)
    return np.asarray(divide_half_up(sums, m * m).astype(raw.dtype))


def _software() -> dict[str, Callable[[Image], Image]]:
    a = Fraction(SHIFT, M)
    return {
        "`refocus`, one thread": lambda raw: refocus(raw, M, a, threads=1),
        "separable integers in NumPy": lambda raw: running_sums(raw, M, SHIFT, np.int32),
        "the golden model's reference": lambda raw: ExactArithmetic().refocus(raw, M, shift=SHIFT),
        "Eq. (6.1) as printed, loops over pixels, NumPy along the other dimension": (
            lambda raw: as_printed(raw, M, SHIFT)
        ),
    }


def time_software(size: int = SIZE, *, step: Step | None = None) -> dict[str, float]:
    """Time the ways in software (seconds for each frame); all must give the same picture.

    Processor time, the least of several runs, as other work on the machine hardly changes it.
    """
    raw = np.random.default_rng(0).integers(0, 256, (size, size), np.uint8)
    refocus(raw[: 3 * M, : 3 * M], M, Fraction(SHIFT, M))  # compiles
    want, seconds = None, dict[str, float]()
    for name, work in _software().items():
        best, begin, runs = np.inf, time.process_time(), 0
        while runs < _LEAST_RUNS or (
            runs < _MOST_RUNS and time.process_time() - begin < _LEAST_SECONDS
        ):
            start = time.process_time()
            image = work(raw)
            best = min(best, time.process_time() - start)
            runs += 1
            if best > _LEAST_SECONDS:
                break
        want = image if want is None else want
        assert np.array_equal(image, want), name
        seconds[name] = float(best)
        if step is not None:
            step()
    return seconds


def simulate(engine: FirEngine | MovingSumEngine, size: int = SIZE, frames: int = 2) -> Simulated:
    """Send two frames or more back to back through the raster core in Verilator.

    AssertionError if one is not the golden model's.
    """
    core = raster_core(engine)
    rng = np.random.default_rng(0)
    raw = rng.integers(0, 256, (frames, size, size), np.uint8)
    with tempfile.TemporaryDirectory() as folder:
        result = run_bench(find_simulator("verilator"), core, raw, Path(folder))
    a = Fraction(SHIFT, M)
    assert all(
        np.array_equal(image, refocus(frame, M, a))
        for image, frame in zip(result.frames, raw, strict=True)
    )
    assert result.latency_clocks is not None
    # Both ends are included. Frames follow each other as fast as the core takes them.
    next_frame, rest = divmod(result.clocks - result.latency_clocks, frames)
    assert rest == 0
    return Simulated(first_frame=result.latency_clocks + next_frame, next_frame=next_frame)


def measure(step: Step | None = None) -> Recorded:
    """Time the software and simulate both engines; `step` is called after each of six steps."""
    seconds = time_software(step=step)
    simulated = dict[str, Simulated]()
    for engine in (FirEngine(), MovingSumEngine()):
        # Without Verilator there are the formulas.
        with suppress(InputError):
            simulated[engine.kind] = simulate(engine)
        if step is not None:
            step()
    return Recorded(machine=machine(), seconds=seconds, simulated=simulated)


def load_recorded() -> Recorded:
    return Recorded.model_validate_json(FILE.read_text())


def save_recorded(recorded: Recorded) -> None:
    save_records(FILE, recorded.model_dump(mode="json"), levels=2)


def _rows(count: int) -> str:
    return "1 row" if count == 1 else f"{count} rows"


def _time(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1 or unit == "us":
            return f"{seconds * factor:.4g} {unit}"
    raise AssertionError


def _clock_rows(recorded: Recorded) -> list[list[str]]:
    """Rows of the table of clocks: ours, counted and simulated."""
    rows = []

    def add(design: str, how: str, clocks: tuple[int, int], mhz: float = 100) -> None:
        times = (_time(n / mhz / 1e6) for n in clocks)
        rows.append([f"ours, {design}", how, *map(str, clocks), f"{mhz:g}", *times])

    for rows_at_once in reversed(_ROWS_AT_ONCE):
        case = _array(rows_at_once)
        clocks = case.first_frame, case.next_frame
        add(f"array, {_rows(rows_at_once)} at once", "formula", clocks)
    for kind, measured in recorded.simulated.items():
        add(f"raster core, {kind}", "simulated", (measured.first_frame, measured.next_frame))
    for pixels, placed in load_placed().items():
        core = raster_core(MovingSumEngine.model_validate({"pixels_per_clock": pixels}))
        frame = core.band_steps(SIZE) * core.frame_lines(SIZE)
        name = f"moving_sum, {pixels} pixel{'s' if pixels > 1 else ''} a clock, ECP5 grade {GRADE}"
        clocks = core.latency_clocks(SIZE, SIZE) + frame, frame
        add(f"raster core, {name}", "formula", clocks, placed.fmax_mhz)
    return rows


def _buildable_rows() -> list[list[str]]:
    cores = {"moving_sum": raster_core(MovingSumEngine())}
    for n in (1, 3, 11, MAX_PARALLEL_ROWS, SIZE):
        cores[f"fir, {_rows(n)} at once"] = raster_core(FirEngine(parallel_rows=n))
    rows = []
    for name, core in cores.items():
        bits = core.parallel_rows * _BITS
        if core.parallel_rows > MAX_PARALLEL_ROWS:
            parts = core.blocks[0].parts
            registers = parts["register bits"] + parts["skew bits"] // 2
            cells = ["", f"{registers} bits of registers", "", "none"]
        else:
            usage = estimate(core.blocks)
            fits = [d.name.upper() for d in SPARTAN6 if not d.overflow(usage)]
            amounts = usage.lut, usage.flip_flops, usage.block_rams
            cells = [*map(str, amounts), fits[0] if fits else "none"]
        rows.append([name, f"{bits}, {bits * THESIS_CLOCK_HZ / 1e9:.4g} Gbit/s", *cells])
    return rows


def page(recorded: Recorded) -> str:
    case = _array(SIZE)
    first, following = case.thesis_first_frame, case.thesis_next_frame
    pixels = SIZE * SIZE
    perez_clocks = PEREZ_S * THESIS_CLOCK_HZ
    saved = 100 * (1 - THESIS_FIRST_S / PEREZ_S)
    raster = pixels / THESIS_CLOCK_HZ
    names = list(recorded.seconds)
    fast, printed = recorded.seconds[names[0]], recorded.seconds[names[-1]]
    devices = DEVICES["xc6slx45"], SPARTAN6[-1]
    lines = [
        "# The benchmark of the thesis",
        "",
        "Built by `make docs` from what `make bench RECORD=1` measured; `make bench` writes the "
        "same page for the machine that it runs on, `build/bench/thesis.md`.",
        "",
        f"Section 6.1.2 of the thesis: a grey frame of {SIZE} x {SIZE} pixels, M = {M}, "
        f"a = {SHIFT}/{M}, at 100 MHz.",
        "",
        "## Clocks",
        "",
    ]
    heads = ["design", "how known", "clocks, first frame", "further", "MHz"]
    heads += ["first frame", "further"]
    lines += table(
        heads,
        [
            [
                f"thesis, {SIZE} rows at once",
                "Eqs. (6.10), (6.12)",
                str(first),
                str(following),
                "100",
                _time(THESIS_FIRST_S),
                _time(THESIS_NEXT_S),
            ],
            [
                f"Pérez et al., as the thesis quotes them; output {PEREZ_SIDE} x {PEREZ_SIDE}",
                "time x clock",
                f"{perez_clocks:.0f}",
                "",
                "100",
                _time(PEREZ_S),
                "",
            ],
            *_clock_rows(recorded),
        ],
    )
    lines += [
        f"Further frames need {case.next_frame} clocks, half of Eq. (6.12): a column of the array "
        "leaves in every clock, and the next frame's first column may follow the last at once. "
        "The formulas are those of [the filter array](fir-array.md#clocks), which simulations "
        "of smaller frames confirm clock by clock; the raster cores were simulated with the whole "
        "frame and every pixel compared. Clocks on an ECP5 are those that the core of the scene "
        f"`{SCENE}` reached when placed with as many "
        "[pixels a clock](measured/tables.md#many-pixels-a-clock); no Spartan-6 was placed.",
        "",
        "## What the numbers compare",
        "",
        f"The thesis saves {saved:.2f} % ({THESIS_SAVED_PERCENT} % printed) against Pérez et al. "
        f"They take {perez_clocks / pixels:.3f} clocks for each pixel of the raw image: one pixel "
        f"after the other. The thesis takes {SIZE} pixels in a clock. At one pixel a clock and the "
        f"same 100 MHz our raster core needs {_time(raster)}, {100 * (1 - raster / PEREZ_S):.1f} % "
        f"less than theirs, and gives {(SIZE / PEREZ_SIDE) ** 2:.0f} times as many pixels. So the "
        "gain is that of parallel rows, and they want a source that delivers so many:",
        "",
    ]
    heads = ["raster core", "bits in a clock, at 100 MHz", "LUT", "flip-flops", "block RAM"]
    lines += table([*heads, "smallest Spartan-6"], _buildable_rows())
    lines += [
        "LUTs to block RAM are estimates (`plenofir plan`, within 15 % of synthesised cores), for "
        f"grey pixels and exact sums. The thesis's board, the {devices[0].name.upper()}, has "
        f"{devices[0].total.lut} LUT, {devices[0].total.flip_flops} flip-flops and "
        f"{devices[0].total.block_rams} block RAM of 18 Kbit; the largest Spartan-6, the "
        f"{devices[1].name.upper()}, has {devices[1].total.flip_flops} flip-flops. With all rows "
        "at once the partial sums and the skew registers alone are the bits named, hundreds of "
        "times what that device has, and the frame must be in a memory that gives a whole column "
        "in a clock. What can be built takes 1 to 11 rows at once; a video input over HDMI brings "
        "one pixel a clock.",
        "",
        "## Software",
        "",
        f"The thesis's own software took {THESIS_SOFTWARE_S} s. On {recorded.machine} (processor "
        "time, the least of several runs):",
        "",
    ]
    lines += table(
        ["way", "a frame", "thesis's software over it", "Pérez et al. over it"],
        [
            (name, _time(s), f"{THESIS_SOFTWARE_S / s:.3g}", f"{PEREZ_S / s:.3g}")
            for name, s in recorded.seconds.items()
        ],
    )
    lines += [
        f"All give the same picture to the bit. The operator as printed takes {_time(printed)}; "
        f"moving sums, whose cost depends on neither M nor a, take {_time(fast)}. A processor of "
        "today so refocuses this frame faster than one pixel a clock at 100 MHz can come in; the "
        "core's case is the latency of some lines instead of frames, and "
        "energy (`plenofir report energy`).",
        "",
    ]
    return "\n".join(lines)
