# SPDX-License-Identifier: Apache-2.0
"""Raw frames of a sensor through the whole board, serial bits in and out."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plenofir.errors import InputError
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.board_sensor import (
    SENSOR_OUTPUTS,
    SENSOR_PACKAGE,
    BoardSensor,
    sensor_delay_lines,
    sensor_package,
)
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdmi.link import LinkError, decode_frames, encode_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.script import Code, Command, pixel_period, write_script
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.fpga.simulate import chain
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.tools.simulators import SimulationError, Simulator
from plenofir.refocus.operator import Image

# The size of the raster is known with the first frame that is followed; the next one is shown.
_FRAMES_TO_FOLLOW = chain.FRAMES_TO_FOLLOW + 1


@dataclass(frozen=True)
class SensorFrame:
    """A sensor's raw frame, and the board for it."""

    sensor: BoardSensor  # its calibration built in
    raw: Image  # grey or a mosaic, shape (rows, columns), or RGB; uint8

    @property
    def mode(self) -> VideoMode:
        """Timing that the frame comes under."""
        return chain.mode_for(self.sensor.columns, self.sensor.rows)


def _delay_lines(frame: SensorFrame, core: CoreConfiguration, rows: int) -> int:
    """Lines by which the output lags, for a raster of so many rows."""
    own = sensor_delay_lines(core.micro_image_size, mosaic=frame.sensor.red_place is not None)
    return core.delay + own + (frame.sensor.rows - rows + 1) // 2


def check_sensor_chain(frame: SensorFrame, core: CoreConfiguration, board: str) -> None:
    """Refuse what the board's video path cannot carry."""
    chain.check_chain(core, frame.sensor.rows, frame.sensor.columns)
    mode = frame.mode
    chain.range_of(BOARDS[board], mode)
    lines = _delay_lines(frame, core, 0)
    if lines >= mode.v_total:
        raise InputError(
            f"a delay of up to {lines} lines in frames of {mode.v_total} lines, blanking included",
            where="raw",
            expected="a larger raw frame, or a nearer to 1/M",
        )


def run_sensor_chain(
    simulator: Simulator,
    core: CoreConfiguration,
    frame: SensorFrame,
    raster: tuple[int, int],
    directory: Path,
    progress: Callable[[int], None] | None = None,
    board: str = "atlys",
) -> BenchResult:
    """Show a raw frame at the board's input and take what its output shows in the middle.

    The frame comes in all the time; `raster` is rows and columns of the raster. The result has a
    frame for each slice, shape of the raster, three channels.
    """
    sensor, mode, slices = frame.sensor, frame.mode, len(core.shifts)
    pixels = frame.raw if frame.raw.ndim == 3 else np.repeat(frame.raw[..., np.newaxis], 3, axis=2)
    sent = encode_frames(mode, [pixels.astype(np.uint8)])
    delay = _delay_lines(frame, core, raster[0])
    behind = (delay + chain.LINES_BEHIND) * mode.h_total
    words = np.concatenate([sent] * (_FRAMES_TO_FOLLOW + slices) + [np.resize(sent, behind)])
    directory.mkdir(parents=True, exist_ok=True)
    output = directory / "output.bin"
    settled = Command(Code.WAIT, chain.SETTLE_NS)
    write_script(
        directory / "input.bin", [pixel_period(mode), Command(Code.CLOCK, 1), settled, words]
    )
    own = {
        SENSOR_PACKAGE: sensor_package(sensor),
        SCREEN_PACKAGE: screen_package(Screen(outputs=SENSOR_OUTPUTS)),
    }
    for name, text in own.items():
        (directory / f"{name}.vhd").write_text(text)
    sources = [
        directory / source.name if source.stem in own else source
        for source in chain.chain_sources(board)
    ]
    # Channels and the raster's lines stand in sensor_pkg.
    shown_core = core.model_copy(update={"max_columns": sensor.columns})
    generics = {
        **board_generics(shown_core, BOARDS[board].top),
        "AUTO_START": True,
        "SWEEP": slices > 1,
        "METER_WINDOW": chain.METER_WINDOW,
        "CLOCK_RANGE": chain.range_of(BOARDS[board], mode),
    }

    def poll() -> None:
        if progress is not None and output.exists():
            share = min(output.stat().st_size / (4 * words.size), 1)
            progress(int(share * slices * raster[0] * raster[1]))

    models = hdl.model_sources(BOARDS[board].library)
    for command in simulator.build_commands(sources, chain.TOP, models=models):
        simulator.run(command, directory)
    started = time.perf_counter()
    simulator.run(simulator.run_command(chain.TOP, generics, board=True), directory, poll=poll)
    seconds = time.perf_counter() - started

    taken = np.fromfile(output, "<u4")
    # Both signals end at the same time; before the first frame that is shown there is blanking.
    sent_to_end = slices * sent.size + behind
    shown_to_end = sent_to_end - delay * mode.h_total
    try:
        shown = decode_frames(taken[-shown_to_end - mode.h_total :], from_start=True)
    except LinkError as error:
        raise SimulationError(f"no picture at the output: {error}") from None
    wanted = mode.as_measured()
    if len(shown) != slices or any(part.mode != wanted for part in shown):
        found = ", ".join(f"{part.mode.h_active} x {part.mode.v_active}" for part in shown)
        raise SimulationError(f"{slices} frames of {mode.name} expected, found: {found or 'none'}")
    return BenchResult(
        frames=np.stack([_middle(part.pixels, raster) for part in shown]),
        clocks=words.size,
        input_clocks=slices * frame.raw.shape[0] * frame.raw.shape[1],
        latency_clocks=sent_to_end - shown[0].to_end,
        slices=tuple(range(slices)),
        seconds=seconds,
    )


def _middle(shown: Image, raster: tuple[int, int]) -> Image:
    """The picture in the middle; around it everything must be black."""
    top, left = ((a - b) // 2 for a, b in zip(shown.shape, raster, strict=False))
    inside = np.zeros(shown.shape[:2], bool)
    inside[top : top + raster[0], left : left + raster[1]] = True
    if shown[~inside].any():
        y, x = np.argwhere((shown != 0).any(axis=-1) & ~inside)[0]
        raise SimulationError(f"line {y}, column {x} is not black, outside the picture")
    return shown[top : top + raster[0], left : left + raster[1]]
