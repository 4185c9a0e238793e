# SPDX-License-Identifier: Apache-2.0
"""One core behind a bus: its description and its control."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from plenofir.driver.registers import (
    IDENTIFICATION_VALUE,
    MAP_NUMBER,
    Access,
    Registers,
)
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.camera.calibration import Calibration
    from plenofir.camera.rays import RayModel

Event = Literal["frame_in", "frame_out", "error"]
# A frame lasts 17 ms at 60 Hz: a poll each ms misses none and leaves the bus to others.
_POLL_S = 0.001


@dataclass(frozen=True)
class Description:
    """Configuration of a core, from its registers."""

    release: tuple[int, int, int]  # of plenofir
    parts: frozenset[str]  # refocuser, stack, depth_index, resampler, mosaic
    micro_image_size: int  # M in pixels
    shifts: tuple[int, ...]  # a' of each slice in pixels
    sharpening: tuple[int, ...]  # weight of each slice in 64ths
    boxes: tuple[int, ...]  # samples B that an output of each slice averages along a dimension
    channels: int
    pixel_bits: int
    pixels_per_clock: int
    max_columns: int
    parallel_rows: int
    # Values of the registers `engine`, `sharpness`, `confidence`, `resampler` and `lenses`, by
    # "register.field"; without those of parts that the core does not have.
    details: dict[str, int]

    @property
    def settings(self) -> tuple[Fraction, ...]:
        """Focus setting a = a' / M of each slice."""
        return tuple(Fraction(shift, self.micro_image_size) for shift in self.shifts)


@dataclass(frozen=True)
class Counters:
    """Counters since the last restart, modulo 2**32."""

    frames_in: int
    frames_out: int
    lines_in: int
    lines_out: int
    stalls_in: int  # clocks in which the source had to wait
    stalls_out: int  # clocks in which the core had to wait
    dropped: int  # transfers that belong to no frame


