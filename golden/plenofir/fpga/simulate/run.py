# SPDX-License-Identifier: Apache-2.0
"""A raw image through the VHDL, beside the golden model, with a report."""

import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from plenofir import project
from plenofir.errors import InputError
from plenofir.files import as_text, check_folder, publish_run
from plenofir.fpga.boards import BOARDS, BoardName
from plenofir.fpga.compare import compare_frames, difference_picture
from plenofir.fpga.core.configuration import MAX_ROWS, CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.shown import (
    bare_slices,
    shown_frames,
    shown_names,
    write_shown,
)
from plenofir.fpga.simulate import chain
from plenofir.fpga.simulate.file_bench import BenchResult, run_bench, wave_signals
from plenofir.fpga.simulate.report import (
    REPORT,
    Chain,
    Report,
    ScreenReport,
    SliceReport,
    StackReport,
)
from plenofir.fpga.simulate.sensor_chain import (
    SensorFrame,
    check_sensor_chain,
    run_sensor_chain,
)
from plenofir.fpga.simulate.waves import write_save_file
from plenofir.fpga.tools.simulators import SimulationError, find_simulator
from plenofir.images import read_image, write_png
from plenofir.refocus import check_raw, error_against_operator, shift_to_name, shift_to_text
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpening import WEIGHT_UNITS
from plenofir.refocus.sharpness import MAX_SHARPNESS_RADIUS, depth_index_picture

FLOWER = project.DATA / "flower_5x5.png"
"""The light field that scenes without an image are simulated with."""
DEFAULT_RAW = project.DATA / "flower_detail_5x5.png"
"""Part of it, which is refocused when the user names no image."""
FLOWER_MICRO_IMAGE_SIZE = 5
FLOWER_FOCUS = "-3/5"

ALL_IN_FOCUS = "all_in_focus.png"
DEPTH_INDEX = "depth_index.png"

Progress = Callable[[str, int, int], None]
"""Called with the step's name, what is done and what there is to do."""


class Run(BaseModel):
    """What to simulate."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    raw: Path = DEFAULT_RAW
    # See `core_for_image`; all its slices are simulated, a frame for each, or at once in a stack.
    core: CoreConfiguration
    # That of the depth index behind a stack, see `plenofir.refocus.sharpness.local_sharpness`.
    radius: Annotated[int, Field(ge=0, le=MAX_SHARPNESS_RADIUS)] = 1
    out: Path  # folder for the results
    simulator: str = "ghdl"  # "ghdl", "nvc" or "verilator"
    waves: bool = False
    # "core" alone, or "hdmi": the whole board from serial TMDS bits to serial TMDS bits.
    chain: Chain = "core"
    board: BoardName = "atlys"  # of the chain "hdmi"
    # What the board shows: besides the slices each output, with and without its text; of the core
    # of a stack the depth index alone counts, instead of `radius`.
    screen: Screen = Screen()
    # Raw frame of a sensor that goes into the board, which makes `raw` of it.
    sensor: SensorFrame | None = None


def picture_names(shift: int, micro_image_size: int, slices: int) -> tuple[str, ...]:
    """File names of a slice's refocused, golden and difference picture.

    They name the slice where there are several; a fraction's stroke becomes an underscore.
    """
    suffix = f"_{shift_to_name(shift, micro_image_size)}" if slices > 1 else ""
    return f"refocused{suffix}.png", f"golden{suffix}.png", f"diff{suffix}.png"


def core_for_image(path: Path, chain: Chain = "core", **fields: Any) -> CoreConfiguration:
    """Core made to measure for an image file: lines, channels (three for HDMI) and pixels.

    `fields` are the core's others.
    """
    raw = read_image(path)
    return CoreConfiguration(
        max_columns=raw.shape[1],
        channels=1 if raw.ndim == 2 and chain == "core" else 3,
        pixel_bits=8 * raw.dtype.itemsize,
        **fields,
    )


def scene_image(core: CoreConfiguration, rows: int) -> Image:
    """Raw image for a scene that has none: the flower, its micro images resampled to M x M.

    As large as the flower and `rows` allow, whole micro images.
    """
    flower = read_image(FLOWER)
    have, want = FLOWER_MICRO_IMAGE_SIZE, core.micro_image_size
    views = np.round(np.linspace(0, have - 1, want)).astype(int)

    def places(length: int, limit: int) -> npt.NDArray[np.intp]:
        lenses = min(length // have, max(limit // want, 1))
        found: npt.NDArray[np.intp] = (np.arange(lenses)[:, None] * have + views).ravel()
        return found[:limit]

    image = flower[np.ix_(places(flower.shape[0], rows), places(flower.shape[1], core.max_columns))]
    if core.channels == 1:
        image = image[..., 1]
    if core.pixel_bits > 8:
        return np.left_shift(image.astype(np.uint16), core.pixel_bits - 8)
    return np.right_shift(image, 8 - core.pixel_bits)


def _check_image(raw: Image, core: CoreConfiguration, where: str) -> None:
    """Refuse an image that a core cannot take."""
    (rows, columns), channels = raw.shape[:2], 1 if raw.ndim == 2 else 3
    largest = int(raw.max())
    if columns > core.max_columns or channels != core.channels or largest >> core.pixel_bits:
        raise InputError(
            f"{columns} columns, {channels} channels, values up to {largest}",
            where=where,
            expected=f"at most {core.max_columns} columns, {core.channels} channels of "
            f"{core.pixel_bits} bit",
        )
    if rows > MAX_ROWS:
        raise InputError(f"{rows} rows", where=where, expected=f"at most {MAX_ROWS} rows")


def _depth_index(what: Run) -> DepthIndexConfiguration | None:
    """Depth index behind a stack; None with other engines, and where it is the board's."""
    core = what.core
    if not isinstance(core.engine, StackEngine):
        return None
    boards = what.chain == "hdmi" and what.screen.needs_stack
    for field, used in (("waves", what.waves), ("chain", what.chain != "core")):
        if used and not boards:
            raise InputError("a focal stack", where=field, expected="engine fir or moving_sum")
    if core.micro_image_size < 2:
        raise InputError(
            f"M = {core.micro_image_size} is too small",
            where="micro_image_size",
            expected="2 or more for a depth index",
        )
    core.check_limits()
    screen = what.screen if what.screen.needs_stack else Screen(radius=what.radius)
    index = screen.index(core)
    index.check_limits()
    return None if boards else index


