# SPDX-License-Identifier: Apache-2.0
"""Boards with a camera, from its wires to the picture: every pixel equals the golden models."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.resampling import interpolate_mosaic, red_place, resample
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import camera_generics
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.csi import frame_packets, settle_clocks
from plenofir.fpga.hdmi.link import decode_frames
from plenofir.ground import project
from plenofir.plan.configure import needed_sources
from plenofir.plan.sensor.board_camera import CAMERA_PACKAGE, BoardCamera, camera_package
from plenofir.plan.sensor.board_load import description
from plenofir.plan.sensor.board_sensor import (
    CAMERA_LATE_LINES,
    SENSOR_PACKAGE,
    BoardSensor,
    sensor_delay_lines,
    sensor_package,
)
from plenofir.plan.sensor.chip import resampling, shown_lines
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.camera_wires import wire_words
from plenofir_tb.runner import draw_seed, vhdl_simulator

M, MOSAIC = 4, "grbg"


@dataclass(frozen=True)
class Scene:
    """A sensor's frame, the board's configuration, and the raster by the model."""

    raw: np.ndarray
    sensor: BoardSensor | None  # None: the frame is the raster
    core: CoreConfiguration
    raster: np.ndarray


def scene(shape: tuple[int, int], bits: int, *, on_screen: bool = False) -> Scene:
    """A frame of noise with a mosaic; its calibration is built in."""
    seed = draw_seed()
    print(f"seed {seed}")
    raw = np.random.default_rng(seed).integers(0, 1 << bits, shape, np.uint16)
    calibration = calibration_of_grid(regular_grid(shape, 5.4, rotation_degrees=0.7), shape)
    chip = resampling(calibration, M, channels=3, pixel_bits=bits, where="calibration")
    if on_screen:
        lines = shown_lines(chip.registers, chip.tables, mosaic=True, where="calibration")
        lines += CAMERA_LATE_LINES
        chip = replace(chip, core=chip.core.model_copy(update={"lines": lines}))
    full_scale = (1 << bits) - 1
    raster = resample(
        interpolate_mosaic(raw, MOSAIC, where="raw"),
        chip.registers,
        chip.tables,
        full_scale=full_scale,
        where="raw",
    )
    sensor = BoardSensor(
        chip.core,
        red_place(MOSAIC),
        shape[1],
        shape[0],
        raster.shape[1],
        description(chip.core),
        tuple(chip.loads()),
    )
    core = CoreConfiguration(
        micro_image_size=M,
        shifts=(1, -1),
        boxes=(3, 2),
        max_columns=raster.shape[1],
        channels=3,
        pixel_bits=bits,
        engine=MovingSumEngine(),
    )
    return Scene(raw, sensor, core, raster)


def simulate(
    folder: Path, board: str, bench: str, what: Scene, camera: BoardCamera, **generics: int | bool
) -> None:
    """Run a board's bench with the packages of its configuration."""
    files = project.root() / "tb" / "file_bench"
    benches = [files / f"{name}.vhd" for name in ("dphy_camera", "tmds_monitor", bench)]
    row = BOARDS[board]
    assert row.camera is not None
    packages = {CAMERA_PACKAGE: camera_package(camera)}
    if what.sensor is not None:
        packages[SENSOR_PACKAGE] = sensor_package(what.sensor)
    text = "".join(path.read_text() for path in benches)
    sources = needed_sources(text, bench, hdl.board_sources(board))
    own = {k: v for k, v in camera_generics(what.core, row.camera.top).items()}
    vhdl_simulator(brief=False).simulate(
        [*hdl.with_packages(sources, packages, folder), *benches],
        bench,
        {**own, **generics},
        folder,
        models=hdl.model_sources(row.library),
    )


