# SPDX-License-Identifier: Apache-2.0
"""Clocks and video modes of a scene's core: what it needs, and what a device keeps."""

from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.devices import Device
from plenofir.fpga.hdmi.modes import VideoMode, find_mode
from plenofir.ground.errors import InputError
from plenofir.plan.scene import LoadedScene
from plenofir.plan.sensor.board_sensor import SENSOR_BLANK_LINES, sensor_delay_lines


def too_slow(loaded: LoadedScene, core: CoreConfiguration, device: Device) -> str:
    """Why a core on a device does not reach the scene's frame rate; empty if it does."""
    frame, pixels, lanes = loaded.scene.frame, core.pixels_per_clock, loaded.scene.lanes
    needed, kept = clock_of(loaded, core, None)[0], core.kept_mhz(device)
    if loaded.scene.build.path == "video" or needed is None or needed <= kept:
        return ""
    each = "a pixel" if pixels == 1 else f"{pixels} pixels"
    limit = f"cores keep {kept:g} MHz" if kept else "no clock is known for so many"
    size = f"{frame.columns} x {frame.rows}"
    load = size if frame.rate_hz is None else f"{size} at {frame.rate_hz:g} Hz"
    if lanes is not None and needed == lanes.pixels_mhz(frame.bits) / pixels:
        load = f"{lanes.number} x {lanes.mbits:g} Mb/s of {frame.bits} bits"
    return f"{load} needs {needed:.4g} MHz at {each} a clock; on the {device.name.upper()} {limit}"


def misfit(loaded: LoadedScene, core: CoreConfiguration) -> str:
    """Why a core cannot follow the scene's video mode; empty if it can."""
    frame = loaded.scene.frame
    if loaded.scene.build.path != "video" or frame.rate_hz is None:
        return ""
    mode = find_mode(*loaded.video_size, frame.rate_hz)
    clocks, lines = core.band_steps(frame.columns), core.frame_lines(frame.rows)
    if loaded.shown.needs_index:
        clocks = max(clocks, loaded.shown.index(core).band_steps(frame.columns))
    if mode is not None and clocks > mode.h_total:
        return f"lines of {clocks} clocks, the mode has {mode.h_total}"
    if mode is not None and lines > mode.v_total:
        return f"frames of {lines} lines, the mode has {mode.v_total}"
    return ""


def mode_of(loaded: LoadedScene, core: CoreConfiguration) -> VideoMode | None:
    """Video mode of a scene with video in and out, which the core can follow."""
    frame = loaded.scene.frame
    if loaded.scene.build.path != "video":
        return None
    assert frame.rate_hz is not None
    columns, rows = loaded.video_size
    mode = find_mode(columns, rows, frame.rate_hz)
    board = board_of(loaded.scene.build.device)
    assert board is not None
    if mode not in board.modes:
        known = ", ".join(
            f"{m.h_active} x {m.v_active} at {round(m.frame_rate)} Hz" for m in board.modes
        )
        raise InputError(
            f"{columns} x {rows} at {frame.rate_hz:g} Hz is not a mode of the "
            f"{board.title}; use one of {known}",
            where=f"{loaded.path}: frame" if loaded.sensor is None else f"{loaded.path}: sensor",
        )
    # As video_to_stream decides it.
    delay, lines = loaded.shown.delay_pixels(core), loaded.shown.delay_lines(core)
    blank_lines = core.engine.blank_lines(core)
    if (chip := loaded.sensor) is not None:
        blank_lines = max(blank_lines, SENSOR_BLANK_LINES)
        mosaic = chip.mosaic is not None
        # The smallest raster is empty.
        lines += sensor_delay_lines(core.micro_image_size, mosaic=mosaic) + (rows + 1) // 2
    if delay >= mode.h_total or lines >= mode.v_total or blank_lines > mode.v_total - rows:
        raise InputError(
            f"a delay of {lines} lines and {delay} pixels exceeds the mode's "
            f"{mode.v_total} lines of {mode.h_total} pixels, or its blanking; use focus "
            "settings a closer to 1/M, or a larger mode",
            where=f"{loaded.path}: depth",
        )
    return mode


def clock_of(
    loaded: LoadedScene, core: CoreConfiguration, mode: VideoMode | None
) -> tuple[float | None, int]:
    """Pixel clock in MHz and clocks for each frame."""
    frame = loaded.scene.frame
    rate = frame.rate_hz
    if mode is not None:
        return mode.pixel_clock / 1000, mode.h_total * mode.v_total
    # One token per clock on the raster's streams, however many rows the array takes at once.
    tokens = core.line_tokens(frame.columns)
    steps, lines = core.band_steps(frame.columns), core.frame_lines(frame.rows)
    if loaded.shown.needs_index:
        index = loaded.shown.index(core)
        steps = max(steps, index.band_steps(frame.columns))
        lines = max(lines, index.frame_lines(frame.rows))
    clocks = max(tokens, steps) * lines
    if core.parallel_rows > 1:
        clocks = frame.columns * frame.rows
    if loaded.sensor is not None:
        clocks = max(clocks, loaded.sensor.columns * loaded.sensor.rows)
    needed = None if rate is None else clocks * rate / 1e6
    if (lanes := loaded.scene.lanes) is not None:
        # The rate within a line, as no buffer holds a whole line.
        needed = max(needed or 0, lanes.pixels_mhz(frame.bits) / core.pixels_per_clock)
    return needed, clocks
