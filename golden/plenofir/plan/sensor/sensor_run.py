# SPDX-License-Identifier: Apache-2.0
"""A raw capture through mosaic, resampler and refocuser in the VHDL, beside the golden models."""

import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from plenofir.camera.calibration import Calibration, decode, load_calibration
from plenofir.camera.captures.colours import grey_of, order_of_mosaic
from plenofir.camera.captures.fit import fitted
from plenofir.camera.resampling import BayerOrder, interpolate_mosaic, red_place, resample
from plenofir.fpga.compare import compare_frames
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.simulate.report import REPORT, Report, StallReport, agreement
from plenofir.fpga.simulate.request import Progress, Run
from plenofir.fpga.simulate.run import run, watched, waves_in
from plenofir.fpga.simulate.simulations import simulation_of
from plenofir.fpga.simulate.stalls import run_stalled
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.errors import InputError
from plenofir.ground.files import as_text, check_folder, publish_run
from plenofir.ground.images import Picture, read_image, read_picture, write_png
from plenofir.plan.sensor.board_load import Shown, description
from plenofir.plan.sensor.board_sensor import BoardSensor
from plenofir.plan.sensor.chip import Resampling, check_ring, resampling, shown_lines
from plenofir.plan.sensor.focused_frames import difference_from_software, upright
from plenofir.plan.sensor.sensor_bench import run_sensor, wave_signals
from plenofir.plan.sensor.sensor_chain import SensorFrame
from plenofir.plan.sensor.sensor_csi import CsiFrame
from plenofir.refocus.operator import Image

ALIGNED = "aligned.png"


@dataclass(frozen=True)
class Sensor:
    """A raw capture and its calibration."""

    raw: Path
    calib: Path
    capture: Picture
    frame: Image  # the capture, colours interpolated by the model if it is a mosaic
    calibration: Calibration
    bayer: BayerOrder | None  # order of the mosaic
    chip: Resampling  # resampler for it
    notes: tuple[str, ...] = ()  # of the calibration's fit, for people

    @property
    def board_frame(self) -> SensorFrame:
        """The capture as the input of a board that is built for it.

        InputError if it does not have 8 bits, or its raster cannot be shown on a screen.
        """
        chip, where = self.chip, str(self.calib)
        if self.capture.full_scale != 255:
            raise InputError(
                f"has values up to {self.capture.full_scale}; HDMI carries 8 bits",
                where=str(self.raw),
            )
        red = None if self.bayer is None else red_place(self.bayer)
        lines = shown_lines(chip.registers, chip.tables, mosaic=red is not None, where=where)
        check_ring(lines, "a raster shown under the raw frames' timing", where=where)
        core = chip.core.model_copy(update={"lines": lines})
        rows, columns = chip.registers.image_shape
        raster = chip.registers.raster_shape[1]
        limits = Shown(rows, raster, 0 if red is None else 1)
        text = description(core, limits)
        sensor = BoardSensor(core, red, columns, rows, raster, text, tuple(chip.loads()))
        return SensorFrame(sensor, self.capture.pixels)

    def csi_frame(self, lanes: int) -> CsiFrame:
        """The capture as it comes over CSI-2.

        InputError if its pixels do not fit raw packets, or the resampler would have to stop the
        sensor.
        """
        return CsiFrame(
            resampler=self.chip.core,
            loads=tuple(self.chip.loads()),
            red_place=None if self.bayer is None else red_place(self.bayer),
            raw=self.capture.pixels,
            bits=self.capture.full_scale.bit_length(),
            lanes=lanes,
            where=str(self.raw),
        )

    def golden(self) -> Image:
        """Raster of micro images by the bit-true model."""
        return resample(
            self.frame,
            self.chip.registers,
            self.chip.tables,
            full_scale=self.capture.full_scale,
            where=str(self.raw),
        )

    def difference_from_software(self, golden: Image) -> npt.NDArray[np.int64]:
        """Difference of the model's raster from the software's in grey levels."""
        chip = self.chip
        if chip.core.skewed:
            picture = self.capture._replace(pixels=self.frame, mosaic=None)
            return difference_from_software(
                golden, picture, self.calibration, chip.registers, chip.tables
            )
        decoded = decode(
            self.frame,
            self.calibration,
            chip.core.micro_image_size,
            full_scale=self.capture.full_scale,
        )
        return golden.astype(np.int64) - decoded

    def raster(self, pixels: Image) -> Picture:
        """A raster for a file: in linear light, unless the capture says otherwise."""
        return self.capture.like(pixels)._replace(gamma=self.capture.gamma or 1.0)