class Core:
    """A core behind a bus; its access reads and writes words of 32 bits.

    If the access has a method ``wait(timeout_s) -> bool`` (`plenofir.driver.Uio`), interrupts are
    used; otherwise the registers are polled every `pause` seconds. InputError if there is no core,
    or one with another register map.
    """

    def __init__(self, access: Access, *, pause: Callable[[float], object] = time.sleep) -> None:
        self.registers = Registers(access)
        self._access = access
        self._pause = pause
        first = self.registers.read_identification()
        if first != IDENTIFICATION_VALUE:
            raise InputError(
                f"the first word reads as {first:#010x}, not {IDENTIFICATION_VALUE:#010x}; "
                "is this the core's address?",
                where="core",
            )
        version = self.registers.read_version()
        if version.map != MAP_NUMBER:
            raise InputError(
                f"has register map {version.map}, this driver knows {MAP_NUMBER}; take the "
                f"driver of plenofir {version.major}.{version.minor}",
                where="core",
            )
        self.description = self._describe()

    def _describe(self) -> Description:
        registers = self.registers
        version, geometry = registers.read_version(), registers.read_geometry()
        limits, flags = registers.read_limits(), registers.read_parts()
        parts = frozenset(name for name, bit in flags._asdict().items() if bit)
        details: dict[str, int] = {}
        slices = []
        if parts & {"refocuser", "stack"}:
            engine = registers.read_engine()._asdict()
            details |= {f"engine.{name}": value for name, value in engine.items()}
            # One register shows the slice that is asked for: the map of registers fits any number
            # of slices.
            for number in range(geometry.slices):
                registers.write_asked_slice(number)
                slices.append(registers.read_slice_shift())
        if "depth_index" in parts:
            sharpness = registers.read_sharpness()._asdict()
            details |= {f"sharpness.{name}": value for name, value in sharpness.items()}
            details["confidence.level"] = registers.read_confidence()
        if "resampler" in parts:
            resampler = registers.read_resampler()._asdict()
            details |= {f"resampler.{name}": value for name, value in resampler.items()}
            details["lenses.count"] = registers.read_lenses()
        return Description(
            release=(version.major, version.minor, version.patch),
            parts=parts,
            micro_image_size=geometry.micro_image_size,
            shifts=tuple(record.shift for record in slices),
            sharpening=tuple(record.sharpening for record in slices),
            boxes=tuple(record.box or geometry.micro_image_size for record in slices),
            channels=geometry.channels,
            pixel_bits=geometry.pixel_bits,
            pixels_per_clock=geometry.pixels_per_clock,
            max_columns=limits.max_columns,
            parallel_rows=limits.parallel_rows,
            details=details,
        )

    def _need(self, part: str) -> None:
        # An access to a register that does not exist may hang a processor.
        if part not in self.description.parts:
            there = ", ".join(sorted(self.description.parts))
            raise InputError(f"was built without a {part}; it has {there}", where="core")

    # ---- frames

    @property
    def frame_size(self) -> tuple[int, int]:
        """Columns and rows of the frames that come in; 0 until they are set."""
        size = self.registers.read_frame_size()
        return size.columns, size.rows

    def set_frame_size(self, columns: int, rows: int, *, timeout_s: float = 1.0) -> None:
        """Set the size of the frames that come in; restarts the core, which stays off or on.

        What is inside comes out first, or is lost after the time. InputError if the core cannot
        take such frames, or does not keep the size.
        """
        most = self.description.max_columns
        if not 1 <= columns <= most or not 1 <= rows <= 0xFFFF:
            raise InputError(
                f"frames of {columns} x {rows} pixels are not possible; use 1 to {most} "
                "columns and 1 to 65535 rows",
                where="core",
            )
        control = self.registers.read_control()
        if control.enable:
            self.disable()
            self.drain(timeout_s)
        self.registers.write_frame_size(columns=columns, rows=rows)
        if self.frame_size != (columns, rows):
            raise InputError(
                f"refuses frames of {columns} x {rows} pixels; is other software using it?",
                where="core",
            )
        self.registers.write_control(enable=control.enable, sweep=control.sweep)

    def enable(self) -> None:
        """Accept frames that begin from now on."""
        self.registers.write_control(enable=1, sweep=self.registers.read_control().sweep)

    def disable(self) -> None:
        """Drop frames that begin from now on, whole."""
        self.registers.write_control(enable=0, sweep=self.registers.read_control().sweep)

    def restart(self) -> None:
        """Reset the core, its errors and counters; pixels inside are lost."""
        self.registers.write_command(restart=1)

    def drain(self, timeout_s: float = 1.0) -> bool:
        """Wait until all that went in has come out; whether it has within the time.

        With a resampler: until no line has come out for a tenth of the time.
        """
        waited, quiet, last = 0.0, 0.0, -1
        resampler = "resampler" in self.description.parts
        while waited < timeout_s:
            counters = self.counters()
            inside = self.registers.read_status().inside
            if not resampler and not inside and counters.lines_in == counters.lines_out:
                return True
            quiet = quiet + _POLL_S if counters.lines_out == last else 0.0
            if resampler and not inside and quiet >= timeout_s / 10:
                return True
            last = counters.lines_out
            self._pause(_POLL_S)
            waited += _POLL_S
        return False

    # ---- focus

    def set_slice(self, number: int) -> None:
        """Choose the slice, from 0, of the frames that begin from now on; ends a sweep.

        InputError if the core has no such slice.
        """
        self._need("refocuser")
        count = len(self.description.shifts)
        if not 0 <= number < count:
            raise InputError(f"has no slice {number}; use 0 to {count - 1}", where="core")
        self.registers.write_slice(number)
        self.registers.write_control(enable=self.registers.read_control().enable, sweep=0)

    def set_focus(self, a: Fraction | float | str) -> int:
        """Choose the slice of a focus setting a, exactly; its number.

        InputError if there is none.
        """
        focus = Fraction(a)
        settings = self.description.settings
        if focus not in settings:
            names = ", ".join(str(setting) for setting in settings)
            raise InputError(f"has no slice for a = {focus}; use one of {names}", where="core")
        self.set_slice(settings.index(focus))
        return settings.index(focus)

    def set_distance(self, distance_mm: float, model: "RayModel") -> int:
        """Choose the slice that is nearest to a distance, in a; its number.

        `distance_mm` is from the micro lenses, inf is allowed; `model` is the camera as it is
        focused (`plenofir.camera.rays.RayModel.focused`). InputError if its micro images have
        another size, or the distance lies beyond the slices by more than half a step of theirs.
        """
        m, settings = self.description.micro_image_size, self.description.settings
        if model.micro_image_size != m:
            raise InputError(
                f"was built for M = {m}, the camera has M = {model.micro_image_size}", where="core"
            )
        focus = float(model.focus_setting(distance_mm))
        number = min(range(len(settings)), key=lambda i: abs(float(settings[i]) - focus))
        ordered = sorted(float(setting) for setting in settings)
        gaps = [b - a for a, b in pairwise(ordered)]
        if abs(float(settings[number]) - focus) > max([*gaps, 1 / m]) / 2:
            raise InputError(
                f"{distance_mm:g} mm needs a = {focus:.3f}; the core has a = "
                f"{ordered[0]:.3f} to {ordered[-1]:.3f}",
                where="core",
            )
        self.set_slice(number)
        return number

    def sweep(self, frames: int = 1) -> None:
        """Sweep through the slices, with 1 to 255 frames for each; InputError for other numbers."""
        self._need("refocuser")
        if not 1 <= frames <= 255:
            raise InputError(f"a slice cannot stay for {frames} frames; use 1 to 255", where="core")
        self.registers.write_sweep_frames(frames)
        self.registers.write_control(enable=self.registers.read_control().enable, sweep=1)

    @property
    def shown_slice(self) -> int:
        """Slice of the frame that comes out, or came out last."""
        self._need("refocuser")
        number: int = self.registers.read_status().slice
        return number

    # ---- what happened

    def counters(self) -> Counters:
        """Read all counters, one after the other."""
        registers = self.registers
        return Counters(
            frames_in=registers.read_frames_in(),
            frames_out=registers.read_frames_out(),
            lines_in=registers.read_lines_in(),
            lines_out=registers.read_lines_out(),
            stalls_in=registers.read_stalls_in(),
            stalls_out=registers.read_stalls_out(),
            dropped=registers.read_dropped(),
        )

    def errors(self, *, clear: bool = False) -> set[str]:
        """Names of the faults so far (fields of the register `errors`); clears those it returns."""
        bits = self.registers.read_errors()._asdict()
        names = {name for name, bit in bits.items() if bit}
        if clear and names:
            self.registers.write_errors(**bits)
        return names

    def wait(self, event: Event, timeout_s: float = 1.0) -> bool:
        """Wait until an event happens from now on; whether it did within the time."""
        self.registers.write_interrupt_status(**{event: 1})
        wait = getattr(self._access, "wait", None)
        if wait is not None:
            mask = self.registers.read_interrupt_mask()
            self.registers.write_interrupt_mask(
                **{**dict.fromkeys(mask._fields, 0), event: 1},
            )
            try:
                wait(timeout_s)
            finally:
                self.registers.write_interrupt_mask(**mask._asdict())
            return bool(getattr(self.registers.read_interrupt_status(), event))
        waited = 0.0
        while not getattr(self.registers.read_interrupt_status(), event):
            if waited >= timeout_s:
                return False
            self._pause(_POLL_S)
            waited += _POLL_S
        return True

    # ---- calibrations

    def load_calibration(self, calibration: "Calibration", *, where: str = "calibration") -> None:
        """Load a calibration into the resampler: frames that begin then have it.

        InputError, before anything is written, if it is one of another camera.
        """
        self._need("resampler")
        from plenofir.plan.sensor.board_load import BoardResampler, calibration_loads
        from plenofir.plan.sensor.resampler import ResamplerConfiguration

        described, details = self.description, self.description.details
        core = ResamplerConfiguration(
            micro_image_size=described.micro_image_size,
            max_columns=described.max_columns,
            channels=described.channels,
            pixel_bits=described.pixel_bits,
            lenses=details["lenses.count"],
            hexagonal=bool(details["resampler.hexagonal"]),
            skewed=bool(details["resampler.skewed"]),
            moves=bool(details["resampler.moves"]),
            gains=bool(details["resampler.gains"]),
            lines=details["resampler.lines"],
            fraction_bits=details["resampler.fraction_bits"],
            weight_bits=details["resampler.weight_bits"],
            guard_bits=details["resampler.guard_bits"],
            gain_bits=details["resampler.gain_bits"],
        )
        self.load_words(calibration_loads(BoardResampler(core), calibration, where=where))

    def load_words(self, words: Iterable[tuple[int, int, int]]) -> None:
        """Load words (kind, address, word) as `plenofir configure --calib` writes them."""
        self._need("resampler")
        place, high = (-1, -1), -1
        for kind, address, word in words:
            if kind == _COMMIT:
                self.registers.write_command(commit=1)
                continue
            if (kind, address) != place:
                self.registers.write_load_place(address=address, kind=kind)
            if word >> 32 != high:
                high = word >> 32
                self.registers.write_load_high(high)
            self.registers.write_load_word(word & 0xFFFFFFFF)
            place = kind, address + 1

    @property
    def raster_size(self) -> tuple[int, int]:
        """Columns and rows of the frames that come out of the resampler."""
        self._need("resampler")
        size = self.registers.read_raster_size()
        return size.columns, size.rows


_COMMIT = 3
