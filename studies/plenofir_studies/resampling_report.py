# SPDX-License-Identifier: Apache-2.0
"""Report: how far the chip's resampler is from `decode`, over fraction bits, pitch and rotation."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from plenofir.camera.calibration import Calibration, calibrate, calibration_of_grid, decode
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.resampling import Precision, grid_registers, resample, tables_of
from plenofir.ground.images import read_image
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image
from plenofir_studies.calibration_report import MICROSCOPE, MICROSCOPE_M
from plenofir_studies.experiments import CAMERA, textures
from plenofir_studies.report_parts import Progress, Report
from plenofir_studies.synthetic import (
    Capture,
    TexturedPlane,
    field_of_view,
    regular_grid,
    render,
    with_pitch,
)

PITCHES = (5.0, 8.31, 13.889, 30.4, 80.0)
ROTATIONS = (-1.0, -0.3, 0.0, 0.3, 1.0)
LAYOUTS = ("rectangular", "hexagonal-rows")
WEIGHT_BITS = (3, 4, 5, 6, 7, 8)
FRACTION_BITS = (8, 10, 12, 14, 16, 17)
SETTINGS = ("-8/13", "0", "4/13", "1")
_SIDE_PX, _FEWEST_LENSES, _DISTANCE_MM = 300.0, 9, 3000.0


@dataclass(frozen=True)
class Difference:
    """Between two pictures, in grey levels."""

    largest: int
    rms: float

    def __str__(self) -> str:
        """Largest / root mean square."""
        return f"{self.largest} / {self.rms:.2f}"


def difference(got: Image, want: Image) -> Difference:
    """How far two pictures are apart."""
    apart = got.astype(np.int64) - want
    return Difference(int(np.abs(apart).max()), float(np.sqrt(np.mean(apart**2.0))))


def rendered(pitch: float, rotation: float, layout: str = "rectangular") -> Capture:
    """Capture of a textured plane in 8 bit; M = the whole part of the pitch."""
    model = with_pitch(RayModel.focused(load_camera(CAMERA), inf, int(pitch)), pitch)
    lenses = max(_FEWEST_LENSES, round(_SIDE_PX / pitch))
    width = field_of_view(model, _DISTANCE_MM, 1.6 * lenses)
    plane = TexturedPlane(textures()[0], _DISTANCE_MM, width)
    return render(
        model,
        [plane],
        (lenses, lenses),
        rotation_degrees=rotation,
        layout=layout,  # type: ignore[arg-type]
        bits=8,
        noise=0.005,
        radius=0.6,
    )


def raster_difference(
    raw: Image, calibration: Calibration, m: int, precision: Precision | None = None
) -> tuple[Difference, float]:
    """Differences of the chip's raster from that of `decode`; errors of pixel positions."""
    registers, accuracy = grid_registers(calibration, m, precision)
    got = resample(raw, registers, tables_of(calibration, registers))
    return difference(got, decode(raw, calibration, m)), accuracy.turn_px


def microscope() -> tuple[Image, Calibration]:
    """The microscope capture, scaled so that its brightest level is 255, and its calibration."""
    raw, white, dark = (read_image(MICROSCOPE / f"{n}.png") for n in ("raw", "white", "dark"))
    calibration = calibrate(white, dark)
    scale = 255 / int(raw.max())
    levels = np.floor(raw * scale + 0.5).astype(np.uint8)
    return levels, calibration.model_copy(update={"dark_level": calibration.dark_level * scale})


def refocused_differences(
    raw: Image, calibration: Calibration, m: int, precision: Precision | None = None
) -> Iterator[tuple[str, Difference]]:
    """Pictures refocused from the chip's raster against those from the raster of `decode`."""
    registers, _ = grid_registers(calibration, m, precision)
    got = resample(raw, registers, tables_of(calibration, registers))
    want = decode(raw, calibration, m)
    for a in SETTINGS:
        setting = a.replace("/13", f"/{m}")
        yield setting, difference(refocus(got, m, setting), refocus(want, m, setting))


