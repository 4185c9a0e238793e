# SPDX-License-Identifier: Apache-2.0
"""The sensor whose raw frames a board gets over HDMI: ``hdl/video/sensor_pkg.vhd``."""

from dataclasses import dataclass

from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration

SENSOR_PACKAGE = "sensor_pkg"
"""Name of the VHDL package."""
SENSOR_OUTPUTS = "rm"
"""What a board with a sensor can show: the refocused slice and the micro images."""
SENSOR_BLANK_LINES = 3
"""Lines of vertical blanking that a sensor's frames need, as in ``hdl/video/refocus_video.vhd``."""
CAMERA_LATE_LINES = 4
"""Raw lines by which a screen that waits for a camera may take the raster later than one that
follows a video's timing: its frames begin with a whole line of its own."""
_MARGIN, _MOSAIC_MARGIN = 5, 1


@dataclass(frozen=True)
class BoardSensor:
    """A sensor and the resampler for it."""

    core: ResamplerConfiguration
    # Row and column of the mosaic's first red pixel; None without a mosaic.
    red_place: tuple[int, int] | None
    columns: int  # of a raw frame, as `rows`
    rows: int
    raster_columns: int  # of the longest line of the raster
    description: str  # the board's answer to "l ?"
    # Words of the calibration that is built in; none if it comes over the serial port.
    loads: tuple[Load, ...] = ()


def sensor_delay_lines(micro_image_size: int, *, mosaic: bool) -> int:
    """Lines by which a sensor's picture is late, as in ``hdl/video/picture_pkg.vhd``."""
    return micro_image_size // 2 + _MARGIN + _MOSAIC_MARGIN * mosaic


def sensor_package(sensor: BoardSensor | None = None) -> str:
    core = ResamplerConfiguration(micro_image_size=1) if sensor is None else sensor.core
    red = (0, 0) if sensor is None or sensor.red_place is None else sensor.red_place
    words = [(0, 0, 0)] if sensor is None or not sensor.loads else list(sensor.loads)
    digits = [f'x"{kind << 60 | address << 40 | word:016X}"' for kind, address, word in words]
    values: dict[str, tuple[str, str]] = {
        "WITH_SENSOR": ("boolean", str(sensor is not None).lower()),
        "SENSOR_COLUMNS": ("positive", str(2 if sensor is None else sensor.columns)),
        "SENSOR_ROWS": ("positive", str(2 if sensor is None else sensor.rows)),
        "RASTER_COLUMNS": ("positive", str(1 if sensor is None else sensor.raster_columns)),
        "PIXEL_CHANNELS": ("positive", str(3 if sensor is None else core.channels)),
        "MOSAIC": ("boolean", str(sensor is not None and sensor.red_place is not None).lower()),
        "RED_PLACE": ("natural", str(2 * red[0] + red[1])),
        "HEXAGONAL": ("boolean", str(core.hexagonal).lower()),
        "SKEWED": ("boolean", str(core.skewed).lower()),
        "RING_LINES": ("positive", str(core.lines)),
        "LENSES": ("positive", str(core.lenses)),
        "MOVES": ("boolean", str(core.moves).lower()),
        "GAINS": ("boolean", str(core.gains).lower()),
    }
    names, types = max(map(len, values)), max(len(kind) for kind, _ in values.values())
    constants = [
        f"  constant {name.ljust(names)} : {kind.ljust(types)} := {text};"
        for name, (kind, text) in values.items()
    ]
    text = "" if sensor is None else sensor.description
    built_in = str(sensor is not None and bool(sensor.loads)).lower()
    lines = [
        "-- The sensor whose raw frames come in, if there is one; built by scripts/build_hdl.py",
        "-- from plenofir.plan.sensor.board_sensor.",
        "",
        "library ieee;",
        "use ieee.std_logic_1164.all;",
        "",
        f"package {SENSOR_PACKAGE} is",
        "",
        "  -- Generics of sensor_raster, and the longest line of the raster.",
        *constants,
        "",
        "  -- Answer of load_port to the question for the resampler.",
        f'  constant RESAMPLER : string := "{text}";',
        "",
        "  -- Whether a calibration is built in; words of kind (4 bits), address (20), data (40).",
        f"  constant CALIBRATED : boolean := {built_in};",
        "",
        "  type words_t is array (natural range <>) of std_logic_vector(63 downto 0);",
        "",
        f"  constant CALIBRATION : words_t(0 to {len(words) - 1}) :=",
        "  (",
        ",\n".join(f"    {number} => {word}" for number, word in enumerate(digits)),
        "  );",
        "",
        f"end package {SENSOR_PACKAGE};",
        "",
    ]
    return "\n".join(lines)
