"""The main job: one raw image through the VHDL core, beside the golden model, with a report."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from plenofir import project
from plenofir.errors import InputError
from plenofir.files import check_folder, publish_files
from plenofir.fpga.core.configuration import MAX_ROWS, CoreConfiguration
from plenofir.fpga.core.fir import FirEngine
from plenofir.fpga.core.moving_sum import MovingSumEngine
from plenofir.fpga.simulate import chain
from plenofir.fpga.simulate.chain import check_chain, run_chain
from plenofir.fpga.simulate.compare import compare_frames, difference_picture
from plenofir.fpga.simulate.pump import run_pump, wave_signals
from plenofir.fpga.simulate.simulators import SimulationError, find_simulator
from plenofir.fpga.simulate.waves import write_save_file
from plenofir.images import read_image, write_png
from plenofir.refocus import check_raw, error_against_operator, focus_to_shift, shift_to_text
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic
from plenofir.refocus.operator import Image

FLOWER = project.DATA / "flower_5x5.png"
"""The light field that scenes without an image are simulated with."""
DEFAULT_RAW = project.DATA / "flower_detail_5x5.png"
"""Part of it, which is refocused when the user names no image."""
FLOWER_MICRO_IMAGE_SIZE = 5
FLOWER_FOCUS = "-3/5"

Chain = Literal["core", "hdmi"]

Progress = Callable[[str, int, int], None]
"""Called with the step's name, what is done and what there is to do."""


class SimulationJob(BaseModel):
    """What to simulate.

    Attributes
    ----------
    raw
        Raw image file.
    micro_image_size
        M in pixels.
    focus
        The set of a, fractions whose denominators divide M; more than one makes a sweep, a frame
        for each.
    interpolation
        Order of the interpolation, see `plenofir.refocus.operator.interpolated_sums`.
    engine
        How the core filters.
    out
        Folder for the results.
    arithmetic
        Exact or stored products.
    simulator
        "ghdl", "nvc" or "verilator".
    waves
        Whether to write a waveform.
    chain
        "core", the raster refocuser alone, or "hdmi", the whole board from serial TMDS bits to
        serial TMDS bits.
    core
        Core of a scene, which agrees with the fields on M, a, interpolation, rows and arithmetic;
        the image may be smaller than its lines. None: a core made to measure for the image.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: Path = DEFAULT_RAW
    micro_image_size: int = FLOWER_MICRO_IMAGE_SIZE
    focus: tuple[str, ...] = (FLOWER_FOCUS,)
    interpolation: int = 0
    engine: FirEngine | MovingSumEngine = FirEngine()
    out: Path
    arithmetic: Arithmetic = ExactArithmetic()
    simulator: str = "ghdl"
    waves: bool = False
    chain: Chain = "core"
    core: CoreConfiguration | None = None


class SliceReport(BaseModel):
    """What ``report.json`` holds of each slice.

    Attributes
    ----------
    a
        Focus setting.
    shift
        a' = a M in pixels.
    pictures
        Files of the refocused picture, the golden one and their difference.
    mismatches
        Pixels that differ in any channel.
    first_mismatch
        Where the first one is, or None.
    largest_error, rms_error
        Distance of the VHDL's image from the exact real-valued operator, in grey levels.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    a: str
    shift: int
    pictures: tuple[str, str, str]
    mismatches: int
    first_mismatch: str | None
    largest_error: float
    rms_error: float