def _position_error(bits: int) -> float:
    """Largest distance of a large sensor's centres in the registers from their places."""
    shape = 3280, 3280
    calibration = calibration_of_grid(regular_grid(shape, 10.13, rotation_degrees=0.4), shape)
    _, accuracy = grid_registers(calibration, 10, Precision(fraction_bits=bits))
    return accuracy.rounding_px


def _over_pitch(report: Report, layout: str) -> None:
    report.say(
        f"## Pitch and rotation: {layout}",
        "Rendered captures in 8 bit. Largest and root mean square difference of the raster of "
        "micro images in grey levels; in parentheses how far a pixel at a micro image's corner "
        "is from its place because steps follow the sensor's axes.",
    )
    rows = []
    for pitch in PITCHES:
        m = int(pitch * (0.866 if layout != "rectangular" else 1))
        row = [f"{pitch:g}", str(m)]
        for rotation in ROTATIONS:
            capture = rendered(pitch, rotation, layout)
            calibration = calibration_of_grid(capture.grid, capture.raw.shape[:2])
            apart, turn = raster_difference(capture.raw, calibration, m)
            row.append(f"{apart} ({turn:.2f} px)")
            report.step()
        rows.append(row)
    report.table(["pitch", "M", *(f"{rotation:g} degrees" for rotation in ROTATIONS)], rows)


def _over_weight_bits(report: Report) -> None:
    report.say(
        "## Bits of the weights",
        "The same for pitch 13.889, rotation 0.3 degrees, M = 13 (hexagonal 12).",
    )
    rows: list[list[object]] = []
    for layout, m in zip(LAYOUTS, (13, 12), strict=True):
        capture = rendered(13.889, 0.3, layout)
        calibration = calibration_of_grid(capture.grid, capture.raw.shape[:2])
        rows.append([layout])
        for bits in WEIGHT_BITS:
            precision = Precision(weight_bits=bits)
            rows[-1].append(raster_difference(capture.raw, calibration, m, precision)[0])
            report.step()
    report.table(["layout", *(f"{bits} bit" for bits in WEIGHT_BITS)], rows)


def _over_fraction_bits(report: Report) -> None:
    report.say(
        "## Fraction bits of positions",
        "Largest distance of a centre in the registers from its place, in pixels: a sensor of "
        "3280 x 3280 pixels, pitch 10.13, rotation 0.4 degrees.",
    )
    row = ["error"]
    for bits in FRACTION_BITS:
        row.append(f"{_position_error(bits):.4f}")
        report.step()
    report.table(["bits", *map(str, FRACTION_BITS)], [row])


def _refocused(report: Report) -> None:
    report.say(
        "## Refocused",
        "Largest and root mean square difference of refocused pictures in grey levels of 8 bit.",
    )
    captures = [("microscope", *microscope(), MICROSCOPE_M)]
    for rotation in (0.1, 0.3, 1.0):
        capture = rendered(13.889, rotation)
        calibration = calibration_of_grid(capture.grid, capture.raw.shape[:2])
        captures.append((f"rendered, {rotation:g} degrees", capture.raw, calibration, 13))
    rows = []
    for name, raw, calibration, m in captures:
        differences = refocused_differences(raw, calibration, m)
        rows.append([name, *(apart for _, apart in differences)])
        report.step()
    report.table(["capture", *(f"a = {a}" for a in SETTINGS)], rows)


def write_report(folder: Path, progress: Progress) -> Path:
    steps = len(LAYOUTS) * (len(PITCHES) * len(ROTATIONS) + len(WEIGHT_BITS))
    report = Report(folder, "report.md", steps + len(FRACTION_BITS) + 4, progress)
    report.say("# The chip's resampler beside `plenofir decode`")
    for layout in LAYOUTS:
        _over_pitch(report, layout)
    _over_weight_bits(report)
    _over_fraction_bits(report)
    _refocused(report)
    return report.write()
