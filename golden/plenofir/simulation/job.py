"""The main job: one raw image through the VHDL core, beside the golden model, with a report."""

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from plenofir import project
from plenofir.compare import compare_frames, difference_picture
from plenofir.core import MAX_ROWS, CoreConfiguration
from plenofir.errors import InputError
from plenofir.images import read_image, write_png
from plenofir.refocus import check_raw, error_against_operator, focus_to_shift, shift_to_text
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic
from plenofir.simulation.pump import WAVE_SIGNALS, run_pump
from plenofir.simulation.simulators import find_simulator
from plenofir.simulation.waves import write_save_file

FLOWER = project.DATA / "flower_5x5.png"
"""The light field that is refocused when the user names none."""
FLOWER_MICRO_IMAGE_SIZE = 5
FLOWER_FOCUS = "-3/5"

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
        a, a fraction whose denominator divides M.
    out
        Folder for the results.
    arithmetic
        Exact or stored products.
    simulator
        "ghdl" or "nvc".
    waves
        Whether to write a waveform.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: Path = FLOWER
    micro_image_size: int = FLOWER_MICRO_IMAGE_SIZE
    focus: str = FLOWER_FOCUS
    out: Path
    arithmetic: Arithmetic = ExactArithmetic()
    simulator: str = "ghdl"
    waves: bool = False


