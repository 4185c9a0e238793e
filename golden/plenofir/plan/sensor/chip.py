# SPDX-License-Identifier: Apache-2.0
"""From a calibration to the resampler: its configuration, and the words for its load port."""

from dataclasses import dataclass

from plenofir.camera.calibration import Calibration
from plenofir.camera.resampling import (
    Accuracy,
    GridRegisters,
    Precision,
    Tables,
    grid_registers,
    tables_of,
)
from plenofir.camera.resampling.lines import RingNeeds, reach, ring_needs, ring_needs_shown
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.board_sensor import SENSOR_BLANK_LINES, sensor_delay_lines
from plenofir.plan.sensor.resampler import MAX_LINES, Load, ResamplerConfiguration


@dataclass(frozen=True)
class Resampling:
    """A calibration on the chip."""

    core: ResamplerConfiguration
    registers: GridRegisters
    tables: Tables
    accuracy: Accuracy  # how far registers and tables are from the calibration
    needs: RingNeeds  # raw lines that the calibration needs

    def loads(self) -> list[Load]:
        """Words for the load port."""
        return loads(self.core, self.registers, self.tables)


def resampling(
    calibration: Calibration,
    micro_image_size: int,
    *,
    channels: int = 1,
    pixel_bits: int = 8,
    precision: Precision | None = None,
    devignette: bool = True,
    where: str = "calibration",
) -> Resampling:
    """The smallest resampler for a calibration.

    `channels` and `pixel_bits` are those after the mosaic's interpolation, `where` is the
    calibration's name in messages. The ring holds enough lines for a source without gaps, if any
    number is enough. InputError if the chip cannot follow the grid.
    """
    registers, accuracy = grid_registers(calibration, micro_image_size, precision, where=where)
    tables = tables_of(calibration, registers, devignette=devignette, where=where)
    needs = ring_needs(registers, tables)
    lines = max(needs.full_rate or needs.least + 2, 4)
    lines += lines % 2
    check_ring(lines, f"rows of lenses that drift by {_drift(registers, tables)}", where=where)
    rows, columns = registers.lenses
    bits = registers.precision
    table = tables.moves is not None or tables.lenses is not None
    core = ResamplerConfiguration(
        micro_image_size=micro_image_size,
        hexagonal=registers.layout == "hexagonal-rows",
        skewed=registers.layout == "skewed",
        max_columns=registers.image_shape[1],
        lines=lines,
        lenses=max(rows * columns, 2) if table else 2,
        moves=tables.moves is not None,
        gains=tables.lenses is not None,
        channels=channels,
        pixel_bits=pixel_bits,
        fraction_bits=bits.fraction_bits,
        weight_bits=bits.weight_bits,
        guard_bits=bits.guard_bits,
        gain_bits=bits.gain_bits,
    )
    return Resampling(core, registers, tables, accuracy, needs)


def check_frame(calibration: Calibration, rows: int, columns: int, *, where: str) -> None:
    """Refuse a calibration for frames of another size than the sensor's."""
    if calibration.image_shape != (rows, columns):
        down, across = calibration.image_shape
        raise InputError(
            f"is a calibration for {across} x {down} pixels; the sensor has {columns} x {rows}",
            where=where,
        )


def check_ring(lines: int, cause: str, *, where: str) -> None:
    """Refuse a ring of more than `MAX_LINES` lines; the message says what it is for."""
    if lines > MAX_LINES:
        raise InputError(
            f"{cause} needs a ring of {lines} lines, more than {MAX_LINES}; use less "
            "rotation, or M nearer to the pitch",
            where=where,
        )


def shown_lines(
    registers: GridRegisters, tables: Tables, *, mosaic: bool, where: str = "calibration"
) -> int:
    """Lines of the ring, even, for a raster that is shown under the timing of the raw frames.

    InputError if the raster is larger than the raw frame.
    """
    (height, width), (rows, columns) = registers.image_shape, registers.raster_shape
    if rows > height or columns > width:
        raise InputError(
            f"the raster of {columns} x {rows} pixels is larger than the raw frame of "
            f"{width} x {height}; use a smaller M",
            where=where,
        )
    delay = sensor_delay_lines(registers.micro_image_size, mosaic=mosaic)
    lines = ring_needs_shown(registers, tables, delay_lines=delay, blank_lines=SENSOR_BLANK_LINES)
    return max(lines + lines % 2, 4)


def _drift(registers: GridRegisters, tables: Tables) -> int:
    up, down = reach(registers, tables)
    return down - up


def check_fits(
    core: ResamplerConfiguration,
    registers: GridRegisters,
    tables: Tables,
    *,
    where: str = "calibration",
) -> None:
    """Refuse a calibration that a resampler cannot take, with the limit that it exceeds.

    It may belong to another camera (M, layout, bits), or need more columns, lines or lenses.
    """
    bits, (rows, columns) = registers.precision, registers.lenses
    hexagonal = registers.layout == "hexagonal-rows"
    expected = {
        "micro_image_size": registers.micro_image_size,
        "hexagonal": hexagonal,
        "skewed": registers.layout == "skewed",
        **bits.model_dump(),
    }
    for name, value in expected.items():
        if value != getattr(core, name):
            raise InputError(
                f"has {name} {value}, the resampler {getattr(core, name)}", where=where
            )
    if tables.moves is not None and not core.moves:
        raise InputError(
            "its grid is distorted, which the resampler cannot correct (moves)", where=where
        )
    if tables.lenses is not None and not core.gains:
        raise InputError("has vignetting, which the resampler cannot correct (gains)", where=where)
    table = core.moves or core.gains
    limits = {
        "max_columns": registers.image_shape[1],
        "lines": ring_needs(registers, tables).least,
        "lenses": rows * columns if table else 0,
    }
    for name, value in limits.items():
        if value > getattr(core, name):
            raise InputError(
                f"needs {value} {name}; the resampler has {getattr(core, name)}", where=where
            )


def loads(
    core: ResamplerConfiguration,
    registers: GridRegisters,
    tables: Tables,
    *,
    where: str = "calibration",
) -> list[Load]:
    """Words (kind, address, word) for the load port, tables first; the last one is the commit.

    A calibration that does not fit is refused by `check_fits`.
    """
    check_fits(core, registers, tables, where=where)
    up, down = reach(registers, tables)
    rows, columns = registers.lenses
    even, odd = registers.down
    # Skewed grids have other numbers in the places of hexagonal ones.
    skewed = registers.layout == "skewed"
    place_even, place_odd = registers.line if skewed else registers.place
    values = {
        "lenses": columns << 16 | rows,
        "outputs": registers.outputs,
        "origin_y": registers.origin[0],
        "origin_x": registers.origin[1],
        "right_y": registers.right[0],
        "right_x": registers.right[1],
        "down_even_y": even[0],
        "down_even_x": even[1],
        "down_odd_y": odd[0],
        "down_odd_x": odd[1],
        "reach": (down & 0xFFFF) << 16 | up & 0xFFFF,
        "black": tables.black,
        "place_even": place_even,
        "place_odd": place_odd,
        "step": registers.pixel if skewed else registers.step,
    }
    count = rows * columns
    one = 1 << core.gain_bits
    gains = tables.lenses.ravel().tolist() if tables.lenses is not None else [one] * count
    moves = tables.moves.reshape(-1, 2).tolist() if tables.moves is not None else [(0, 0)] * count
    m = core.micro_image_size
    profile = tables.profile.ravel().tolist() if tables.profile is not None else [one] * (m * m)
    words = []
    if core.gains or core.moves:
        words = core.table_loads(gains, moves, profile if core.gains else [])
    return words + core.register_loads(values)
