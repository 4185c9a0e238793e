# SPDX-License-Identifier: Apache-2.0
"""Raw frames of a sensor through the whole board, serial bits in and out."""

from dataclasses import dataclass

import numpy as np

from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdmi.link import encode_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.fpga.simulate import chain
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.simulate.request import Run
from plenofir.fpga.simulate.simulations import Place, Simulation
from plenofir.fpga.tools.simulators import SimulationError
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir.plan.sensor.board_sensor import (
    SENSOR_OUTPUTS,
    SENSOR_PACKAGE,
    BoardSensor,
    sensor_delay_lines,
    sensor_package,
)
from plenofir.refocus.operator import Image

# The board knows the size of the raster after the first frame, and shows the next one.
_FRAMES_TO_FOLLOW = chain.FRAMES_TO_FOLLOW + 1


@dataclass(frozen=True)
class SensorFrame:
    """A sensor's raw frame, and the board for it."""

    sensor: BoardSensor  # its calibration built in
    raw: Image  # grey or a mosaic, shape (rows, columns), or RGB; uint8

    @property
    def lines(self) -> int:
        """Raw lines in the resampler's ring."""
        return self.sensor.core.lines

    def simulation(self, request: Run, raster: Picture) -> Simulation:
        """Simulation of this frame; the raw image is its raster by the model."""
        return SensorBoardSimulation(request, raster, self)

    @property
    def mode(self) -> VideoMode:
        return chain.mode_for(self.sensor.columns, self.sensor.rows)

    def delay_lines(self, core: CoreConfiguration, rows: int) -> int:
        """Delay of the output in lines, for a raster with this many rows."""
        mosaic = self.sensor.red_place is not None
        own = sensor_delay_lines(core.micro_image_size, mosaic=mosaic)
        return core.delay + own + (self.sensor.rows - rows + 1) // 2


class SensorBoardSimulation(Simulation):
    """Simulation in which the frame is repeated; its refocused raster is shown in the middle."""

    name = "board"
    wave_signals = chain.WAVE_SIGNALS

    def __init__(self, request: Run, raw: Picture, frame: SensorFrame) -> None:
        """Keep the frame, with its raster by the model as the raw image."""
        super().__init__(request, raw)
        self.frame = frame

    def check(self) -> None:
        """Refuse frames that the board's video path cannot carry."""
        frame, mode = self.frame, self.frame.mode
        chain.check_chain(self.core, frame.sensor.rows, frame.sensor.columns)
        chain.range_of(BOARDS[self.request.board], mode)
        lines = frame.delay_lines(self.core, 0)
        if lines >= mode.v_total:
            raise InputError(
                f"the delay of up to {lines} lines is longer than a frame of {mode.v_total} "
                "lines, blanking included; use a larger raw frame, or focus settings a "
                "closer to 1/M",
                where="raw",
            )

    def run(self, place: Place) -> BenchResult:
        """Show the raw frame at the input and capture the middle of the output."""
        sensor, mode, slices = self.frame.sensor, self.frame.mode, self.frames
        raster, raw = self.raw.shape[:2], self.frame.raw
        pixels = raw if raw.ndim == 3 else np.repeat(raw[..., np.newaxis], 3, axis=2)
        sent = encode_frames(mode, [pixels.astype(np.uint8)])
        delay = self.frame.delay_lines(self.core, raster[0])
        behind = (delay + chain.LINES_BEHIND) * mode.h_total
        words = np.concatenate([sent] * (_FRAMES_TO_FOLLOW + slices) + [np.resize(sent, behind)])
        shown, _, latency, seconds = chain.BoardRun(
            board=self.request.board,
            mode=mode,
            # Channels and the raster's line length are in sensor_pkg.
            core=self.core.model_copy(update={"max_columns": sensor.columns}),
            packages={
                SENSOR_PACKAGE: sensor_package(sensor),
                SCREEN_PACKAGE: screen_package(Screen(outputs=SENSOR_OUTPUTS)),
            },
            script=[words],
            frame_count=slices,
            sweeps=slices > 1,
            delay_pixels=delay * mode.h_total,
            behind=behind,
            progress=chain.in_pixels(place.progress, slices * raster[0] * raster[1]),
        ).run(place.simulator, place.directory, place.waves)
        return BenchResult(
            frames=np.stack([_middle(part.pixels, raster) for part in shown]),
            clocks=words.size,
            input_clocks=slices * raw.shape[0] * raw.shape[1],
            latency_clocks=latency,
            slices=tuple(range(slices)),
            seconds=seconds,
        )


def _middle(picture: Image, raster: tuple[int, ...]) -> Image:
    """The picture in the middle; around it everything must be black."""
    top, left = ((a - b) // 2 for a, b in zip(picture.shape, raster, strict=False))
    inside = np.zeros(picture.shape[:2], bool)
    inside[top : top + raster[0], left : left + raster[1]] = True
    if picture[~inside].any():
        y, x = np.argwhere((picture != 0).any(axis=-1) & ~inside)[0]
        raise SimulationError(f"line {y}, column {x} is not black, outside the picture")
    return picture[top : top + raster[0], left : left + raster[1]]