@pytest.mark.slow
@pytest.mark.counted
@pytest.mark.parametrize(
    ("number", "mbits", "continuous", "skew"), [(0, 400, False, 0), (1, 912, True, 3)]
)
def test_lifcl40_from_the_wires(
    tmp_path: Path, number: int, mbits: int, *, continuous: bool, skew: int
) -> None:
    bits, frames = 10, 2
    what = scene((34, 44), bits)
    packets = [
        packet
        for frame in range(frames)
        for packet in frame_packets(what.raw, bits, number=frame + 1)
    ]
    # A line in 2.5 us; between frames the core's time for its last lines.
    per_frame, blank = len(packets) // frames, 12
    places = [n + blank * (n // per_frame) for n in range(len(packets))]
    starts = [(1 + place) * 2500 * mbits // 1000 for place in places]
    wire_words(packets, starts=starts).tofile(tmp_path / "input.bin")
    camera = BoardCamera(lanes=2, bits=bits, channels=3, buffer_bits=6, settle=settle_clocks(mbits))
    simulate(
        tmp_path,
        "lifcl40",
        "lifcl40_bench",
        what,
        camera,
        SLICE=number,
        BIT_PS=2 * round(5e5 / mbits),
        CONTINUOUS=continuous,
        SKEW=skew,
        PIXELS=frames * what.raster.shape[0] * what.raster.shape[1],
    )
    words = np.fromfile(tmp_path / "output.bin", "<i4")
    assert (words < 0).sum() == frames
    pixels = words[words >= 0].reshape(frames, *what.raster.shape[:2])
    got = np.stack([pixels >> bits * c & (1 << bits) - 1 for c in range(3)], axis=-1)
    wanted = what.core.golden(what.raster)[number]
    for frame in got:
        assert np.array_equal(frame, wanted)


@pytest.mark.slow
@pytest.mark.counted
def test_lifcl40_with_four_lanes_and_four_pixels_a_clock(tmp_path: Path) -> None:
    """Frames that already are the raster, 360 million pixels a second during a line."""
    bits, frames, mbits, shape = 10, 2, 900, (30, 40)
    seed = draw_seed()
    print(f"seed {seed}")
    raw = np.random.default_rng(seed).integers(0, 1 << bits, shape, np.uint16)
    engine = MovingSumEngine(pixels_per_clock=4)
    core = CoreConfiguration(
        micro_image_size=5,
        shifts=(2, -2),
        boxes=(3, 1),
        max_columns=shape[1],
        pixel_bits=bits,
        engine=engine,
    )
    sent = [frame_packets(raw, bits, number=frame + 1) for frame in range(frames)]
    # A line in 1.5 us; between frames the core's time for its last lines.
    line, blank = 1500 * mbits // 1000, 16
    packets = [packet for packets in sent for packet in packets]
    starts = [(1 + n + blank * (n // len(sent[0]))) * line for n in range(len(packets))]
    wire_words(packets, starts=starts).tofile(tmp_path / "input.bin")
    simulate(
        tmp_path,
        "lifcl40",
        "lifcl40_bench",
        Scene(raw, None, core, raw),
        BoardCamera(lanes=4, bits=bits, settle=settle_clocks(mbits)),
        ROWS=shape[0],
        SLICE=1,
        BIT_PS=2 * round(5e5 / mbits),
        CONTINUOUS=False,
        SKEW=2,
        PIXELS=frames * raw.size,
    )
    words = np.fromfile(tmp_path / "output.bin", "<i4")
    assert (words < 0).sum() == frames
    for frame in words[words >= 0].reshape(frames, *shape):
        assert np.array_equal(frame, core.golden(raw)[1])


@pytest.mark.slow
@pytest.mark.counted
def test_ulx3s_from_the_wires_to_serial_bits(tmp_path: Path) -> None:
    shape, bits, mbits = (42, 60), 8, 456
    what = scene(shape, bits, on_screen=True)
    parts = {"H_ACTIVE": 60, "H_FRONT": 10, "H_SYNC": 20, "H_BACK": 30}
    parts |= {"V_ACTIVE": 42, "V_FRONT": 1, "V_SYNC": 2, "V_BACK": 5}
    line, lines, frames = sum(list(parts.values())[:4]), sum(list(parts.values())[4:]), 7
    ui = 2 * round(5e5 / mbits)
    # The camera's lines are 0.03 % longer than the screen's, its frames a quarter of a line more.
    line_bits = round(1.0003 * line * 40_000 / ui)
    starts, packets = [], []
    for frame in range(frames):
        sent = frame_packets(what.raw, bits, number=frame + 1)
        begin = 1000 + frame * (lines * line_bits + line_bits // 4)
        starts += [begin + n * line_bits for n in range(len(sent))]
        packets += sent
    wire_words(packets, starts=starts).tofile(tmp_path / "input.bin")
    start = sensor_delay_lines(M, mosaic=True) + what.core.delay + 2
    camera = BoardCamera(
        lanes=2,
        bits=bits,
        channels=3,
        buffer_bits=7,
        settle=settle_clocks(mbits),
        start_line=start,
    )
    simulate(
        tmp_path,
        "ulx3s",
        "ulx3s_camera_bench",
        what,
        camera,
        **{f"PATTERN_{name}": value for name, value in parts.items()},
        BIT_PS=ui,
        WORDS=frames * lines * line,
    )
    shown = decode_frames(np.fromfile(tmp_path / "output.bin", "<u4"))
    rows, columns = what.raster.shape[:2]
    top, left = (shape[0] - rows) // 2, (shape[1] - columns) // 2
    around = ((top, shape[0] - rows - top), (left, shape[1] - columns - left), (0, 0))
    wanted = [np.pad(picture, around) for picture in what.core.golden(what.raster)]
    found = [
        [n for n, want in enumerate(wanted) if np.array_equal(frame.pixels, want)]
        for frame in shown
    ]
    pictures = [numbers for frame, numbers in zip(shown, found, strict=True) if frame.pixels.any()]
    # From the first one on, all frames are slices, swept up and down.
    assert len(pictures) >= 4
    assert all(pictures)
    assert {n for numbers in pictures for n in numbers} == {0, 1}
