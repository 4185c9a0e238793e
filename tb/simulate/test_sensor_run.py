# SPDX-License-Identifier: Apache-2.0
"""Raw captures through mosaic, resampler and refocuser: file bench, command line, bad input."""

import json
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.camera.resampling import (
    BayerOrder,
    Precision,
    interpolate_mosaic,
    red_place,
    resample,
)
from plenofir.fpga import hdl
from plenofir.fpga.synthesis.spartan6 import cell_models, synthesise
from plenofir.fpga.tools.simulators import SimulationError, find_simulator
from plenofir.fpga.tools.synthesis import yosys_version
from plenofir.ground.images import read_image, write_png
from plenofir.plan.sensor.chip import resampling
from plenofir.plan.sensor.sensor_bench import CORE, run_sensor, sensor_generics
from plenofir.refocus import refocus
from plenofir_studies.block_rams import block_ram_models
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name
from plenofir_tb.tools import or_skip

SHAPE = (34, 41)


def camera(layout: str = "rectangular", pitch: float = 5.4) -> Calibration:
    profile = tuple(tuple(1 - 0.1 * abs(k - 1) for k in range(3)) for _ in range(3))
    grid = regular_grid(SHAPE, pitch, rotation_degrees=0.7, layout=layout)  # type: ignore[arg-type]
    changes = {"shading": (-0.1, 0.05, 0.0), "profile": profile, "dark_level": 3.0}
    return calibration_of_grid(grid, SHAPE).model_copy(update=changes)


def capture(shape: tuple[int, ...] = SHAPE) -> np.ndarray:
    return np.random.default_rng(5).integers(0, 256, shape, np.uint8)


@pytest.mark.slow
@pytest.mark.parametrize("stall_percent", [0, 40])
def test_file_bench_equals_the_models(tmp_path: Path, stall_percent: int) -> None:
    chip = resampling(camera("hexagonal-rows"), 4, channels=3)
    raw = capture()
    result = run_sensor(
        find_simulator(simulator_name()),
        chip.core,
        chip.loads(),
        np.stack([raw, raw]),
        chip.registers.raster_shape,
        tmp_path,
        red_place=red_place("gbrg"),
        stall_percent=stall_percent,
    )
    want = resample(interpolate_mosaic(raw, "gbrg"), chip.registers, chip.tables)
    assert (result.frames == want).all()


