# SPDX-License-Identifier: Apache-2.0
"""The camera on a board's CSI-2 lanes: ``hdl/path/camera_pkg.vhd``."""

from dataclasses import dataclass
from math import floor

from plenofir.fpga.bitstream.nexus import OSCILLATOR_MHZ, OSCILLATOR_TOLERANCE
from plenofir.fpga.boards import Board, CameraInput
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.csi import settle_clocks, word_pixels
from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.resources.memory import Memory
from plenofir.fpga.sensors import (
    IMX219_LANE_MBITS,
    PAUSE,
    Entry,
    SensorMode,
    imx219,
    imx219_mode,
    registers_text,
)
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.board_sensor import sensor_delay_lines
from plenofir.plan.sensor.scene_lanes import SceneLanes
from plenofir.plan.sensor.scene_sensor import SceneSensor

CAMERA_PACKAGE = "camera_pkg"
"""Name of the VHDL package."""
# Bits of a word between the lanes' clock and the core's, besides its pixels: flags, its last pixel.
_FLAG_BITS = 11


@dataclass(frozen=True)
class BoardCamera:
    """Pixels on a camera's lanes, and the set-up of its sensor."""

    lanes: int = 4
    bits: int = 10  # of a raw pixel
    channels: int = 1  # after interpolation of the mosaic
    buffer_bits: int = 6  # of `csi_receiver`
    settle: int = 10  # of `dphy_lane`
    # Line of the raw frame with which a screen begins its own frame.
    start_line: int = 0
    address: int = 0x10  # on I2C
    registers: tuple[Entry, ...] = ((PAUSE, 0),)


def camera_package(camera: BoardCamera | None = None) -> str:
    camera = camera or BoardCamera()
    values = {
        "CAMERA_LANES": camera.lanes,
        "RAW_BITS": camera.bits,
        "CAMERA_CHANNELS": camera.channels,
        "BUFFER_BITS": camera.buffer_bits,
        "LANE_SETTLE": camera.settle,
        "START_LINE": camera.start_line,
    }
    names = max(map(len, values))
    text = registers_text(camera.registers)
    parts = [f'"{text[place : place + 72]}"' for place in range(0, len(text), 72)]
    head = "  constant SENSOR_REGISTERS : string := "
    lines = [
        "-- The camera whose lanes come in; built by scripts/build_hdl.py from",
        "-- plenofir.plan.sensor.board_camera.",
        "",
        "library ieee;",
        "use ieee.std_logic_1164.all;",
        "",
        f"package {CAMERA_PACKAGE} is",
        "",
        "  -- Lanes; bits of a raw pixel; channels behind the mosaic; BUFFER_BITS of csi_receiver;",
        "  -- SETTLE of dphy_lane; the line of the raw frame at which a screen begins its frame.",
        *(f"  constant {name.ljust(names)} : natural := {v};" for name, v in values.items()),
        "",
        "  -- Generics DEVICE and REGISTERS of sensor_setup.",
        f'  constant SENSOR_ADDRESS : std_logic_vector(6 downto 0) := "{camera.address:07b}";',
        "",
        head + f" &\n{' ' * len(head)}".join(parts) + ";",
        "",
        f"end package {CAMERA_PACKAGE};",
        "",
    ]
    return "\n".join(lines)