class Report(BaseModel):
    """What ``report.json`` holds.

    Attributes
    ----------
    raw
        Name of the raw image file.
    chain
        What was simulated: "core", or "hdmi" for the whole board.
    M
        Micro image size in pixels.
    slices
        One entry for each focus setting.
    columns, rows, channels, pixel_bits
        Size of the image.
    engine
        Engine of the core.
    parallel_rows
        Rows that are filtered at once.
    interpolation
        Order of the interpolation.
    pixels_compared
        Pixels compared with the bit-true golden model, in all slices.
    mismatches
        Pixels that differ in any channel.
    clocks
        Clocks from the first pixel in to the last pixel out.
    clocks_per_pixel
        Clocks from the first to the last pixel in, for each pixel.
    latency_clocks
        Clocks from the first pixel in to the first pixel out.
    simulated_clocks_per_second
        Speed of the simulator.
    simulator
        Its version.
    arithmetic
        Arithmetic of the core.
    error_bound
        What the arithmetic guarantees for the largest error.
    taps
        Taps of the filters of each dimension.
    line_buffer_bits
        Bits of the column filters' line buffers.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: str
    chain: Chain
    M: int
    slices: tuple[SliceReport, ...]
    columns: int
    rows: int
    channels: int
    pixel_bits: int
    engine: str
    parallel_rows: int
    interpolation: int
    pixels_compared: int
    mismatches: int
    clocks: int
    clocks_per_pixel: float
    latency_clocks: int
    simulated_clocks_per_second: int
    simulator: str
    arithmetic: Arithmetic
    error_bound: float
    taps: int
    line_buffer_bits: int


def picture_names(shift: int, micro_image_size: int, slices: int) -> tuple[str, str, str]:
    """File names of a slice's pictures.

    Parameters
    ----------
    shift
        a' in pixels.
    micro_image_size
        M in pixels.
    slices
        Number of slices of the job; the names of a single one do not tell which it is.

    Returns
    -------
    tuple of str
        Refocused, golden and difference picture. A fraction's stroke becomes an underscore.
    """
    text = shift_to_text(shift, micro_image_size).replace("/", "_")
    suffix = f"_{text}" if slices > 1 else ""
    return f"refocused{suffix}.png", f"golden{suffix}.png", f"diff{suffix}.png"


def _check_out(out: Path, names: Sequence[str]) -> None:
    """Refuse a result folder that cannot be written, before any work is done."""
    check_folder(out, "OUT")
    for name in names:
        if (out / name).is_dir():
            raise InputError(f"{out / name} is a folder", where="OUT", expected="a file or nothing")


def scene_job(core: CoreConfiguration, job: SimulationJob) -> SimulationJob:
    """Job that simulates the core of a scene.

    Parameters
    ----------
    core
        The core.
    job
        Raw image, folder, simulator and waves.

    Returns
    -------
    SimulationJob
        The same with the scene's core, all of its slices.
    """
    m = core.micro_image_size
    if job.chain == "hdmi":
        # Video has its blanking.
        core = core.model_copy(update={"engine": core.engine.for_video()})
    return job.model_copy(
        update={
            "core": core,
            "micro_image_size": m,
            "focus": tuple(shift_to_text(shift, m) for shift in core.shifts),
            "interpolation": core.order,
            "engine": core.engine,
            "arithmetic": core.arithmetic,
        }
    )


def scene_image(core: CoreConfiguration, rows: int) -> Image:
    """Raw image for a scene that has none: the flower, its micro images resampled to M x M.

    Parameters
    ----------
    core
        The core: M, channels, bits, line length.
    rows
        Largest number of rows.

    Returns
    -------
    Image
        As large as the flower allows, whole micro images.
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
    columns, channels = raw.shape[1], 1 if raw.ndim == 2 else 3
    largest = int(raw.max())
    if columns > core.max_columns or channels != core.channels or largest >> core.pixel_bits:
        raise InputError(
            f"{columns} columns, {channels} channels, values up to {largest}",
            where=where,
            expected=f"at most {core.max_columns} columns, {core.channels} channels of "
            f"{core.pixel_bits} bit",
        )


