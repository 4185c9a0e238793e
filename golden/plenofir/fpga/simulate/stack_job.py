"""A raw image through the VHDL focal stack and its depth index, beside the golden model."""

import tempfile
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from plenofir import project
from plenofir.errors import InputError
from plenofir.files import check_folder, publish_files
from plenofir.fpga.core.configuration import MAX_ROWS, CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.stack import StackEngine
from plenofir.fpga.simulate.job import Progress, picture_names
from plenofir.fpga.simulate.simulators import find_simulator
from plenofir.fpga.simulate.stack_pump import run_stack_pump
from plenofir.images import read_image, write_png
from plenofir.refocus import check_raw, focus_to_shift, shift_to_text
from plenofir.refocus.sharpness import MAX_SHARPNESS_RADIUS, depth_index_picture

ALL_IN_FOCUS = "all_in_focus.png"
DEPTH_INDEX = "depth_index.png"


class StackJob(BaseModel):
    """What to simulate.

    Attributes
    ----------
    raw
        Raw image file.
    micro_image_size
        M in pixels, 2 or more.
    focus
        The slices: fractions whose denominators divide M.
    radius
        See `plenofir.refocus.sharpness.local_sharpness`.
    out
        Folder for the results.
    simulator
        "ghdl", "nvc" or "verilator".
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: Path
    micro_image_size: int
    focus: tuple[str, ...]
    radius: int = 1
    out: Path
    simulator: str = "ghdl"


class StackReport(BaseModel):
    """What ``report.json`` holds.

    Attributes
    ----------
    raw
        Name of the raw image file.
    M
        Micro image size in pixels.
    a, shifts
        Focus setting and a' of each slice.
    pictures
        Files of the slices, of the all-in-focus picture and of the depth index.
    columns, rows, channels, pixel_bits
        Size of the image.
    radius
        Radius of the window that sharpness is judged in.
    micro_images_of_slice
        Number of micro images that are sharpest in each slice.
    pixels_compared
        Pixels of slices, picture and index compared with the bit-true golden model.
    mismatches
        Pixels that differ.
    clocks
        Clocks from the first pixel in to the last pixel out.
    clocks_per_pixel
        Clocks from the first to the last pixel in, for each pixel.
    simulated_clocks_per_second
        Speed of the simulator.
    simulator
        Its version.
    history_bits, slice_bits, waiting_bits, sharpness_bits
        Memory: pixels that the slices share, sums of all slices, lines that wait for their index,
        sharpness.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: str
    M: int
    a: tuple[str, ...]
    shifts: tuple[int, ...]
    pictures: tuple[str, ...]
    columns: int
    rows: int
    channels: int
    pixel_bits: int
    radius: int
    micro_images_of_slice: tuple[int, ...]
    pixels_compared: int
    mismatches: int
    clocks: int
    clocks_per_pixel: float
    simulated_clocks_per_second: int
    simulator: str
    history_bits: int
    slice_bits: int
    waiting_bits: int
    sharpness_bits: int