@dataclass(frozen=True)
class PlannedCamera:
    """A camera on a board."""

    board: BoardCamera
    lane_mbits: float  # a lane's rate
    frames_per_second: float | None
    needed_mhz: float  # clock that the core needs
    # Slowest clock of the core, and the clock that it is built for: the oscillator has a tolerance.
    clock_mhz: float
    wanted_mhz: float
    clock_divide: int  # generic CLOCK_DIVIDE of a board whose own oscillator makes the clock
    raster: bool  # mosaic and lenses are resampled, with a port for calibrations
    parallel: bool  # the output is parallel video

    @property
    def byte_mhz(self) -> float:
        return self.lane_mbits / 8

    def block_around(self, core: CoreConfiguration) -> Block:
        """Block of the board's top level without raster and core, for the estimate."""
        board, together = self.board, core.pixels_per_clock
        parts = {
            "board": 1,
            "lane bits": 8 * board.lanes,
            "registers": len(board.registers),
            "raster": int(self.raster),
        }
        pixels = word_pixels(board.lanes, board.bits, together)
        last = max((pixels - 1).bit_length(), 1)
        width = pixels * board.bits + last + _FLAG_BITS
        memories = [Memory("words of the lanes", board.buffer_bits, width, 1)]
        if self.parallel:
            words = 2 * max(core.max_columns // together, 2)
            width = together * core.channels * core.pixel_bits + 2
            memories.append(Memory("lines out", (words - 1).bit_length(), width, 1))
        return Block("camera", parts, tuple(memories))

    def check_clock(self, *, where: str) -> None:
        """Refuse a core that needs a faster clock than the board has."""
        if self.needed_mhz > self.clock_mhz:
            raise InputError(
                f"lines need {self.needed_mhz:.4g} MHz; the board has {self.clock_mhz:.4g} MHz; "
                "use smaller frames",
                where=where,
            )


# An IMX219 has two lanes.
_LANES = 2


def _screen_mode(sensor: SceneSensor, board: Board, *, where: str) -> SensorMode:
    """Mode whose lines and frames last as long as those of a board's screen."""
    assert board.camera is not None
    screen = board.camera.screen
    assert screen is not None
    if (sensor.columns, sensor.rows) != (screen.h_active, screen.v_active):
        raise InputError(
            f"{sensor.columns} x {sensor.rows} is no frame that the {board.title} shows of a "
            f"camera; use {screen.h_active} x {screen.v_active}",
            where=where,
        )
    plain = imx219_mode(sensor.columns, sensor.rows)
    line_pixels = round(plain.pixel_rate * screen.h_total / (1e6 * board.camera.screen_mhz))
    return imx219_mode(
        sensor.columns, sensor.rows, line_pixels=line_pixels, frame_lines=screen.v_total
    )


def _clock(board: CameraInput, needed: float) -> tuple[int, float, float]:
    """CLOCK_DIVIDE, and the slowest and fastest clock of a board, for a required clock in MHz."""
    if board.screen is not None:
        return 0, board.screen_mhz, board.screen_mhz
    # At least 2, as the top level's CLOCK_DIVIDE is at least 1.
    divide = max(floor(OSCILLATOR_MHZ / OSCILLATOR_TOLERANCE / needed) - 1, 1)
    clock = OSCILLATOR_MHZ / (divide + 1)
    return divide, clock / OSCILLATOR_TOLERANCE, clock * OSCILLATOR_TOLERANCE


def sensor_camera(
    sensor: SceneSensor,
    core: CoreConfiguration,
    board: Board,
    rate_hz: float | None,
    clock_mhz: float | None,
    *,
    where: str,
) -> PlannedCamera:
    """Camera of a scene's sensor on a board, for a core with a required clock.

    InputError if the sensor has no such frames.
    """
    inputs = board.camera
    assert inputs is not None
    if inputs.screen is not None:
        mode = _screen_mode(sensor, board, where=where)
    else:
        plain = imx219_mode(sensor.columns, sensor.rows)
        lines = None
        if rate_hz is not None:
            lines = round(plain.pixel_rate / (plain.line_pixels * rate_hz))
        mode = imx219_mode(sensor.columns, sensor.rows, frame_lines=lines)
    lane = max(mbits for mbits in IMX219_LANE_MBITS if mbits <= inputs.lane_mbits)
    needed = max(mode.line_rate / 1e6, clock_mhz or 0)
    divide, at_least, fastest = _clock(inputs, needed)
    exposure = sensor.exposure_lines or mode.frame_lines // 2
    return PlannedCamera(
        board=BoardCamera(
            lanes=_LANES,
            bits=sensor.bits,
            channels=core.channels,
            buffer_bits=mode.buffer_bits(1e6 * at_least, sensor.bits),
            settle=settle_clocks(lane),
            start_line=sensor_delay_lines(core.micro_image_size, mosaic=sensor.mosaic is not None)
            + core.delay
            + 2,
            registers=tuple(
                imx219(
                    sensor.columns,
                    sensor.rows,
                    bits=sensor.bits,
                    pattern=sensor.pattern,
                    exposure_lines=exposure,
                    gain=sensor.gain,
                    lane_mbits=lane,
                    mode=mode,
                )
            ),
        ),
        lane_mbits=lane,
        frames_per_second=round(mode.frames_per_second, 2),
        needed_mhz=needed,
        clock_mhz=round(at_least, 2),
        wanted_mhz=round(fastest, 2),
        clock_divide=divide,
        raster=True,
        parallel=inputs.screen is None,
    )


def lanes_camera(
    lanes: SceneLanes,
    registers: tuple[Entry, ...],
    core: CoreConfiguration,
    board: Board,
    rate_hz: float | None,
    needed_mhz: float,
    *,
    where: str,
) -> PlannedCamera:
    """Camera of a scene's lanes on a board, for a core with a required clock.

    InputError if the lanes are too fast for the board's D-PHY, or have more bits than its output.
    """
    inputs = board.camera
    assert inputs is not None
    if lanes.mbits > inputs.lane_mbits:
        raise InputError(
            f"a lane brings {lanes.mbits:g} Mb/s; the {board.title} takes {inputs.lane_mbits:g}",
            where=f"{where}.mbits",
        )
    width = core.pixels_per_clock * core.pixel_bits
    if width > inputs.out_bits:
        raise InputError(
            f"{core.pixels_per_clock} pixels of {core.pixel_bits} bits a clock do not fit the "
            f"{inputs.out_bits} bits that the {board.title} gives out; use slower lanes, or fewer "
            "bits",
            where=where,
        )
    divide, at_least, fastest = _clock(inputs, needed_mhz)
    plain = BoardCamera()
    return PlannedCamera(
        board=BoardCamera(
            lanes=lanes.number,
            bits=core.pixel_bits,
            settle=settle_clocks(lanes.mbits),
            address=lanes.address,
            registers=registers or plain.registers,
        ),
        lane_mbits=lanes.mbits,
        frames_per_second=rate_hz,
        needed_mhz=needed_mhz,
        clock_mhz=round(at_least, 2),
        wanted_mhz=round(fastest, 2),
        clock_divide=divide,
        raster=False,
        parallel=True,
    )
