# SPDX-License-Identifier: Apache-2.0
"""Raw frames of a sensor as video in, their raster, refocused, in the middle of the video out."""

from typing import Any

import pytest

from plenofir.camera.resampling import BayerOrder
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.runner import Case, run_cases
from plenofir_tb.shown_sensor import ShownCamera, sensor_packages, shown_chip
from plenofir_tb.video import MODE_720, shrunken

TINY = [
    ShownCamera(3.4, 1.5, shape=(22, 40)),
    # Another size of the raster, and the opposite rotation.
    ShownCamera(4.1, -1.0, shape=(22, 40)),
]
# Lines longer than the FIFO after the ring.
WIDE = (36, 160)
EVEN = (44, 72)
# M, shifts, cameras.
Plain = tuple[int, tuple[int, ...], list[ShownCamera]]
SIMPLE: Plain = (3, (2, -1), TINY)
# The core's delay is longer than the gap between frames of the raster, whose lines come more slowly
# than they leave.
FAR_BEHIND: Plain = (3, (50, -1), [ShownCamera(4.05, 0.3, shape=(140, 64))])
SMALL = [ShownCamera(5.4, 0.7), ShownCamera(6.9, -1.0)]


def mode_of(rows: int, columns: int, m: int) -> VideoMode:
    """A small mode for frames of this size, with the blanking that moving sums need."""
    mode = MODE_720 if rows == MODE_720.v_active else shrunken("mini")
    back = max(mode.v_back, m - 1 - mode.v_front - mode.v_sync)
    return mode.model_copy(update={"v_active": rows, "h_active": columns, "v_back": back})


def case(
    m: int,
    shifts: tuple[int, ...],
    cameras: list[ShownCamera],
    *,
    order: BayerOrder | None = None,
    channels: int = 1,
    fewer_lines: int = 0,
    ring: bool = False,
    thorough: bool = False,
    **options: int | bool | str,
) -> Case:
    rows, columns = cameras[0].shape
    chip = shown_chip(m, cameras, mosaic=order is not None, channels=channels)
    generics = {
        "MICRO_IMAGE_SIZE": m,
        "SHIFTS": " ".join(map(str, shifts)),
        "MAX_COLUMNS": columns,
        **options,
    }
    built = chip.model_copy(update={"lines": chip.lines - fewer_lines, "channels": channels})
    packages = sensor_packages(built, cameras[0].shape, order)
    return Case(
        "video_ports",
        "video.sensor_bench",
        generics,
        {
            "m": m,
            "shifts": shifts,
            "cameras": [camera.model_dump() for camera in cameras],
            "core": chip.model_dump(),
            "order": order,
            "fewer_lines": fewer_lines,
            "ring": ring,
            "mode": mode_of(rows, columns, m).model_dump(),
            "thorough": thorough,
        },
        packages,
    )


def test_raw_aligned_and_refocused() -> None:
    run_cases([case(*SIMPLE)], long=True)


@pytest.mark.slow
def test_mosaic() -> None:
    run_cases([case(*SIMPLE, order="grbg", channels=3)])


@pytest.mark.slow
@pytest.mark.parametrize("fewer_lines", [0, 4])
@pytest.mark.parametrize(
    ("m", "camera", "options"),
    [
        # The most lines are held inside a frame.
        (5, ShownCamera(5.4, 0.7, shape=WIDE), {}),
        (5, ShownCamera(6.9, -1.0, shape=WIDE), {}),
        # The most at the beginning of a frame, beside the last ones of the frame before.
        (8, ShownCamera(8.9, -0.1, shape=(36, 400)), {}),
        (4, ShownCamera(5.4, -0.7, "hexagonal-rows", shape=WIDE), {"order": "rggb", "channels": 3}),
    ],
)
def test_lines_of_the_ring(
    m: int, camera: ShownCamera, options: dict[str, Any], fewer_lines: int
) -> None:
    # The number of lines is enough, and at most rounded up: two lines of video to leave the ring,
    # an even number, the FIFO after it.
    run_cases([case(m, (1,), [camera], fewer_lines=fewer_lines, ring=True, **options)])


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["fir", "moving_sum"])
@pytest.mark.parametrize(
    ("m", "shifts", "cameras", "options"),
    [
        (5, (2, -1), SMALL, {"order": "grbg", "channels": 3}),
        (4, (-2, 3), [ShownCamera(5.4, 0.7, "hexagonal-rows")], {"order": "bggr", "channels": 3}),
        (4, (1,), [ShownCamera(5.0, -0.4, "hexagonal-rows", shading=True)], {}),
        (8, (1,), [ShownCamera(8.3, 0.7, shape=EVEN), ShownCamera(8.9, 0.1, shape=EVEN)], {}),
        (13, (2, -1), [ShownCamera(13.889, 0.7, shading=True, shape=(72, 96))], {"channels": 3}),
    ],
)
def test_cameras(
    engine: str, m: int, shifts: tuple[int, ...], cameras: list[ShownCamera], options: dict
) -> None:
    what = case(m, shifts, cameras, thorough=m < 13, ENGINE=engine, **options)
    run_cases([what], long=True)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["fir", "moving_sum"])
def test_core_far_behind(engine: str) -> None:
    run_cases([case(*FAR_BEHIND, ENGINE=engine)])