def run_job(job: SimulationJob, progress: Progress | None = None) -> Report:
    """Refocus a raw image in the VHDL core and in the golden model, and compare them.

    Leaves ``refocused.png``, ``golden.png``, ``diff.png``, ``report.json`` in ``job.out`` (of a
    sweep three pictures for each slice, the slice in the name), and with waves
    ``refocused.fst`` and ``refocused.gtkw``. All appear at the end or not at all.

    Parameters
    ----------
    job
        What to simulate.
    progress
        Called as the work goes on.

    Returns
    -------
    Report
        What ``report.json`` holds.

    Raises
    ------
    InputError
        If the image, M, a, the folder or the simulator cannot be used.
    plenofir.fpga.simulate.simulators.SimulationError
        If the simulation fails.
    """
    m = job.micro_image_size
    if m < 1:
        raise InputError(f"M = {m} is too small", where="M", expected="an integer, 1 or more")
    where = "A" if len(job.focus) == 1 else "SWEEP"
    shifts = tuple(focus_to_shift(focus, m, where=where) for focus in job.focus)
    for number, shift in enumerate(shifts):
        if shift in shifts[:number]:
            raise InputError(
                f"{shift_to_text(shift, m)} stands in it twice", where=where, expected="each a once"
            )
    raw = read_image(job.raw)
    check_raw(raw, m, where=str(job.raw))
    if job.chain == "hdmi" and raw.ndim == 2:
        raw = np.repeat(raw[:, :, np.newaxis], 3, axis=2)
    rows, columns = raw.shape[:2]
    configuration = job.core or CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=columns,
        channels=1 if raw.ndim == 2 else 3,
        pixel_bits=8 * raw.dtype.itemsize,
        arithmetic=job.arithmetic,
        order=job.interpolation,
        engine=job.engine,
    )
    configuration.check_limits()
    if job.chain == "hdmi":
        check_chain(configuration, rows, columns)
    _check_image(raw, configuration, str(job.raw))
    if rows > MAX_ROWS:
        raise InputError(f"{rows} rows", where=str(job.raw), expected=f"at most {MAX_ROWS} rows")
    pictures = [picture_names(shift, m, len(shifts)) for shift in shifts]
    _check_out(job.out, ["report.json", *(name for names in pictures for name in names)])
    simulator = find_simulator(job.simulator)

    def tell(step: str, done: int, total: int) -> None:
        if progress is not None:
            progress(step, done, total)

    pixels = rows * columns * len(shifts)
    work_root = project.root() / "build" / "work"
    work_root.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=work_root, prefix="sim-") as work_name:
        work = Path(work_name)
        results = work / "results"
        results.mkdir()
        golden = []
        for done, shift in enumerate(shifts):
            tell("golden model", done, len(shifts))
            golden.append(job.arithmetic.refocus(raw, m, shift, order=job.interpolation))
        tell("golden model", len(shifts), len(shifts))
        waves = results / "refocused.fst" if job.waves else None
        if job.chain == "hdmi":
            step = f"VHDL board in {simulator.name.upper()}"
            tell(step, 0, pixels)
            result = run_chain(
                simulator,
                configuration,
                raw,
                work / "pump",
                waves=waves,
                progress=lambda share: tell(step, int(share * pixels), pixels),
            )
        else:
            step = f"VHDL core in {simulator.name.upper()}"
            tell(step, 0, pixels)
            result = run_pump(
                simulator,
                configuration,
                np.stack([raw] * len(shifts)),
                work / "pump",
                sweep_frames=1 if len(shifts) > 1 else 0,
                waves=waves,
                progress=lambda done: tell(step, done, pixels),
            )
        tell(step, pixels, pixels)
        if result.slices != tuple(range(len(shifts))):
            raise SimulationError(f"the core swept through the slices {result.slices}")

        slices = []
        for number, (shift, names) in enumerate(zip(shifts, pictures, strict=True)):
            refocused = result.frames[number]
            comparison = compare_frames(refocused[np.newaxis], golden[number][np.newaxis])
            error = error_against_operator(refocused, raw, m, shift, order=job.interpolation)
            slices.append(
                SliceReport(
                    a=shift_to_text(shift, m),
                    shift=shift,
                    pictures=names,
                    mismatches=comparison.mismatches,
                    first_mismatch=comparison.first,
                    largest_error=float(np.abs(error).max()),
                    rms_error=float(np.sqrt(np.mean(error**2))),
                )
            )
            write_png(results / names[0], refocused)
            write_png(results / names[1], golden[number])
            write_png(results / names[2], difference_picture(refocused, golden[number]))
        report = Report(
            raw=job.raw.name,
            chain=job.chain,
            M=m,
            slices=tuple(slices),
            columns=columns,
            rows=rows,
            channels=configuration.channels,
            pixel_bits=configuration.pixel_bits,
            engine=job.engine.kind,
            parallel_rows=configuration.parallel_rows,
            interpolation=job.interpolation,
            pixels_compared=pixels,
            mismatches=sum(slice_.mismatches for slice_ in slices),
            clocks=result.clocks,
            clocks_per_pixel=round(result.input_clocks / pixels, 6),
            latency_clocks=result.latency_clocks,
            simulated_clocks_per_second=round(result.clocks / result.seconds),
            simulator=simulator.version,
            arithmetic=job.arithmetic,
            error_bound=float(
                job.arithmetic.error_bound(m, configuration.pixel_bits, job.interpolation)
            ),
            taps=configuration.taps,
            line_buffer_bits=configuration.line_buffer_bits,
        )
        (results / "report.json").write_text(report.model_dump_json(indent=2) + "\n")
        if job.waves:
            shown = (
                chain.WAVE_SIGNALS if job.chain == "hdmi" else wave_signals(configuration.engine)
            )
            write_save_file(results / "refocused.gtkw", results / "refocused.fst", shown)
            (results / "refocused.opt").unlink(missing_ok=True)
        publish_files(results, job.out)
    return report


def report_summary(report: Report) -> list[tuple[str, Any]]:
    """Lines of a report for a person.

    Parameters
    ----------
    report
        What to summarise.

    Returns
    -------
    list of tuple
        Name and value of each line.
    """
    wrong = next((s for s in report.slices if s.mismatches), None)
    agree = (
        f"all {report.pixels_compared} pixels equal the golden model"
        if wrong is None
        else f"{report.mismatches} of {report.pixels_compared} pixels differ; "
        f"first: a = {wrong.a}, {wrong.first_mismatch}"
    )
    depth = f"{report.channels} x {report.pixel_bits} bit"
    focus = " ".join(slice_.a for slice_ in report.slices)
    at_once = f", {report.parallel_rows} rows at once" if report.parallel_rows > 1 else ""
    width = f"{report.taps} taps" if report.engine == "fir" else "moving sums"
    order = f", interpolation of order {report.interpolation}" if report.interpolation else ""
    largest = max(slice_.largest_error for slice_ in report.slices)
    rms = max(slice_.rms_error for slice_ in report.slices)
    return [
        ("image", f"{report.raw}, {report.columns} x {report.rows}, {depth}"),
        ("focus", f"M = {report.M}, a = {focus}, {width}{at_once}{order}"),
        ("arithmetic", report.arithmetic.kind),
        *([("chain", "serial TMDS bits in and out")] if report.chain == "hdmi" else []),
        ("result", agree),
        (
            "error",
            f"largest {largest:.4f}, RMS {rms:.4f} grey levels (bound {report.error_bound:.4f})",
        ),
        (
            "clocks",
            f"{report.clocks}, {report.clocks_per_pixel:g} for each pixel, "
            f"latency {report.latency_clocks}",
        ),
        (
            "simulator",
            f"{report.simulator}, {report.simulated_clocks_per_second} clocks a second",
        ),
    ]