def run_stack_job(job: StackJob, progress: Progress | None = None) -> StackReport:
    """Refocus a raw image to all slices in one pass of the VHDL, and compare with the golden model.

    Leaves a picture of each slice, ``all_in_focus.png``, ``depth_index.png`` and ``report.json`` in
    ``job.out``. All appear at the end or not at all.

    Parameters
    ----------
    job
        What to simulate.
    progress
        Called as the work goes on.

    Returns
    -------
    StackReport
        What ``report.json`` holds.

    Raises
    ------
    InputError
        If the image, M, a slice, the radius, the folder or the simulator cannot be used.
    plenofir.fpga.simulate.simulators.SimulationError
        If the simulation fails.
    """
    m = job.micro_image_size
    if m < 2:
        raise InputError(f"M = {m} is too small", where="M", expected="2 or more with STACK")
    if not 0 <= job.radius <= MAX_SHARPNESS_RADIUS:
        raise InputError(
            f"{job.radius}", where="WINDOW", expected=f"a radius of 0 to {MAX_SHARPNESS_RADIUS}"
        )
    shifts = tuple(focus_to_shift(focus, m, where="STACK") for focus in job.focus)
    for number, shift in enumerate(shifts):
        if shift in shifts[:number]:
            raise InputError(
                f"{shift_to_text(shift, m)} stands in it twice",
                where="STACK",
                expected="each a once",
            )
    raw = read_image(job.raw)
    check_raw(raw, m, where=str(job.raw))
    rows, columns = raw.shape[:2]
    if rows > MAX_ROWS:
        raise InputError(f"{rows} rows", where=str(job.raw), expected=f"at most {MAX_ROWS} rows")
    engine = StackEngine()
    core = CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=columns,
        channels=1 if raw.ndim == 2 else 3,
        pixel_bits=8 * raw.dtype.itemsize,
        engine=engine,
    )
    core.check_limits()
    index_core = DepthIndexConfiguration(
        micro_image_size=m,
        slices=len(shifts),
        radius=job.radius,
        max_columns=columns,
        channels=core.channels,
        pixel_bits=core.pixel_bits,
    )
    # Two or more: even the only slice has its a in its name.
    names = [picture_names(shift, m, 2)[0] for shift in shifts]
    pictures = [*names, ALL_IN_FOCUS, DEPTH_INDEX]
    check_folder(job.out, "OUT")
    for name in [*pictures, "report.json"]:
        if (job.out / name).is_dir():
            raise InputError(
                f"{job.out / name} is a folder", where="OUT", expected="a file or nothing"
            )
    simulator = find_simulator(job.simulator)

    def tell(step: str, done: int, total: int) -> None:
        if progress is not None:
            progress(step, done, total)

    work_root = project.root() / "build" / "work"
    work_root.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=work_root, prefix="stack-") as work_name:
        work = Path(work_name)
        results = work / "results"
        results.mkdir()
        tell("golden model", 0, 1)
        want_slices = core.golden(raw)
        want = index_core.golden(want_slices)
        tell("golden model", 1, 1)
        step, pixels = f"VHDL stack in {simulator.name.upper()}", rows * columns
        tell(step, 0, pixels)
        result = run_stack_pump(
            simulator,
            core,
            job.radius,
            raw,
            work / "pump",
            progress=lambda done: tell(step, done, pixels),
        )
        tell(step, pixels, pixels)
        slices, image, index = result.slices, result.image, result.index
        want_index = want.index.repeat(m, 0).repeat(m, 1)[:rows, :columns]
        pairs = [*zip(slices, want_slices, strict=True), (image, want.image), (index, want_index)]
        differ = [(got != golden).reshape(rows, columns, -1).any(-1) for got, golden in pairs]
        for name, picture in zip(names, slices, strict=True):
            write_png(results / name, np.ascontiguousarray(picture))
        write_png(results / ALL_IN_FOCUS, image)
        write_png(results / DEPTH_INDEX, depth_index_picture(index, len(shifts)))
        waiting, judged = index_core.memory_bits
        report = StackReport(
            raw=job.raw.name,
            M=m,
            a=tuple(shift_to_text(shift, m) for shift in shifts),
            shifts=shifts,
            pictures=tuple(pictures),
            columns=columns,
            rows=rows,
            channels=core.channels,
            pixel_bits=core.pixel_bits,
            radius=job.radius,
            micro_images_of_slice=tuple(
                int(n) for n in np.bincount(index[::m, ::m].ravel(), minlength=len(shifts))
            ),
            pixels_compared=len(pairs) * pixels,
            mismatches=int(sum(part.sum() for part in differ)),
            clocks=result.clocks,
            clocks_per_pixel=round(result.input_clocks / pixels, 6),
            simulated_clocks_per_second=round(result.clocks / result.seconds),
            simulator=simulator.version,
            history_bits=engine.history_bits(core),
            slice_bits=engine.slice_bits(core),
            waiting_bits=waiting,
            sharpness_bits=judged,
        )
        (results / "report.json").write_text(report.model_dump_json(indent=2) + "\n")
        publish_files(results, job.out)
    return report
