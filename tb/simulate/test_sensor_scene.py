# SPDX-License-Identifier: Apache-2.0
"""Scenes with a sensor as one circuit, raw frames in, refocused ones out: VHDL and netlist."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.camera.resampling import interpolate_mosaic, red_place, resample
from plenofir.fpga.synthesis.spartan6 import cell_models, synthesise
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import ghdl_version, write_verilog, yosys_version
from plenofir.plan import Plan, load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.scene_top import TOP
from plenofir.plan.sensor.chip import loads, resampling
from plenofir.plan.sensor.sensor_bench import run_sensor
from plenofir.refocus import refocus
from plenofir_studies.block_rams import block_ram_models
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.tools import or_skip

SHAPE = (34, 41)
M = 4
SCENE = f"""
name = "small"
[camera]
micro_image_size = {M}
[sensor]
columns = {SHAPE[1]}
rows = {SHAPE[0]}
%s
[depth]
slices = ["3/4"]
"""

# A scene's circuit with the ports of the file bench: raw frames, load port, raster.
SHIM = """
module sensor_raster(input clk, input reset, input [15:0] columns, input [15:0] rows,
  input [1:0] red_place, input load_write, input [1:0] load_kind, input [19:0] load_address,
  input [39:0] load_data, input s_axis_tvalid, output s_axis_tready, input [{raw}:0] s_axis_tdata,
  input s_axis_tuser, input s_axis_tlast, output m_axis_tvalid, input m_axis_tready,
  output [{pixel}:0] m_axis_tdata, output m_axis_tuser, output m_axis_tlast,
  output [5:0] error_flags, input error_clear);
  wire [5:0] sensor_flags;
  wire [4:0] core_flags;
  assign error_flags = sensor_flags | core_flags;
  scene_top scene(.clk(clk), .reset(reset), {load}.sensor_flags(sensor_flags),
    .s_axis_tvalid(s_axis_tvalid), .s_axis_tready(s_axis_tready), .s_axis_tdata(s_axis_tdata),
    .s_axis_tuser(s_axis_tuser), .s_axis_tlast(s_axis_tlast), .m_axis_tvalid(m_axis_tvalid),
    .m_axis_tready(m_axis_tready), .m_axis_tdata(m_axis_tdata), .m_axis_tuser(m_axis_tuser),
    .m_axis_tlast(m_axis_tlast), .error_flags(core_flags), .error_clear(error_clear));
endmodule
"""
LOAD = (
    ".columns(16'd{columns}), .rows(16'd{rows}), .load_write(load_write), .load_kind(load_kind), "
    ".load_address(load_address), .load_data(load_data), "
)


def camera(layout: str = "rectangular") -> Calibration:
    grid = regular_grid(SHAPE, 5.4, rotation_degrees=0.7, layout=layout)  # type: ignore[arg-type]
    return calibration_of_grid(grid, SHAPE).model_copy(update={"dark_level": 3.0})


def plan_of(folder: Path, sensor: str) -> Plan:
    camera().save(folder / "calib.json")
    path = folder / "small.toml"
    path.write_text(SCENE % sensor)
    return make_plan(load_scene(path))


@pytest.fixture(scope="module", autouse=True)
def tools() -> None:
    with or_skip():
        find_simulator("verilator")
        ghdl_version()
        yosys_version()


def frames_through(
    plan: Plan, calibration: Calibration, folder: Path, *, netlist: bool
) -> np.ndarray:
    """Pass two frames through a scene's circuit, and compare them with the models."""
    assert plan.sensor is not None
    sensor = plan.sensor
    sources = configure(plan, folder / "project")
    work = folder / "work"
    work.mkdir()
    chip = resampling(calibration, M, channels=sensor.core.channels, devignette=sensor.core.gains)
    rows, columns = chip.registers.raster_shape
    load = "" if sensor.calibrated else LOAD.format(columns=columns, rows=rows)
    channels = sensor.core.channels
    raw_channels = channels if sensor.mosaic is None else 1
    shim = work / "shim.v"
    shim.write_text(SHIM.format(raw=8 * raw_channels - 1, pixel=8 * channels - 1, load=load))
    if netlist:
        cells = work / "cells.v"
        cells.write_text(f"{cell_models().read_text()}\n{block_ram_models()}")
        files = [synthesise(sources, TOP, {}, work).verilog, cells]
    else:
        files = [write_verilog(sources, TOP, {}, work)]
    raw = np.random.default_rng(5).integers(0, 256, SHAPE, np.uint8)
    result = run_sensor(
        find_simulator("verilator"),
        sensor.core,
        [] if sensor.calibrated else loads(sensor.core, chip.registers, chip.tables),
        np.stack([raw, raw[::-1]]),
        (rows, columns),
        work / "bench",
        red_place=None if sensor.mosaic is None else red_place(sensor.mosaic),
        stall_percent=20,
        verilog=[shim, *files],
    )
    for frame, got in zip((raw, raw[::-1]), result.frames, strict=True):
        colours = frame if sensor.mosaic is None else interpolate_mosaic(frame, sensor.mosaic)
        aligned = resample(colours, chip.registers, chip.tables)
        assert (got == refocus(aligned, M, "3/4")).all()
    return result.frames


@pytest.mark.slow
def test_scene_with_its_calibration(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, 'calibration = "calib.json"')
    frames_through(plan, camera(), tmp_path, netlist=False)


def test_top_is_taken_by_synthesis(tmp_path: Path) -> None:
    limits = 'mosaic = "grbg"\npitch_px = 5.0\nrotation_degrees = 1.0'
    for number, sensor in enumerate(('calibration = "calib.json"', limits)):
        folder = tmp_path / str(number)
        folder.mkdir()
        sources = configure(plan_of(folder, sensor), folder / "project")
        (folder / "work").mkdir()
        text = write_verilog(sources, TOP, {}, folder / "work").read_text()
        assert f"module {TOP}" in text
        ports = text[text.index(f"module {TOP}") :].split(";", 1)[0]
        assert ("load_write" in ports) == (number == 1)


@pytest.mark.slow
def test_netlist_of_sensor_and_core_with_a_loaded_calibration(tmp_path: Path) -> None:
    limits = 'mosaic = "grbg"\nlayout = "hexagonal-rows"\npitch_px = 5.0\nrotation_degrees = 1.0'
    plan = plan_of(tmp_path, limits)
    frames_through(plan, camera("hexagonal-rows"), tmp_path, netlist=True)
