# SPDX-License-Identifier: Apache-2.0
"""Tables for camera builders: sensors on devices, micro lenses that suit a pixel pitch.

And planes of the shipped focused camera.
"""

import tempfile
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from plenofir.camera.design import design
from plenofir.camera.rays import (
    Camera,
    Distances,
    RayModel,
    State,
    load_camera,
    sharpest_type,
    virtual_depth,
)
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.devices import DEVICES
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from table_text import put, table

# M of the sensors' scenes, with slices a fifth apart.
_M = 5
# M and pixels in um of the lenses, behind a main lens of 25 mm.
_PITCHES = ((5, 2.24), (9, 2.24), (13, 1.12), (5, 3.0), (7, 3.0), (11, 3.0))
_F_NUMBER = 5.6
_CORE_MHZ = 100.0
_DEVICES = ("lifcl-40", "lfe5u-25f", "lfe5u-45f", "lfe5u-85f")


@dataclass(frozen=True)
class KnownSensor:
    """A sensor with MIPI CSI-2 at its largest frame, as public drivers run it."""

    name: str
    columns: int
    rows: int
    pixel_um: float
    lanes: int
    lane_mbits: float
    bits: int  # of a raw pixel
    frames_per_second: float
    mosaic: bool
    source: str  # where lanes and rate are from

    @property
    def lane_pixels(self) -> float:
        """Pixels a second that the lanes bring while a line comes."""
        return self.lanes * self.lane_mbits * 1e6 / self.bits

    @property
    def mean_pixels(self) -> float:
        """Pixels a second on average over frames."""
        return self.columns * self.rows * self.frames_per_second

    @property
    def byte_mhz(self) -> float:
        """Clock of the lanes' bytes in MHz."""
        return self.lane_mbits / 8

    def pixels_per_clock(self, core_hz: float) -> int | None:
        """The fewest pixels a clock (1 to 8) with which a core keeps up; None if 8 are too few."""
        # With a margin of a tenth, as blanking is short in the fastest modes.
        needed = min(1.1 * self.mean_pixels, self.lane_pixels)
        return next((n for n in (1, 2, 4, 8) if n * core_hz >= needed), None)


KNOWN_SENSORS = (
    KnownSensor("IMX219", 3280, 2464, 1.12, 2, 912, 10, 15, True, "Linux' imx219.c"),
    KnownSensor("OV5640", 2592, 1944, 1.4, 2, 672, 8, 15, True, "Linux' ov5640.c"),
    KnownSensor("IMX290", 1920, 1080, 2.9, 2, 891, 10, 60, True, "Linux' imx290.c"),
    KnownSensor("IMX290, 4 lanes", 1920, 1080, 2.9, 4, 445.5, 10, 60, True, "Linux' imx290.c"),
    KnownSensor("OV9282", 1280, 800, 3.0, 2, 800, 10, 120, False, "Linux' ov9282.c"),
    KnownSensor("AR0234, mono", 1920, 1200, 3.0, 2, 900, 10, 60, False, "Raspberry Pi's ar0234.c"),
    KnownSensor("IMX477", 4056, 3040, 1.55, 2, 900, 12, 10, True, "Raspberry Pi's imx477.c"),
    KnownSensor(
        "any, 4 x 900 Mb/s", 2592, 1944, 2.2, 4, 900, 10, 65, False, "the most of four such lanes"
    ),
)
"""Lanes, rates and bits as the source has them, and with them the frame rate: IMX219 182.4e6 /
(3448 * 3526); OV5640 its own limit at 168 million pixels; IMX290 148.5e6 / (2200 * 1125); OV9282
160e6 / (1456 * 910); AR0234 180e6 / (2448 * 1220); IMX477 the driver's remark. All of them have
addresses of 16 bits and values of 8, the AR0234 of 16."""


def _scene(sensor: KnownSensor, device: str) -> str:
    mosaic = 'mosaic = "rggb"\n' if sensor.mosaic else ""
    return (
        f'name = "sensor"\n[camera]\nmicro_image_size = {_M}\n'
        f"[sensor]\ncolumns = {sensor.columns}\nrows = {sensor.rows}\nbits = {sensor.bits}\n"
        f"{mosaic}pitch_px = {_M + 0.2}\nrotation_degrees = 0.1\n"
        f'[depth]\nslices = ["-1/{_M}", "0", "1/{_M}"]\n[build]\ndevice = "{device}"\n'
    )