class Report(BaseModel):
    """What ``report.json`` holds.

    Attributes
    ----------
    raw
        Name of the raw image file.
    M
        Micro image size in pixels.
    a
        Focus setting.
    shift
        a' = a M in pixels.
    columns, rows, channels, pixel_bits
        Size of the image.
    pixels_compared
        Pixels compared with the bit-true golden model.
    mismatches
        Pixels that differ in any channel.
    first_mismatch
        Where the first one is, or None.
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
    largest_error, rms_error
        Distance of the VHDL's image from the exact real-valued operator, in grey levels.
    error_bound
        What the arithmetic guarantees for the largest error.
    taps
        Taps of each filter.
    line_buffer_bits
        Bits of the column filters' line buffers.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: str
    M: int
    a: str
    shift: int
    columns: int
    rows: int
    channels: int
    pixel_bits: int
    pixels_compared: int
    mismatches: int
    first_mismatch: str | None
    clocks: int
    clocks_per_pixel: float
    latency_clocks: int
    simulated_clocks_per_second: int
    simulator: str
    arithmetic: Arithmetic
    largest_error: float
    rms_error: float
    error_bound: float
    taps: int
    line_buffer_bits: int


def _check_out(out: Path) -> None:
    """Refuse a result folder that cannot be written, before any work is done."""
    expected = "a folder that can be written"
    existing = out
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"{existing} is not a folder", where="OUT", expected=expected)
    try:
        # A trial says more than the permission bits: root, read-only and full file systems.
        with tempfile.TemporaryDirectory(dir=existing, prefix=".plenofir-"):
            pass
    except OSError as error:
        what = f"{existing} cannot be written ({error.strerror})"
        raise InputError(what, where="OUT", expected=expected) from None
    for name in ("refocused.png", "golden.png", "diff.png", "report.json"):
        if (out / name).is_dir():
            raise InputError(f"{out / name} is a folder", where="OUT", expected="a file or nothing")


def run_job(job: SimulationJob, progress: Progress | None = None) -> Report:
    """Refocus a raw image in the VHDL core and in the golden model, and compare them.

    Leaves ``refocused.png``, ``golden.png``, ``diff.png``, ``report.json`` in ``job.out``, and
    with waves ``refocused.fst`` and ``refocused.gtkw``. All appear at the end or not at all.

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
    plenofir.simulation.simulators.SimulationError
        If the simulation fails.
    """
    m = job.micro_image_size
    if m < 1:
        raise InputError(f"M = {m} is too small", where="M", expected="an integer, 1 or more")
    shift = focus_to_shift(job.focus, m, where="A")
    raw = read_image(job.raw)
    check_raw(raw, m, where=str(job.raw))
    rows, columns = raw.shape[:2]
    configuration = CoreConfiguration(
        micro_image_size=m,
        shift=shift,
        max_columns=columns,
        channels=1 if raw.ndim == 2 else 3,
        pixel_bits=8 * raw.dtype.itemsize,
        arithmetic=job.arithmetic,
    )
    configuration.check_limits()
    if rows > MAX_ROWS:
        raise InputError(f"{rows} rows", where=str(job.raw), expected=f"at most {MAX_ROWS} rows")
    _check_out(job.out)
    simulator = find_simulator(job.simulator)

    def tell(step: str, done: int, total: int) -> None:
        if progress is not None:
            progress(step, done, total)

    pixels = rows * columns
    work_root = project.root() / "build" / "work"
    work_root.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=work_root, prefix="sim-") as work_name:
        work = Path(work_name)
        results = work / "results"
        results.mkdir()
        tell("golden model", 0, 1)
        golden = job.arithmetic.refocus(raw, m, shift)
        tell("golden model", 1, 1)
        step = f"VHDL core in {simulator.name.upper()}"
        tell(step, 0, pixels)
        result = run_pump(
            simulator,
            configuration,
            raw[np.newaxis],
            work / "pump",
            waves=results / "refocused.fst" if job.waves else None,
            progress=lambda done: tell(step, done, pixels),
        )
        tell(step, pixels, pixels)

        refocused = result.frames[0]
        comparison = compare_frames(result.frames, golden[np.newaxis])
        error = error_against_operator(refocused, raw, m, shift)
        report = Report(
            raw=job.raw.name,
            M=m,
            a=shift_to_text(shift, m),
            shift=shift,
            columns=columns,
            rows=rows,
            channels=configuration.channels,
            pixel_bits=configuration.pixel_bits,
            pixels_compared=comparison.pixels,
            mismatches=comparison.mismatches,
            first_mismatch=comparison.first,
            clocks=result.clocks,
            clocks_per_pixel=round(result.input_clocks / pixels, 6),
            latency_clocks=result.latency_clocks,
            simulated_clocks_per_second=round(result.clocks / result.seconds),
            simulator=simulator.version,
            arithmetic=job.arithmetic,
            largest_error=float(np.abs(error).max()),
            rms_error=float(np.sqrt(np.mean(error**2))),
            error_bound=float(job.arithmetic.error_bound(m, configuration.pixel_bits)),
            taps=configuration.taps,
            line_buffer_bits=configuration.line_buffer_bits,
        )
        write_png(results / "refocused.png", refocused)
        write_png(results / "golden.png", golden)
        write_png(results / "diff.png", difference_picture(refocused, golden))
        (results / "report.json").write_text(report.model_dump_json(indent=2) + "\n")
        if job.waves:
            write_save_file(results / "refocused.gtkw", results / "refocused.fst", WAVE_SIGNALS)
            (results / "refocused.opt").unlink(missing_ok=True)
        _publish(results, job.out)
    return report


def _publish(results: Path, out: Path) -> None:
    """Move all results into the folder, each replacing its predecessor in one step."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out, prefix=".plenofir-") as staging:
            for file in results.iterdir():
                shutil.copy(file, staging)
            for file in sorted(Path(staging).iterdir()):
                file.replace(out / file.name)
    except OSError as error:
        raise InputError(
            f"cannot write: {error.strerror}",
            where=f"OUT ({out})",
            expected="a folder that can be written, with enough room",
        ) from None


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
    agree = (
        f"all {report.pixels_compared} pixels equal the golden model"
        if report.mismatches == 0
        else f"{report.mismatches} of {report.pixels_compared} pixels differ; "
        f"first: {report.first_mismatch}"
    )
    depth = f"{report.channels} x {report.pixel_bits} bit"
    return [
        ("image", f"{report.raw}, {report.columns} x {report.rows}, {depth}"),
        ("focus", f"M = {report.M}, a = {report.a}, {report.taps} taps"),
        ("arithmetic", report.arithmetic.kind),
        ("result", agree),
        (
            "error",
            f"largest {report.largest_error:.4f}, RMS {report.rms_error:.4f} grey levels "
            f"(bound {report.error_bound:.4f})",
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