def test_capture_becomes_a_picture(tmp_path: Path) -> None:
    raw, calib, out = tmp_path / "raw.png", tmp_path / "calib.json", tmp_path / "out"
    write_png(raw, capture())
    camera().save(calib)
    files = "--raw", str(raw), "--calib", str(calib), "--out", str(out)
    done = plenofir(
        *("sim", *files),
        "--micro-image",
        "5",
        "-a",
        "1/5",
        "--engine",
        "moving_sum",
        "--bayer",
        "grbg",
    )
    assert done.returncode == 0, done.stderr
    chip = resampling(camera(), 5, channels=3)
    aligned = read_image(out / "aligned.png")
    want = resample(interpolate_mosaic(capture(), "grbg"), chip.registers, chip.tables)
    assert (aligned == want).all()
    assert (read_image(out / "refocused.png") == refocus(aligned, 5, "1/5")).all()
    report = json.loads((out / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    assert report["raw"] == "raw.png"
    assert report["sensor"]["pixels_compared"] == aligned.shape[0] * aligned.shape[1]


@pytest.mark.slow
def test_wide_hexagonal_mosaic_under_verilator(tmp_path: Path) -> None:
    """Long rows of lenses, for which positions in a row need all their bits."""
    with or_skip():
        find_simulator("verilator")
    shape = (61, 503)
    grid = regular_grid(shape, 8.3, rotation_degrees=0.6, layout="hexagonal-rows")
    profile = tuple(tuple(1 - 0.1 * abs(k - 1) for k in range(3)) for _ in range(3))
    changes = {"shading": (-0.1, 0.05, 0.0), "profile": profile, "dark_level": 3.0}
    calibration = calibration_of_grid(grid, shape).model_copy(update=changes)
    raw, calib, out = tmp_path / "raw.png", tmp_path / "calib.json", tmp_path / "out"
    write_png(raw, capture(shape))
    calibration.save(calib)
    files = "--raw", str(raw), "--calib", str(calib), "--out", str(out)
    options = "--micro-image", "7", "-a", "2/7", "-a", "-1/7", "--bayer", "bggr"
    done = plenofir("sim", *files, *options, "--engine", "moving_sum", "--simulator", "verilator")
    assert done.returncode == 0, done.stderr
    chip = resampling(calibration, 7, channels=3)
    aligned = read_image(out / "aligned.png")
    want = resample(interpolate_mosaic(capture(shape), "bggr"), chip.registers, chip.tables)
    assert (aligned == want).all()
    assert aligned.shape[1] > 400
    report = json.loads((out / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    for slice_ in report["slices"]:
        picture = read_image(out / slice_["pictures"][0])
        assert (picture == refocus(aligned, 7, slice_["a"])).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--bayer", "rggb"], "--bayer requires --calib"),
        (["--calib", "calib.json"], "--calib requires --raw"),
        (["--calib", "{}/calib.json", "--raw", "{}/small.png"], "small.png: has 40 x 34 pixels"),
        (["--calib", "{}/columns.json", "--raw", "{}/raw.png"], "stand in rows"),
        (
            ["--calib", "{}/calib.json", "--raw", "{}/raw.png", "--micro-image", "9", "-a", "0"],
            "at most 6",
        ),
        (
            ["--calib", "{}/calib.json", "--raw", "{}/rgb.png", "--bayer", "rggb"],
            "a mosaic has one channel",
        ),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, arguments: list[str], message: str) -> None:
    camera().save(tmp_path / "calib.json")
    camera("hexagonal-columns").save(tmp_path / "columns.json")
    write_png(tmp_path / "raw.png", capture())
    write_png(tmp_path / "small.png", capture()[:, 1:])
    write_png(tmp_path / "rgb.png", capture((*SHAPE, 3)))
    out = tmp_path / "out"
    done = plenofir("sim", *(a.format(tmp_path) for a in arguments), "--out", str(out))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert message in done.stderr
    assert not out.exists()


@pytest.mark.slow
def test_missing_lines_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sources = plant(
        tmp_path / "sources",
        hdl.hdl_sources(),
        "lens_rows.vhd",
        "when row_index + 1 = signed(",
        "when row_index + 2 = signed(",
    )
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    chip = resampling(camera(), 5)
    with pytest.raises(SimulationError, match="tokens received for"):
        run_sensor(
            find_simulator(simulator_name()),
            chip.core,
            chip.loads(),
            capture()[np.newaxis],
            chip.registers.raster_shape,
            tmp_path / "bench",
        )


@pytest.mark.slow
@pytest.mark.parametrize(("layout", "order"), [("rectangular", None), ("hexagonal-rows", "bggr")])
def test_netlist_equals_the_models(tmp_path: Path, layout: str, order: BayerOrder | None) -> None:
    with or_skip():
        simulator = find_simulator("verilator")
        yosys_version()
    precision = Precision(weight_bits=3, gain_bits=6, guard_bits=1)
    calibration = camera(layout, pitch=9.7)
    chip = resampling(
        calibration, 4, channels=1 if order is None else 3, pixel_bits=4, precision=precision
    )
    generics = sensor_generics(chip.core, mosaic=order is not None)
    netlist = synthesise(hdl.hdl_sources(), CORE, generics, tmp_path)
    cells = tmp_path / "cells.v"
    cells.write_text(f"{cell_models().read_text()}\n{block_ram_models()}")
    raw = capture() // 16
    frame = raw if order is None else interpolate_mosaic(raw, order)
    result = run_sensor(
        simulator,
        chip.core,
        chip.loads(),
        np.stack([raw, raw]),
        chip.registers.raster_shape,
        tmp_path / "bench",
        red_place=None if order is None else red_place(order),
        stall_percent=20,
        verilog=[netlist.verilog, cells],
    )
    want = resample(frame, chip.registers, chip.tables, full_scale=15)
    assert (result.frames == want).all()


LISTENER = """
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
library std;
use std.textio.all;

entity listener is
end entity listener;

architecture test of listener is
  signal clk : std_logic := '0';
  signal reset, write_word, done : std_logic := '1';
  signal kind : std_logic_vector(1 downto 0);
  signal address : std_logic_vector(19 downto 0);
  signal data : std_logic_vector(39 downto 0);
begin
  clk <= not clk after 5 ns when reset = '1' or done = '0' else '0';
  reset <= '0' after 42 ns;
  loader : entity work.calibration_loader
    port map (clk, reset, write_word, kind, address, data, done);
  listen : process (clk) is
    file words : text open write_mode is "words.txt";
    variable word : line;
  begin
    if rising_edge(clk) and reset = '0' and write_word = '1' then
      write(word, to_integer(unsigned(kind)));
      write(word, ' ');
      write(word, to_integer(unsigned(address)));
      write(word, ' ');
      write(word, to_integer(unsigned(data(39 downto 20))));
      write(word, ' ');
      write(word, to_integer(unsigned(data(19 downto 0))));
      writeline(words, word);
    end if;
  end process listen;
end architecture test;
"""


def test_constants_load_what_the_calibration_says(tmp_path: Path) -> None:
    camera().save(tmp_path / "calib.json")
    loader = tmp_path / "calibration_loader.vhd"
    done = plenofir("resampler", "calib.json", "-M", "5", "--out", loader.name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "LINES => " in done.stdout
    bench = tmp_path / "listener.vhd"
    bench.write_text(LISTENER)
    simulator = find_simulator(simulator_name())
    for build in simulator.build_commands([loader, bench], "listener"):
        simulator.run(build, tmp_path)
    simulator.run(simulator.run_command("listener", {}), tmp_path)
    words = [tuple(map(int, line.split())) for line in (tmp_path / "words.txt").open()]
    want = resampling(camera(), 5).loads()
    assert [(kind, place, high << 20 | low) for kind, place, high, low in words] == want
