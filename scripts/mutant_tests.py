# SPDX-License-Identifier: Apache-2.0
"""The testbenches for the mutants of a source in `mutate.py`."""

import fnmatch
from pathlib import Path

from mutants import Mutant, hunts_of
from plenofir.fpga import hdl
from plenofir.ground import project

RASTER = "tb/core/test_raster_refocuser.py"
BORDER = "tb/border/test_normalised_border.py"
SUMS = "tb/moving_sum/test_moving_sum_engine.py"
STACK = "tb/stack/test_focal_stack.py"
INDEX = "tb/depth/test_depth_index.py"
RESAMPLER = "tb/resample/test_resampler.py"
SHARPENER = "tb/sharpen/test_lens_sharpener.py"
BOARD = "tb/board/test_board_entities.py"
LINK = "tb/board/test_link_entities.py"
TMDS = "tb/tmds/test_tmds_entities.py"
CHAIN = "tb/hdmi/test_chain.py"
ULX3S = f"{CHAIN}::test_other_boards[ulx3s] -m slow"
# Words in front of a file of tests are variables; here, which of the chain's tests run.
CONTROL = f"COCOTB_TEST_FILTER=commands|focus|pattern|wrong {CHAIN}"
OVERLAY = "tb/overlay/test_text_overlay.py"
VIDEO = "tb/video/test_video.py"
CSI = "tb/csi/test_csi_receiver.py -k test_csi_receiver"
PARALLEL = "tb/video/test_parallel.py"
CAMERAS = "tb/csi/test_camera_boards.py -m slow"
LOADS = "tb/link/test_load_port.py"
# The last rounds: designs of a hunt, and hunts of a source that many build.
HUNTED, HUNTS = 4, 3
HUNT = "tb/hunt/test_hunter.py::test_short_draw[{}]"
REGISTERS = "tb/axi/test_registers.py -k test_registers"
SENSOR_VIDEO = "tb/video/test_sensor_video.py -k raw_aligned"
SENSOR_WAITS = "tb/video/test_sensor_video.py -m slow -k core_far_behind[fir]"
OF_VIDEO = (
    *(f"{VIDEO} -k units", f"{VIDEO} -k blanking", f"{VIDEO} -k refocus_video"),
    *(SENSOR_VIDEO, CHAIN),
)
# Tests for a source's mutants, the first pattern that fits; {} is its entity.
TESTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "moving_sum/sum_lanes_pkg*",
        ("tb/moving_sum/test_moving_sum_schedule.py", f"{SUMS} -k lanes"),
    ),
    ("moving_sum/*_pkg*", ("tb/moving_sum/test_moving_sum_schedule.py", f"{SUMS} -k sets_stalls")),
    (
        "moving_sum/moving_sum_control*",
        (f"{SUMS} -k control", f"{SUMS} -k sets_stalls", f"{SUMS} -k every_slice"),
    ),
    ("moving_sum/lane_*", (f"{SUMS} -k lanes",)),
    ("moving_sum/*_array*", (f"{SUMS} -k sets_stalls", f"{SUMS} -k lanes")),
    ("moving_sum/[abrp]*_[besw]*", (f"{SUMS} -k lanes",)),
    (
        "moving_sum/*",
        (f"{SUMS} -k sets_stalls", f"{SUMS} -k every_slice", f"{STACK} -k stalls_and_faults"),
    ),
    ("core/divide_weighted*", ("tb/core/test_units.py -k {}", f"{BORDER} -k stalls_gaps", BORDER)),
    (
        "core/[nr]*_pkg*",
        (f"{RASTER} -k stalls_gaps", f"{RASTER} -k array_slices", f"{SUMS} -k sets_stalls", STACK),
    ),
    ("border/*", (f"{BORDER} -k stalls_gaps", BORDER)),
    ("refocuser/focal_stack*", (STACK,)),
    ("stack/*", (STACK,)),
    ("depth/*", (INDEX, f"{INDEX} -m slow -k more_indices", f"{VIDEO} -k all_in_focus")),
    ("resample/sensor*", ("tb/simulate/test_sensor_run.py -m slow -k file_bench",)),
    ("resample/*mosaic*", (HUNT.format("colour_mosaic"),)),
    (
        "resample/*",
        (f"{RESAMPLER} -k grids", f"{RESAMPLER} -m slow -k registers_that_change"),
    ),
    ("axi/*_axi*", ("tb/axi/test_bus_driver.py", "tb/axi/test_refocuser_axi.py")),
    ("axi/*", (REGISTERS, "tb/axi/test_refocuser_axi.py", "tb/axi/test_bus_driver.py")),
    ("sharpen/*", (f"{SHARPENER} -k sizes", "tb/core/test_sharpened.py")),
    ("csi/[ds]*", ("tb/csi/test_csi_receiver.py -k {}",)),
    ("csi/*", (CSI,)),
    ("common/crossing*", (CSI,)),
    ("common/gray*", (f"{TMDS} -k elastic_buffer", CSI)),
    ("common/hex*", (OVERLAY, f"{VIDEO} -k all_in_focus")),
    ("common/bus*", ("tb/core/test_units.py -k {}", CHAIN)),
    ("common/event*", (f"{LINK} -k {{}}", CHAIN)),
    ("common/[es]*", (f"{TMDS} -k {{}}", CHAIN)),
    ("common/reset*", (CHAIN,)),
    ("video/stored*", ("tb/video/test_own.py",)),
    ("video/black*", ("tb/video/test_own.py",)),
    ("video/own*", ("tb/hdmi/test_tangnano.py",)),
    ("video/sensor_front*", (SENSOR_VIDEO, SENSOR_WAITS)),
    ("*/camera_r*", (f"{CAMERAS} -k lifcl40", f"{CAMERAS} -k ulx3s")),
    ("video/camera*", (f"{CAMERAS} -k ulx3s",)),
    ("link/[mt]*", ("tb/link/test_monitor.py", CHAIN)),
    ("link/load_crossing*", (f"{LOADS} -k pixel_clock", CONTROL, CHAIN)),
    ("link/load_port*", (HUNT.format("load_port"), f"{LOADS} -k load_port")),
    ("link/i2c_rom_slave*", (HUNT.format("i2c_rom_slave"), CHAIN)),
    ("link/[rs]e*", (f"{LINK} -k hdmi_control", CONTROL, CHAIN)),
    ("link/hdmi_pkg*", (f"{LINK} -k hdmi_control", CONTROL, CHAIN)),
    ("link/[cfl]*", (f"{LINK} -k {{}}", CONTROL, CHAIN)),
    ("serial/i2c_reader*", ("tb/link/test_monitor.py", CHAIN)),
    ("serial/i2c*", ("tb/serial_ports/test_i2c_master.py", "tb/link/test_monitor.py", CHAIN)),
    ("serial/*", (f"{BOARD} -k {{}}", f"{BOARD} -k board_control", CONTROL, CHAIN)),
    ("control/demo*", (f"{BOARD} -k demo_control", "tb/hdmi/test_tangnano.py")),
    ("control/co*", (f"{LINK} -k {{}}", f"{BOARD} -k board_control", CONTROL, CHAIN)),
    ("control/b*", (f"{BOARD} -k {{}}", f"{BOARD} -k board_control", CONTROL, CHAIN)),
    ("board/parallel*", (PARALLEL,)),
    ("control/hdmi_c*", (f"{LINK} -k hdmi_control", CONTROL, CHAIN)),
    ("control/*", (f"{CHAIN} -k two_slices", CONTROL, CHAIN)),
    ("path/*", (f"{CHAIN} -k two_slices", CONTROL, CHAIN)),
    ("board/*", (f"{CHAIN} -k two_slices", CONTROL, CHAIN)),
    ("link/hot*", (f"{BOARD} -k {{}}", CONTROL, CHAIN)),
    ("link/*", (f"{CHAIN} -k two_slices", CONTROL, CHAIN)),
    ("tmds/tmds_pkg*", (TMDS, CHAIN)),
    ("tmds/*", (f"{TMDS} -k {{}}", f"{TMDS} -k receiver", CHAIN)),
    ("spartan6/p[hl]*", (f"{LINK} -k {{}}", CONTROL, CHAIN)),
    ("spartan6/*", (CHAIN,)),
    ("tmds/phase*", (f"{LINK} -k phase_search", ULX3S)),
    ("ecp5/*", (ULX3S,)),
    ("overlay/*", (OVERLAY, CHAIN)),
    ("video/*parallel*", (PARALLEL,)),
    ("video/picture*", (f"{VIDEO} -k blanking", f"{VIDEO} -k all_in_focus", CHAIN)),
    ("video/*", OF_VIDEO),
    ("selftest/*", ("tb/selftest/test_self_test.py",)),
    (
        "*",
        (
            "tb/core/test_units.py -k {}",
            f"{RASTER} -k stalls_gaps",
            f"{RASTER} -k array_slices",
            "tb/fir/test_fir_array.py",
            f"{SUMS} -k sets_stalls",
        ),
    ),
)


def relative(source: Path) -> str:
    """A source, relative to the folder of all sources."""
    return str(source.relative_to(project.root() / "hdl"))


def place_of(mutant: Mutant) -> str:
    """Source of a mutant, relative to the folder of all sources."""
    return relative(next(s for s in hdl.board_sources() if s.name == mutant.file))


def tests_of(place: str) -> tuple[str, ...]:
    """Files of tests that reach a source."""
    return next(tests for pattern, tests in TESTS if fnmatch.fnmatch(place, pattern))


def rounds_of(mutant: Mutant) -> tuple[str, ...]:
    """Files of tests that a mutant is put to, in turn: benches, hunts of its source, the chain."""
    place = place_of(mutant)
    tests = [test.replace("{}", Path(place).stem) for test in tests_of(place)]
    hunts = hunts_of(mutant.file)[:HUNTS]
    tests += [f"DESIGNS={HUNTED} {HUNT.format(name)}" for name in hunts]
    return tuple(sorted(tests, key=lambda test: CHAIN in test))


def is_apart(test: str) -> bool:
    """Whether a round builds by itself, not by the runner: no circuit of it is proved equal."""
    return "tb/hunt" in test or test.startswith(CAMERAS)