class SensorReport(BaseModel):
    """What ``report.json`` holds of the resampler, as its field ``sensor``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    calib: str
    bayer: str | None
    columns: int  # of the raster, as `rows`
    rows: int
    pixels_compared: int  # against the bit-true model, as the next two
    mismatches: int
    first_mismatch: str | None
    clocks: int
    clocks_per_raw_pixel: float
    lines: int  # raw lines in the ring; the next two are what the calibration needs
    lines_needed: int
    lines_at_full_rate: int | None
    # How far the resampler's positions are from the calibration's, as the next two.
    distortion_px: float
    rounding_px: float
    turn_px: float
    decode_largest: int  # largest difference from the raster of `decode` in grey levels
    decode_rms: float
    stalls: StallReport | None

    @property
    def agrees(self) -> bool:
        """Whether all pixels equal the model, with stalls too."""
        return not self.mismatches and not (self.stalls and self.stalls.mismatches)


def scaled_to(capture: Picture, bits: int) -> Picture:
    """A capture scaled to a number of bits, rounded."""
    scale = (1 << bits) - 1
    pixels = (2 * capture.pixels.astype(np.int64) * scale + capture.full_scale) // (
        2 * capture.full_scale
    )
    kind = np.uint8 if bits <= 8 else np.uint16
    return capture._replace(pixels=pixels.astype(kind), full_scale=scale)


def load_sensor(
    raw: Path,
    calib: Path,
    micro_image_size: int,
    bayer: BayerOrder | None = None,
    *,
    bits: int | None = None,
) -> Sensor:
    """Read a capture and its calibration, and make a resampler for them.

    A mosaic has one channel; `bits` are what its pixels are scaled to, as a sensor would send
    them. The calibration is moved to where the capture's pixels have the grid. InputError if it
    does not fit them, or the chip cannot follow the grid.
    """
    capture = read_picture(raw, as_stored=True)
    bayer = order_of_mosaic(capture, bayer, str(raw))
    levels = grey_of(capture.pixels, bayer, capture.full_scale)
    fit = fitted(levels, load_calibration(calib), where=str(raw))
    calibration = fit.calibration
    if bits is not None:
        capture = scaled_to(capture, bits)
    frame = capture.pixels
    if bayer is not None:
        frame = interpolate_mosaic(frame, bayer, where=str(raw))
    chip = resampling(
        calibration,
        micro_image_size,
        channels=1 if frame.ndim == 2 else 3,
        pixel_bits=capture.full_scale.bit_length(),
        where=str(calib),
    )
    return Sensor(raw, calib, capture, frame, calibration, bayer, chip, fit.notes)


def run_raw(
    sensor: Sensor,
    golden: Image,
    make_run: Callable[[Path, Path], Run],
    out: Path,
    how: Run,
    frame: SensorFrame | CsiFrame | None = None,
    progress: Progress | None = None,
) -> tuple[Report, SensorReport]:
    """Resample a capture in VHDL, refocus the raster, and compare both with their models.

    `golden` is the raster by the model (`Sensor.golden`); `make_run` makes the request for the
    refocuser from the raster's file and the folder for results, with the simulator, waveforms and
    stalls of `how`, where a seed lets the resampler take the frame again, with stalls. A `frame` is
    simulated through a board, or over CSI-2, which resamples it again. `out` gets the results of
    `plenofir.fpga.simulate.run.run`, and ``aligned.png``; ``report.json`` holds both reports.
    """
    check_folder(out, "out", (ALIGNED, REPORT))
    chip, raw = sensor.chip, sensor.capture.pixels
    simulator = find_simulator(how.simulator)
    pixels = golden.shape[0] * golden.shape[1]
    step = f"VHDL resampler in {simulator.name.upper()}"

    def show(count: int) -> None:
        if progress is not None:
            progress(step, count, pixels)

    with tempfile.TemporaryDirectory(prefix="plenofir-") as name:
        work = Path(name)
        results = work / "results"
        results.mkdir()

        def resample_frame(name: str, percent: int = 0, seed: int = 1) -> BenchResult:
            waves = waves_in(results / name, how, simulator, wave_signals())
            with watched(waves, wave_signals(), out):
                return run_sensor(
                    simulator,
                    chip.core,
                    chip.loads(),
                    raw[np.newaxis],
                    chip.registers.raster_shape,
                    work / "bench",
                    red_place=None if sensor.bayer is None else red_place(sensor.bayer),
                    stall_percent=percent,
                    seed=seed,
                    waves=waves,
                    built=percent > 0,
                    progress=None if percent else show,
                )

        show(0)
        result = resample_frame("aligned")
        show(pixels)
        stalls = None
        if how.stalls:
            stalls = run_stalled(
                how.stalls,
                lambda percent, seed: resample_frame("aligned_stalled", percent, seed),
                lambda result: [(result.frames, golden[np.newaxis])],
            )
        comparison = compare_frames(result.frames, golden[np.newaxis])
        aligned = work / ALIGNED
        write_png(aligned, sensor.raster(result.frames[0]))
        what = make_run(aligned, results)
        report = run(what, progress, simulation_of if frame is None else frame.simulation)
        write_png(results / ALIGNED, sensor.raster(result.frames[0]))
        apart = sensor.difference_from_software(golden)
        if chip.core.skewed:
            for slice_ in report.slices:
                path = results / slice_.pictures[0]
                picture = upright(
                    *(read_image(path), slice_.shift, slice_.box, chip.registers, chip.tables),
                    sensor.capture.full_scale,
                )
                write_png(path.with_stem(f"upright_{path.stem}"), sensor.raster(picture))
        sensor_report = SensorReport(
            calib=as_text(sensor.calib.name),
            bayer=sensor.bayer,
            columns=golden.shape[1],
            rows=golden.shape[0],
            pixels_compared=comparison.pixels,
            mismatches=comparison.mismatches,
            first_mismatch=comparison.first,
            clocks=result.clocks,
            clocks_per_raw_pixel=round(result.input_clocks / (raw.shape[0] * raw.shape[1]), 6),
            lines=(frame or chip.core).lines,
            lines_needed=chip.needs.least,
            lines_at_full_rate=chip.needs.full_rate,
            distortion_px=chip.accuracy.distortion_px,
            rounding_px=chip.accuracy.rounding_px,
            turn_px=chip.accuracy.turn_px,
            decode_largest=int(np.abs(apart).max()),
            decode_rms=float(np.sqrt(np.mean(apart**2.0))),
            stalls=stalls,
        )
        content = json.loads((results / REPORT).read_text(encoding="utf-8"))
        content["raw"] = as_text(sensor.raw.name)
        content["sensor"] = sensor_report.model_dump()
        (results / REPORT).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        publish_run(results, out, REPORT)
    return report, sensor_report


def sensor_summary(sensor: Sensor, report: SensorReport) -> list[tuple[str, str]]:
    """Name and value of each line that is printed of the resampler."""
    rows, columns = sensor.capture.pixels.shape[:2]
    mosaic = "" if report.bayer is None else f", mosaic {report.bayer}"
    agree = agreement(report.pixels_compared, report.mismatches, report.first_mismatch)
    return [
        ("capture", f"{sensor.raw.name}, {columns} x {rows}{mosaic}, {report.calib}"),
        ("aligned", f"{report.columns} x {report.rows}: {agree}"),
        *([] if report.stalls is None else [("stalls", report.stalls.summary)]),
        ("ring", f"{report.lines} raw lines, {report.lines_needed} needed"),
        (
            "decode",
            f"{report.decode_rms:.3f} grey levels (RMS) apart, {report.decode_largest} at most",
        ),
    ]
