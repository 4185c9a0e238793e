# SPDX-License-Identifier: Apache-2.0
"""Scenes with a sensor: limits hold for every calibration in them, plans, files, bad input."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.resampling import Tables, grid_registers, tables_of
from plenofir.camera.resampling.lines import ring_needs
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.loaded_scene import LoadedScene
from plenofir.plan.sensor.board_load import calibration_loads, described, description
from plenofir.plan.sensor.chip import check_fits, resampling
from plenofir.plan.sensor.scene_sensor import SceneSensor, sensor_chip
from plenofir_studies.synthetic import regular_grid

SHAPE = (61, 83)
SCENE = """
name = "small"
[camera]
micro_image_size = 5
[sensor]
columns = 83
rows = 61
{sensor}
[frame]
{frame}
[depth]
slices = ["1/5"]
[build]
{build}
"""
LIMITS = "pitch_px = 5.4\nrotation_degrees = 1.0"


def write_scene(folder: Path, sensor: str = LIMITS, frame: str = "", build: str = "") -> Path:
    path = folder / "small.toml"
    path.write_text(SCENE.format(sensor=sensor, frame=frame, build=build))
    return path


def camera(pitch: float = 5.4, layout: str = "rectangular") -> Calibration:
    grid = regular_grid(SHAPE, pitch, rotation_degrees=0.7, layout=layout)  # type: ignore[arg-type]
    changes = {"shading": (-0.1, 0.05, 0.0), "dark_level": 3.0}
    return calibration_of_grid(grid, SHAPE).model_copy(update=changes)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(3, 20),
    st.floats(0, 20),
    st.sampled_from(["rectangular", "hexagonal-rows", "skewed"]),
    st.tuples(st.integers(30, 150), st.integers(30, 150)),
    st.data(),
)
def test_every_calibration_within_the_limits_fits(pitch, rotation, layout, shape, data) -> None:
    m = data.draw(st.integers(1 + (layout == "skewed"), max(int(np.ceil(pitch)), 2)))
    assume(layout == "skewed" or m <= np.ceil(pitch))
    moved = data.draw(st.booleans())
    sensor = SceneSensor(
        columns=shape[1],
        rows=shape[0],
        layout=layout,
        pitch_px=pitch,
        largest_pitch_px=1.5 * pitch,
        rotation_degrees=rotation,
        distortion=moved,
    )
    chip = sensor_chip(sensor, m, "grey", Path("scene.toml"))
    grid = regular_grid(
        shape,
        pitch * data.draw(st.floats(1, 1.5)),
        rotation_degrees=data.draw(st.floats(-rotation, rotation)),
        layout="hexagonal-rows" if layout == "skewed" else layout,
        offset=data.draw(st.tuples(st.floats(-20, 20), st.floats(-20, 20))),
    )
    try:
        calibration = calibration_of_grid(grid, shape)
        if layout == "skewed":
            types = LensTypes(pattern=(0,), sharpest=(0.4,))
            calibration = calibration.model_copy(update={"lens_types": types})
        registers, _ = grid_registers(calibration, m)
    except InputError:
        assume(False)
        raise
    tables = Tables()
    if moved:
        seed = data.draw(st.integers(0, 1 << 32))
        moves = np.random.default_rng(seed).integers(-512, 512, (*registers.lenses, 2))
        tables = Tables(moves=moves)
    if layout == "skewed":
        gains = (np.ones(shape, np.int64) for shape in (registers.lenses, (m, m)))
        tables = Tables(0, tables.moves, *gains)
    check_fits(chip.core, registers, tables)
    assert all(k <= n for k, n in zip(registers.raster_shape, chip.raster, strict=True))
    needs = ring_needs(registers, tables)
    if chip.full_rate:
        assert needs.full_rate is not None
        assert needs.full_rate <= chip.core.lines


def test_a_raster_larger_than_the_raw_frame_is_no_full_rate() -> None:
    # Three rows of lenses of 11 pixels in 30 lines.
    sensor = SceneSensor(columns=55, rows=30, pitch_px=12.0, rotation_degrees=0.0)
    chip = sensor_chip(sensor, 11, "grey", Path("scene.toml"))
    registers, _ = grid_registers(calibration_of_grid(regular_grid((30, 55), 12.0), (30, 55)), 11)
    assert ring_needs(registers).full_rate is None
    assert not chip.full_rate


def test_narrow_frames_have_lines_for_the_latency() -> None:
    # A line of 30 pixels takes less time than a finished line needs to be seen.
    sensor = SceneSensor(columns=30, rows=30, pitch_px=3.0, rotation_degrees=0.0)
    chip = sensor_chip(sensor, 2, "grey", Path("scene.toml"))
    registers, _ = grid_registers(calibration_of_grid(regular_grid((30, 30), 3.0), (30, 30)), 2)
    needs = ring_needs(registers)
    assert chip.full_rate
    assert needs.full_rate is not None
    assert needs.full_rate <= chip.core.lines


def test_calibration_is_built_in(tmp_path: Path) -> None:
    camera().save(tmp_path / "calib.json")
    sensor = 'calibration = "calib.json"\nmosaic = "grbg"\nbits = 10'
    plan = make_plan(load_scene(write_scene(tmp_path, sensor)))
    chip = resampling(camera(), 5, channels=3, pixel_bits=10, devignette=False)
    assert plan.sensor is not None
    assert plan.sensor.core == chip.core
    assert list(plan.sensor.loads) == chip.loads()
    assert (plan.rows, plan.columns) == chip.registers.raster_shape
    assert (plan.core.channels, plan.core.pixel_bits) == (3, 10)
    assert not chip.core.gains
    sources = configure(plan, tmp_path / "out")
    names = [source.name for source in sources]
    assert {"calibration_loader.vhd", "sensor_raster.vhd", "colour_mosaic.vhd"} <= set(names)
    top = (tmp_path / "out" / "scene_top.vhd").read_text()
    assert 'red_place     => "01"' in top
    assert "load_write    : in" not in top
    assert "loads" not in json.loads((tmp_path / "out" / "plan.json").read_text())["sensor"]


def test_limits_leave_the_load_port_open(tmp_path: Path) -> None:
    plan = make_plan(load_scene(write_scene(tmp_path, frame='colour = "rgb"\nrate_hz = 100.0')))
    assert plan.sensor is not None
    assert not plan.sensor.calibrated
    assert not plan.sensor.loads
    # The raw frame has more pixels than the raster's clocks.
    assert plan.frame_clocks == max(83 * 61, plan.columns * plan.rows)
    assert plan.core.pixels_per_clock == 1
    configure(plan, tmp_path / "out")
    top = (tmp_path / "out" / "scene_top.vhd").read_text()
    assert "load_write    : in" in top
    assert "columns       => columns," in top
    without = make_plan(load_scene(write_scene(tmp_path, LIMITS + "\ndistortion = true")))
    assert without.sensor is not None
    assert without.sensor.core.moves
    saved = {part.what: part.saves for part in plan.left_out}
    assert saved["table of lenses for distortion"]
    assert saved["hexagonal grid"]


def test_scene_without_a_sensor_has_nothing_of_it() -> None:
    plan = make_plan(load_scene("grey-microscope"))
    assert plan.sensor is None
    assert not any("vignetting" in part.what for part in plan.left_out)


def test_lytro_scene_takes_all_that_it_has() -> None:
    plan = make_plan(load_scene("lytro1-raw"))
    assert plan.sensor is not None
    assert plan.sensor.core.hexagonal
    assert plan.sensor.full_rate
    # Another rotation or more slices do not fit this device.
    assert plan.needs["block RAM (18 Kbit)"] <= plan.available["block RAM (18 Kbit)"]


@pytest.mark.parametrize(
    ("sensor", "frame", "build", "message"),
    [
        ("", "", "", "sensor: give calibration, or pitch_px and rot"),
        ("pitch_px = 5.4", "", "", "calibration, or pitch_px and rotation_degrees"),
        (f'calibration = "calib.json"\n{LIMITS}', "", "", "not both"),
        ('calibration = "none.json"', "", "", "none.json"),
        (
            'calibration = "wide.json"',
            "",
            "",
            "a calibration for 84 x 61 pixels; the sensor has 83 x 61",
        ),
        (LIMITS, "columns = 80", "", "frame.columns = 80 must be left out"),
        (LIMITS + '\nmosaic = "rggb"', 'colour = "grey"', "", "set frame.colour = 'rgb'"),
        (LIMITS + '\nmosaic = "xggb"', "", "", "sensor.mosaic"),
        ("pitch_px = 4.0\nrotation_degrees = 0.0", "", "", "pitch_px = 4 is too small for M = 5"),
        (LIMITS, "", 'path = "video"', "needs frame.rate_hz"),
        (
            LIMITS,
            "rate_hz = 60.0",
            'path = "video"',
            "83 x 61 at 60 Hz is not a mode of the Digilent",
        ),
        (LIMITS + "\nbits = 10", "rate_hz = 60.0", 'path = "video"', "needs sensor.bits = 8"),
        (LIMITS + "\nlargest_pitch_px = 5.3", "", "", "largest_pitch_px must be at least pitch_px"),
        (
            LIMITS,
            "",
            'path = "video"\n[screen]\noverlay = true',
            "a screen shows refocused and micro images",
        ),
        (LIMITS, "", "pixels_per_clock = 4", "a sensor needs build.pixels_per_clock = 1"),
    ],
)
def test_bad_sensor_is_one_line(tmp_path, sensor, frame, build, message) -> None:
    camera().save(tmp_path / "calib.json")
    wide = (SHAPE[0], SHAPE[1] + 1)
    calibration_of_grid(regular_grid(wide, 5.4), wide).save(tmp_path / "wide.json")
    path = write_scene(tmp_path, sensor, frame, build)
    with pytest.raises(InputError) as caught:
        make_plan(load_scene(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_too_much_rotation_is_refused_by_its_lines(tmp_path: Path) -> None:
    sensor = SceneSensor(columns=8000, rows=100, pitch_px=9.0, rotation_degrees=3.0)
    with pytest.raises(InputError, match=r"a ring of 430 lines, more than 256"):
        sensor_chip(sensor, 5, "grey", tmp_path / "scene.toml")


VIDEO = """
name = "video"
[camera]
micro_image_size = 13
[sensor]
columns = {columns}
rows = {rows}
{sensor}
[frame]
rate_hz = 60.0
[depth]
slices = ["4/13"]
[build]
path = "video"
"""
PITCHES = "pitch_px = 13.85\nlargest_pitch_px = 13.95\nrotation_degrees = 0.7"


def video_camera(pitch: float = 13.889, **moved: tuple[float, float]) -> Calibration:
    shape = 480, 640
    return calibration_of_grid(regular_grid(shape, pitch, rotation_degrees=0.7, **moved), shape)


def test_sensor_with_video_in_and_out(tmp_path: Path) -> None:
    path = tmp_path / "video.toml"
    path.write_text(VIDEO.format(columns=640, rows=480, sensor=PITCHES))
    plan = make_plan(load_scene(path))
    sensor = plan.sensor
    assert sensor is not None
    assert sensor.shown is not None
    assert (plan.core.channels, plan.blanking) == (1, (160, 45))
    # The text that the board answers with says what it takes.
    board = described(description(sensor.core, sensor.shown), where="board")
    for pitch in (13.85, 13.889, 13.95):
        for offset in ((0.0, 0.0), (6.9, 5.0), (-3.3, 2.1)):
            words = calibration_loads(board, video_camera(pitch, offset=offset), where="calib")
            assert len(words) == 16
    wide = calibration_of_grid(regular_grid((481, 640), 13.889), (481, 640))
    with pytest.raises(
        InputError, match="a calibration for 640 x 481 pixels; the sensor has 640 x 480"
    ):
        calibration_loads(board, wide, where="calib")
    with pytest.raises(InputError, match=r"needs \d+ lines of the ring; the board has \d+"):
        calibration_loads(board, video_camera(17.9), where="calib")
    configure(plan, tmp_path / "out")
    package = (tmp_path / "out" / "sensor_pkg.vhd").read_text()
    assert f"constant RING_LINES     : positive := {sensor.lines};" in package
    assert "constant SENSOR_COLUMNS : positive := 640;" in package
    assert "constant CALIBRATED : boolean := false;" in package
    top = (tmp_path / "out" / "atlys_top.vhd").read_text()
    assert re.search(r"MAX_COLUMNS +: positive range 1 to 8192 +:= 640;", top)
    assert 'OUTPUTS          : string  := "rm"' in (tmp_path / "out" / "screen_pkg.vhd").read_text()
    sources = (tmp_path / "out" / "sources.txt").read_text()
    assert "sensor_front.vhd" in sources


def test_calibration_is_built_into_a_board(tmp_path: Path) -> None:
    video_camera().save(tmp_path / "calib.json")
    path = tmp_path / "video.toml"
    path.write_text(VIDEO.format(columns=640, rows=480, sensor='calibration = "calib.json"'))
    plan = make_plan(load_scene(path))
    sensor = plan.sensor
    assert sensor is not None
    assert sensor.calibrated
    configure(plan, tmp_path / "out")
    package = (tmp_path / "out" / "sensor_pkg.vhd").read_text()
    assert "constant CALIBRATED : boolean := true;" in package
    assert f"words_t(0 to {len(sensor.loads) - 1})" in package


@pytest.mark.parametrize(
    ("size", "sensor", "message"),
    [
        # Three channels of the ring of a mosaic; lines of the ring; a raster larger than the frame.
        ((1280, 720), PITCHES + '\nmosaic = "rggb"', "the XC6SLX45 is too small: it needs"),
        ((640, 480), "pitch_px = 30.0\nrotation_degrees = 0.0", "needs a ring of 306 lines"),
        ((640, 480), 'calibration = "tight.json"', "the raster of 637 x 481 pixels is larger"),
    ],
)
def test_too_large_for_a_board_is_refused_by_name(tmp_path, size, sensor, message) -> None:
    video_camera(13.0).save(tmp_path / "tight.json")
    path = tmp_path / "video.toml"
    path.write_text(VIDEO.format(columns=size[0], rows=size[1], sensor=sensor))
    with pytest.raises(InputError) as caught:
        make_plan(load_scene(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def focused_scene(m: int, folder: Path, device: str, slices: tuple[int, ...] = ()) -> LoadedScene:
    """The example of a focused camera with M of another pitch, and fewer slices."""
    text = (project.root() / "examples" / "focused-raw.toml").read_text().replace("23", str(m))
    if slices:
        text = re.sub("slices = .*", f"slices = {[f'{v}/{m}' for v in slices]}", text)
        text = re.sub("box = .*", f"box = {list(slices)}", text)
    (folder / "scene.toml").write_text(text)
    return load_scene(str(folder / "scene.toml"), device)


def test_micro_images_too_large_for_a_device_are_refused_with_its_block_rams(
    tmp_path: Path,
) -> None:
    with pytest.raises(InputError, match=r"LIFCL-40 is too small: it needs 99 of 84 EBR"):
        make_plan(focused_scene(35, tmp_path, "lifcl-40"))
    make_plan(focused_scene(35, tmp_path, "lifcl-40", (2, 3)))


@pytest.mark.parametrize(
    ("device", "m"),
    [
        ("lfe5u-85f", 35),
        ("lifcl-40", 23),
        ("xc6slx45", 35),
        ("xc7a35t", 35),
        ("xczu3eg", 35),
        ("5cseba6", 35),
    ],
)
def test_scene_of_a_focused_camera(tmp_path: Path, device: str, m: int) -> None:
    """It fits six families; a calibration of such a camera fits its resampler."""
    scene = focused_scene(m, tmp_path, device)
    plan = make_plan(scene)
    assert plan.device == device
    assert plan.sensor is not None
    assert plan.sensor.core.skewed
    assert plan.core.slice_boxes == (2, 3, 4)
    grid = regular_grid((900, 1200), m + 0.1, rotation_degrees=0.09, layout="hexagonal-rows")
    types = LensTypes(pattern=(0, 1, 2), sharpest=(0.4, 0.35, 0.3))
    calibration = calibration_of_grid(grid, (900, 1200)).model_copy(update={"lens_types": types})
    registers, _ = grid_registers(calibration, m)
    check_fits(plan.sensor.core, registers, tables_of(calibration, registers))
    assert all(
        k <= n for k, n in zip(registers.raster_shape, (plan.rows, plan.columns), strict=True)
    )
    standard = calibration.model_copy(update={"lens_types": None})
    registers, _ = grid_registers(standard, m)
    with pytest.raises(InputError, match="has hexagonal True, the resampler False"):
        check_fits(plan.sensor.core, registers, tables_of(standard, registers))