def run(what: Run, progress: Progress | None = None) -> Report:
    """Refocus a raw image in the VHDL and in the golden model, and compare them.

    Leaves ``refocused.png``, ``golden.png``, ``diff.png`` and ``report.json`` in ``what.out`` (of
    a sweep three pictures for each slice, the slice in the name), and with waves ``refocused.fst``
    and ``refocused.gtkw``. A stack leaves the refocused picture of each slice,
    ``all_in_focus.png`` and ``depth_index.png``. All appear at the end or not at all.
    """
    core, shifts = what.core, what.core.shifts
    m = core.micro_image_size
    if len(set(shifts)) < len(shifts):
        raise InputError("a slice is given twice", where="shifts", expected="each slice once")
    raw = read_image(what.raw)
    check_raw(raw, m, where=str(what.raw))
    depth = _depth_index(what)
    core.check_limits()
    if what.chain == "hdmi":
        if raw.ndim == 2:
            raw = np.repeat(raw[:, :, np.newaxis], 3, axis=2)
        rows, columns = raw.shape[:2]
        if what.sensor is not None:
            check_sensor_chain(what.sensor, core, what.board)
        else:
            chain.check_chain(core, rows, columns, what.screen)
            chain.range_of(BOARDS[what.board], chain.mode_for(columns, rows))
    _check_image(raw, core, str(what.raw))
    if depth is None:
        pictures = [picture_names(shift, m, len(shifts)) for shift in shifts]
    else:
        # Two or more: even the only slice has its a in its name.
        pictures = [picture_names(shift, m, 2)[:1] for shift in shifts]
    screen = what.screen if what.chain == "hdmi" else Screen()
    frames_shown = shown_frames(core, screen)
    if frames_shown:
        pictures = pictures if bare_slices(screen, frames_shown) else []
    more = (ALL_IN_FOCUS, DEPTH_INDEX) if depth else shown_names(core, screen)
    check_folder(what.out, "out", (*sum(pictures, ()), *more, REPORT))
    simulator = find_simulator(what.simulator)
    rows, columns = raw.shape[:2]
    frames = raw[np.newaxis] if depth else np.stack([raw] * len(shifts))
    pixels = rows * columns * len(frames)
    step = f"VHDL {'board' if what.chain == 'hdmi' else 'core'} in {simulator.name.upper()}"

    def tell(step: str, done: int, total: int) -> None:
        if progress is not None:
            progress(step, done, total)

    def show(done: int) -> None:
        tell(step, done, pixels)

    with tempfile.TemporaryDirectory(prefix="plenofir-") as work_name:
        work = Path(work_name)
        results = work / "results"
        results.mkdir()
        tell("golden model", 0, 1)
        golden = core.golden(raw)
        tell("golden model", 1, 1)
        waves = results / "refocused.fst" if what.waves else None
        show(0)
        if what.sensor is not None:
            result = run_sensor_chain(
                simulator, core, what.sensor, (rows, columns), work / "bench", show, what.board
            )
        elif what.chain == "hdmi":
            result = chain.run_chain(
                *(simulator, core, raw, work / "bench", waves, show, what.board, screen)
            )
        else:
            result = run_bench(
                simulator,
                core,
                frames,
                work / "bench",
                index=depth,
                sweep_frames=1 if len(frames) > 1 else 0,
                waves=waves,
                progress=show,
            )
        show(pixels)
        if depth is None and not frames_shown and result.slices != tuple(range(len(shifts))):
            raise SimulationError(f"the core swept through the slices {result.slices}")

        slices = []
        refocused = result.frames if result.stacks is None else result.stacks[0]
        if frames_shown:
            refocused = result.frames[bare_slices(screen, frames_shown)]
        for shift, units, names, got, want in zip(
            *(shifts, core.weights, pictures, refocused, golden), strict=bool(pictures)
        ):
            comparison = compare_frames(got[np.newaxis], want[np.newaxis])
            error = error_against_operator(got, raw, m, shift=shift, order=core.order, units=units)
            slices.append(
                SliceReport(
                    a=shift_to_text(shift, m),
                    shift=shift,
                    sharpening=str(Fraction(units, WEIGHT_UNITS)),
                    pictures=names,
                    mismatches=comparison.mismatches,
                    first_mismatch=comparison.first,
                    largest_error=float(np.abs(error).max()),
                    rms_error=float(np.sqrt(np.mean(error**2))),
                )
            )
            three = (got, want, difference_picture(got, want))
            for name, picture in zip(names, three, strict=False):
                write_png(results / name, picture)
        report = Report(
            raw=as_text(what.raw.name),
            chain=what.chain,
            board=what.board if what.chain == "hdmi" else None,
            M=m,
            slices=tuple(slices),
            columns=columns,
            rows=rows,
            channels=core.channels,
            pixel_bits=core.pixel_bits,
            engine=core.engine.kind,
            parallel_rows=core.parallel_rows,
            pixels_per_clock=core.pixels_per_clock,
            interpolation=core.order,
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
        if depth is not None:
            report = _with_depth(report, core, depth, result, golden, results)
        if frames_shown:
            told = write_shown(core, screen, result.frames, golden, results)
            more_pixels, wrong = rows * columns * len(told), sum(s.mismatches for s in told)
            added = {
                "pixels_compared": report.pixels_compared + more_pixels,
                "mismatches": report.mismatches + wrong,
            }
            report = ScreenReport(**{**dict(report), **added}, shown=told)
        (results / REPORT).write_text(report.model_dump_json(indent=2) + "\n")
        if what.waves:
            hdmi = what.chain == "hdmi"
            shown = chain.WAVE_SIGNALS if hdmi else wave_signals(core.engine)
            write_save_file(results / "refocused.gtkw", results / "refocused.fst", shown)
            (results / "refocused.opt").unlink(missing_ok=True)
        publish_run(results, what.out, REPORT)
    return report


def _with_depth(
    report: Report,
    core: CoreConfiguration,
    depth: DepthIndexConfiguration,
    result: BenchResult,
    golden: Image,
    folder: Path,
) -> StackReport:
    """Compare the depth index and its picture, write both, and add them to the report."""
    assert isinstance(core.engine, StackEngine)
    assert result.index is not None
    image, index, m = result.frames[0], result.index[0], report.M
    want = depth.golden(golden)
    want_index = want.index.repeat(m, 0).repeat(m, 1)[: report.rows, : report.columns]
    found = [
        compare_frames(got[np.newaxis], wanted[np.newaxis])
        for got, wanted in ((image, want.image), (index, want_index))
    ]
    write_png(folder / ALL_IN_FOCUS, image)
    write_png(folder / DEPTH_INDEX, depth_index_picture(index, depth.slices))
    waiting, judged = depth.memory_bits
    counted = np.bincount(index[::m, ::m].ravel(), minlength=depth.slices)
    more = {
        "pixels_compared": report.pixels_compared + sum(part.pixels for part in found),
        "mismatches": report.mismatches + sum(part.mismatches for part in found),
    }
    return StackReport(
        **{**dict(report), **more},
        pictures=(ALL_IN_FOCUS, DEPTH_INDEX),
        radius=depth.radius,
        micro_images_of_slice=tuple(counted.tolist()),
        history_bits=core.engine.history_bits(core),
        slice_bits=core.engine.slice_bits(core),
        waiting_bits=waiting,
        sharpness_bits=judged,
    )