def _fits(sensor: KnownSensor, device: str) -> str:
    """Share of a device's block RAM for mosaic, resampler and core, or what does not fit."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.toml"
        file.write_text(_scene(sensor, device))
        try:
            plan = make_plan(load_scene(file))
        except InputError as error:
            return f"no: {error.problem.partition('it needs ')[2].partition(';')[0]}"
    name = next(n for n in plan.available if "Kbit" in n)
    return f"{100 * plan.needs[name] / plan.available[name]:.0f} %"


def sensors_table() -> list[str]:
    """Sensors with their receivers, cores and devices."""
    ecp5 = BOARDS["ulx3s"].camera
    assert ecp5 is not None
    rows = []
    for sensor in KNOWN_SENSORS:
        pixels = sensor.pixels_per_clock(1e6 * _CORE_MHZ)
        lanes = "yes" if sensor.lane_mbits <= ecp5.lane_mbits else "slower lanes alone"
        rows.append(
            (
                sensor.name,
                f"{sensor.columns} x {sensor.rows}",
                f"{sensor.pixel_um:g}",
                f"{sensor.lanes} x {sensor.lane_mbits:g}",
                f"{sensor.frames_per_second:g}",
                f"{sensor.lane_pixels / 1e6:.0f}",
                f"{sensor.mean_pixels / 1e6:.0f}",
                f"{sensor.byte_mhz:g}",
                pixels or "none",
                lanes,
                *(_fits(sensor, device) for device in _DEVICES),
            )
        )
    heads = (
        "sensor | frame | pixel, um | lanes x Mb/s | frames a second | Mpx/s of the lanes "
        f"| Mpx/s on average | byte clock, MHz | pixels a clock at {_CORE_MHZ:g} MHz | pins of an "
        f"ECP5 | {' | '.join(DEVICES[device].title for device in _DEVICES)}"
    )
    sources = "; ".join(f"{s.name}: {s.source}" for s in KNOWN_SENSORS if s.source)
    return [*table(heads, rows), "", f"Lanes and rates: {sources}."]


def lens_pitches(text: str) -> str:
    """Put the micro lenses that suit a pixel pitch between its marks in a page."""
    rows = []
    for m, pixel_um in _PITCHES:
        pixel = pixel_um / 1000
        columns, rows_px = (640, 480) if pixel_um == 2.24 else (1280, 960)
        content = {
            "name": "camera",
            "main_lens": {"focal_length_mm": 25.0, "entrance_pupil_diameter_mm": 25 / _F_NUMBER},
            "micro_lenses": {"focal_length_mm": _F_NUMBER * m * pixel, "pitch_mm": m * pixel},
            "sensor": {"pixel_pitch_mm": pixel, "columns": columns, "rows": rows_px},
        }
        camera = Camera.model_validate(content)
        designed = design(RayModel.focused(camera, 1000.0, m), 300.0)
        values = {figure.name: figure.value for figure in designed.figures}
        rayleigh = next(f for f in designed.figures if f.name.startswith("rayleigh"))
        rows.append(
            (
                f"{pixel_um:g}",
                m,
                f"{1000 * m * pixel:.1f}",
                f"{1000 * _F_NUMBER * m * pixel:.0f}",
                f"{values['view_columns']} x {values['view_rows']}",
                f"{values['baseline_1_mm']:.2f}",
                f"{rayleigh.value:.1f}",
            )
        )
    heads = (
        "pixel, um | M | pitch of the lenses, um | their focal length, um | a view of "
        "640 x 480 or 1280 x 960 pixels | baseline of views, mm | diffraction of a lens, um"
    )
    return put(text, "lens-pitches", table(heads, rows))


def focused_planes() -> list[str]:
    """Planes of the shipped focused camera, as `plenofir distance` prints them."""
    model = RayModel.focused(load_camera("raytrix-r12"), 463.54174, 23)

    def cell(place: Distances) -> str:
        return f"{place.mm:.4f}" if place.state() is State.REAL else place.state().value

    rows = []
    for setting in ("2/23", "5/46", "3/23", "4/23"):
        a = float(Fraction(setting))
        best = sharpest_type(model, a)
        places = (model.near_border(a), model.distance(a), model.far_border(a))
        rows.append(
            (
                setting,
                *map(cell, places),
                f"{virtual_depth(model, a):.4g}",
                f"{model.box_at(a):.4g}",
                int(best.lens_type) + 1 if best.sharp else "none",
                f"{best.blur_px:.4g}",
            )
        )
    heads = "a | near, mm | distance, mm | far, mm | v | B | lens type | blur, pixels"
    return table(heads, rows)
