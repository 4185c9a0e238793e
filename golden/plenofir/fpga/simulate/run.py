# SPDX-License-Identifier: Apache-2.0
"""A raw image through the VHDL, beside the golden model, with a report."""

import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import numpy as np

from plenofir.fpga.compare import compare_frames, difference_picture
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.simulate.report import REPORT, Report, SliceReport
from plenofir.fpga.simulate.request import Progress, Run, read_raw
from plenofir.fpga.simulate.simulations import Place, Simulation, simulation_of
from plenofir.fpga.simulate.waves import WaveSignal, finish_waves, named_waves
from plenofir.fpga.tools.simulators import SimulationError, Simulator, Waves, find_simulator
from plenofir.ground.files import as_text, check_folder, publish_files, publish_run
from plenofir.ground.images import Picture, bare, write_png
from plenofir.refocus import error_against_operator, shift_to_text
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpening import WEIGHT_UNITS


def run(
    request: Run,
    progress: Progress | None = None,
    way: Callable[[Run, Picture], Simulation] = simulation_of,
) -> Report:
    """Refocus a raw image in the VHDL and in the golden model, and compare them.

    Leaves ``refocused.png``, ``golden.png``, ``diff.png`` and ``report.json`` in ``request.out``
    (three pictures for each slice of a sweep, with a in the name), and with waves
    ``refocused.fst`` and ``refocused.gtkw``. A stack leaves the refocused picture of each slice,
    ``all_in_focus.png`` and ``depth_index.png``. All appear at the end or not at all.
    """
    picture = read_raw(request)
    simulation = way(request, picture)
    raw = simulation.raw
    simulation.check()
    pictures = simulation.pictures
    check_folder(request.out, "out", (*sum(pictures, ()), *simulation.more_files, REPORT))
    simulator = find_simulator(request.simulator)
    pixels = raw.shape[0] * raw.shape[1] * simulation.frames
    step = f"VHDL {simulation.name} in {simulator.name.upper()}"

    def tell(step: str, done: int, total: int) -> None:
        if progress is not None:
            progress(step, done, total)

    with tempfile.TemporaryDirectory(prefix="plenofir-") as work_name:
        work = Path(work_name)
        results = work / "results"
        results.mkdir()
        tell("golden model", 0, 1)
        golden = request.core.golden(raw)
        tell("golden model", 1, 1)

        def place(name: str) -> Place:
            waves = waves_in(results / name, request, simulator, simulation.wave_signals)
            return Place(simulator, work / "bench", waves, lambda done: tell(step, done, pixels))

        tell(step, 0, pixels)
        at = place("refocused")
        with watched(at.waves, simulation.wave_signals, request.out):
            result = simulation.run(at)
        tell(step, pixels, pixels)
        refocused = simulation.slices(result)
        slices = _slices(request, picture, refocused, golden, pictures, results) if pictures else ()
        report = _report(request, raw, simulator, result, slices, pixels)
        report = simulation.complete(report, result, golden, results)
        if request.stalls:
            at = place("stalled")._replace(progress=lambda _: None)
            with watched(at.waves, simulation.wave_signals, request.out):
                stalls = simulation.stalled(at, request.stalls)
            report = report.model_copy(update={"stalls": stalls})
        (results / REPORT).write_text(report.model_dump_json(indent=2) + "\n")
        publish_run(results, request.out, REPORT)
    return report


def waves_in(
    path: Path, request: Run, simulator: Simulator, signals: Sequence[WaveSignal]
) -> Waves | None:
    """The waveform that a run writes: `path` with the suffix for it, or none."""
    if request.waves == "0":
        return None
    if request.waves == "1":
        return named_waves(path.with_suffix(".fst"), signals)
    # GHDL's GHW files alone hold records, arrays, and integers of more than a bit.
    suffix = ".ghw" if simulator.name == "ghdl" else ".fst"
    return Waves(path.with_suffix(suffix), depth=request.waves_depth)


@contextmanager
def watched(waves: Waves | None, signals: Sequence[WaveSignal], out: Path) -> Iterator[None]:
    """Finish the waveform that a simulation writes; one that fails leaves its own in `out`."""
    try:
        yield
    except SimulationError as error:
        if waves is None or not waves.path.is_file():
            raise
        finish_waves(waves, signals)
        with tempfile.TemporaryDirectory(prefix="plenofir-") as name:
            for file in waves.path.parent.glob(f"{waves.path.stem}.*"):
                shutil.copy(file, name)
            publish_files(Path(name), out)
        raise SimulationError(f"{error}; its waveform is {out / waves.path.name}") from None
    if waves is not None and waves.path.is_file():
        finish_waves(waves, signals)


def _slices(
    request: Run,
    raw: Picture,
    refocused: Image,
    golden: Image,
    pictures: list[tuple[str, ...]],
    folder: Path,
) -> tuple[SliceReport, ...]:
    """Compare each slice with the golden model and the operator, and write its pictures."""
    core, m, reports = request.core, request.core.micro_image_size, []
    for shift, units, box, names, got, want in zip(
        core.shifts, core.weights, core.slice_boxes, pictures, refocused, golden, strict=True
    ):
        comparison = compare_frames(got[np.newaxis], want[np.newaxis])
        error = error_against_operator(
            *(got, raw.pixels, m),
            shift=shift,
            order=core.order,
            units=units,
            border=core.border,
            box=box,
        )
        reports.append(
            SliceReport(
                a=shift_to_text(shift, m),
                shift=shift,
                sharpening=str(Fraction(units, WEIGHT_UNITS)),
                box=box,
                pictures=names,
                mismatches=comparison.mismatches,
                first_mismatch=comparison.first,
                largest_error=float(np.abs(error).max()),
                rms_error=float(np.sqrt(np.mean(error**2))),
            )
        )
        # A stack has only the first of the three.
        stored = raw.like(got), raw.like(want), bare(difference_picture(got, want))
        for name, picture in zip(names, stored, strict=False):
            write_png(folder / name, picture)
    return tuple(reports)


def _report(
    request: Run,
    raw: Image,
    simulator: Simulator,
    result: BenchResult,
    slices: tuple[SliceReport, ...],
    pixels: int,
) -> Report:
    core, (rows, columns) = request.core, raw.shape[:2]
    return Report(
        raw=as_text(request.raw.name),
        chain=request.chain,
        board=request.board if request.chain == "hdmi" else None,
        M=core.micro_image_size,
        slices=slices,
        columns=columns,
        rows=rows,
        channels=core.channels,
        pixel_bits=core.pixel_bits,
        engine=core.engine.kind,
        parallel_rows=core.parallel_rows,
        pixels_per_clock=core.pixels_per_clock,
        interpolation=core.order,
        border=core.border,
        pixels_compared=rows * columns * len(slices),
        mismatches=sum(slice_.mismatches for slice_ in slices),
        clocks=result.clocks,
        clocks_per_pixel=round(result.input_clocks / pixels, 6),
        latency_clocks=result.latency_clocks,
        simulated_clocks_per_second=round(result.clocks / result.seconds),
        simulator=simulator.version,
        arithmetic=core.arithmetic,
        error_bound=float(core.error_bound),
        taps=core.taps,
        line_buffer_bits=core.line_buffer_bits,
    )
