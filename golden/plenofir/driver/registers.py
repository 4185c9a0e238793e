# SPDX-License-Identifier: Apache-2.0
"""The registers of a core behind a bus.

Built by scripts/build_registers.py from hdl/axi/registers.toml.
"""

from typing import NamedTuple, Protocol

IDENTIFICATION_VALUE = 0x506C6E66
"""What `identification` reads as: Plnf."""
MAP_NUMBER = 1
"""Number of this map, `version.map`. Drivers take no other."""


class Access(Protocol):
    """Reads and writes words of 32 bits, by their addresses in bytes."""

    def read(self, address: int, /) -> int:
        """Read the word at an address."""

    def write(self, address: int, value: int, /) -> object:
        """Write the word at an address."""


class Version(NamedTuple):
    """What the core is of."""

    patch: int
    minor: int
    major: int
    map: int


class Parts(NamedTuple):
    """What stands behind these registers."""

    refocuser: int
    stack: int
    depth_index: int
    resampler: int
    mosaic: int


class Geometry(NamedTuple):
    """What a frame is made of."""

    micro_image_size: int
    slices: int
    channels: int
    pixel_bits: int
    pixels_per_clock: int


class Limits(NamedTuple):
    """The largest frames."""

    max_columns: int
    parallel_rows: int


class Engine(NamedTuple):
    """How slices are computed."""

    moving_sum: int
    exact: int
    centred: int
    hold: int
    any_rows: int
    order: int
    fraction_bits: int
    guard_bits: int
    border_normalised: int


class Sharpness(NamedTuple):
    """How the sharpest slice is found."""

    radius: int
    vote_radius: int


class Resampler(NamedTuple):
    """What it is built for."""

    hexagonal: int
    moves: int
    gains: int
    lines: int
    fraction_bits: int
    weight_bits: int
    guard_bits: int
    gain_bits: int


class SliceShift(NamedTuple):
    """What the slice `asked_slice` refocuses to; of a number beyond the set 0."""

    shift: int
    sharpening: int


class Control(NamedTuple):
    """Switches."""

    enable: int
    sweep: int


class FrameSize(NamedTuple):
    """Size of the frames that come in.

    A size that is written restarts the core. It is refused (`errors.refused`) while
    `control.enable` is 1, with 0 columns or rows, with more columns than `limits` has, and unless
    all four bytes are written at once. Until one is written frames are dropped with
    `errors.frame_size`.
    """

    columns: int
    rows: int


class RedPlace(NamedTuple):
    """The first red pixel."""

    column: int
    row: int


class Status(NamedTuple):
    """What goes on."""

    slice: int
    inside: int


class RasterSize(NamedTuple):
    """Size of the frames that come out; between two frames that of the last one."""

    columns: int
    rows: int


class Errors(NamedTuple):
    """Faults so far. A 1 that is written clears its bit."""

    line_early: int
    line_late: int
    frame_early: int
    frame_late: int
    frame_size: int
    calibration: int
    refused: int


class InterruptStatus(NamedTuple):
    """What has happened. A 1 that is written clears its bit."""

    frame_in: int
    frame_out: int
    error: int


class InterruptMask(NamedTuple):
    """What the interrupt tells. It is high while a bit is 1 in both `interrupt_status` and here."""

    frame_in: int
    frame_out: int
    error: int


class LoadPlace(NamedTuple):
    """Where the next word of a calibration goes.

    Refused unless all four bytes are written at once, and with kind 3.
    """

    address: int
    kind: int


class Registers:
    """Reads and writes registers, field by field.

    A register of which `NEEDS` has none of the bits of `parts` is not there.
    """

    def __init__(self, access: Access) -> None:
        self._access = access

    def read_identification(self) -> int:
        """The number."""
        word = self._access.read(0x00)
        return word

    def read_version(self) -> Version:
        """What the core is of."""
        word = self._access.read(0x04)
        return Version(word & 0xFF, word >> 8 & 0xFF, word >> 16 & 0xFF, word >> 24 & 0xFF)

    def read_parts(self) -> Parts:
        """What stands behind these registers."""
        word = self._access.read(0x08)
        return Parts(word & 0x1, word >> 1 & 0x1, word >> 2 & 0x1, word >> 3 & 0x1, word >> 4 & 0x1)

    def read_geometry(self) -> Geometry:
        """What a frame is made of."""
        word = self._access.read(0x0C)
        return Geometry(
            word & 0xFF, word >> 8 & 0x1FF, word >> 17 & 0x3, word >> 19 & 0x1F, word >> 24 & 0x3F
        )

    def read_limits(self) -> Limits:
        """The largest frames."""
        word = self._access.read(0x10)
        return Limits(word & 0xFFFF, word >> 16 & 0x7F)

    def read_engine(self) -> Engine:
        """How slices are computed."""
        word = self._access.read(0x14)
        return Engine(
            word & 0x1,
            word >> 1 & 0x1,
            word >> 2 & 0x1,
            word >> 3 & 0x1,
            word >> 4 & 0x1,
            word >> 5 & 0x3,
            word >> 7 & 0xF,
            word >> 11 & 0xF,
            word >> 15 & 0x1,
        )

    def read_sharpness(self) -> Sharpness:
        """How the sharpest slice is found."""
        word = self._access.read(0x18)
        return Sharpness(word & 0xF, word >> 4 & 0x7)

    def read_confidence(self) -> int:
        """How far the sharpest and the dullest slice are apart where there is texture."""
        word = self._access.read(0x1C)
        return word & 0x3FFFFFFF

    def read_resampler(self) -> Resampler:
        """What it is built for."""
        word = self._access.read(0x20)
        return Resampler(
            word & 0x1,
            word >> 1 & 0x1,
            word >> 2 & 0x1,
            word >> 3 & 0x1FF,
            word >> 12 & 0x1F,
            word >> 17 & 0xF,
            word >> 21 & 0x3,
            word >> 23 & 0xF,
        )

    def read_lenses(self) -> int:
        """Lenses of the table."""
        word = self._access.read(0x24)
        return word & 0x1FFFFF

    def read_asked_slice(self) -> int:
        """Number in the set, from 0."""
        word = self._access.read(0x28)
        return word & 0xFF

    def write_asked_slice(self, number: int) -> None:
        """Of which slice `slice_shift` tells."""
        self._access.write(0x28, number & 0xFF)

    def read_slice_shift(self) -> SliceShift:
        """What the slice `asked_slice` refocuses to; of a number beyond the set 0."""
        word = self._access.read(0x2C)
        return SliceShift(((word & 0x3FFF) ^ 0x2000) - 0x2000, word >> 14 & 0x1F)

    def read_control(self) -> Control:
        """Switches."""
        word = self._access.read(0x30)
        return Control(word & 0x1, word >> 1 & 0x1)

    def write_control(self, *, enable: int, sweep: int) -> None:
        """Switches."""
        self._access.write(0x30, (enable & 0x1) | ((sweep & 0x1) << 1))

    def write_command(self, *, restart: int = 0, commit: int = 0) -> None:
        """What happens once, when a 1 is written."""
        self._access.write(0x34, (restart & 0x1) | ((commit & 0x1) << 1))

    def read_slice(self) -> int:
        """Slice of the frames that begin from now on; beyond the set it is the last one."""
        word = self._access.read(0x38)
        return word & 0xFF

    def write_slice(self, number: int) -> None:
        """The plane that is refocused to."""
        self._access.write(0x38, number & 0xFF)

    def read_sweep_frames(self) -> int:
        """Frames of each slice in a sweep; 0 counts as 1."""
        word = self._access.read(0x3C)
        return word & 0xFF

    def write_sweep_frames(self, count: int) -> None:
        """How fast a sweep is."""
        self._access.write(0x3C, count & 0xFF)

    def read_frame_size(self) -> FrameSize:
        """Size of the frames that come in.

        A size that is written restarts the core. It is refused (`errors.refused`) while
        `control.enable` is 1, with 0 columns or rows, with more columns than `limits` has, and
        unless all four bytes are written at once. Until one is written frames are dropped with
        `errors.frame_size`.
        """
        word = self._access.read(0x40)
        return FrameSize(word & 0xFFFF, word >> 16 & 0xFFFF)

    def write_frame_size(self, *, columns: int, rows: int) -> None:
        """Size of the frames that come in.

        A size that is written restarts the core. It is refused (`errors.refused`) while
        `control.enable` is 1, with 0 columns or rows, with more columns than `limits` has, and
        unless all four bytes are written at once. Until one is written frames are dropped with
        `errors.frame_size`.
        """
        self._access.write(0x40, (columns & 0xFFFF) | ((rows & 0xFFFF) << 16))

    def read_red_place(self) -> RedPlace:
        """The first red pixel."""
        word = self._access.read(0x44)
        return RedPlace(word & 0x1, word >> 1 & 0x1)

    def write_red_place(self, *, column: int, row: int) -> None:
        """The first red pixel."""
        self._access.write(0x44, (column & 0x1) | ((row & 0x1) << 1))

    def read_status(self) -> Status:
        """What goes on."""
        word = self._access.read(0x48)
        return Status(word & 0xFF, word >> 8 & 0x1)

    def read_raster_size(self) -> RasterSize:
        """Size of the frames that come out; between two frames that of the last one."""
        word = self._access.read(0x4C)
        return RasterSize(word & 0xFFFF, word >> 16 & 0xFFFF)

    def read_errors(self) -> Errors:
        """Faults so far. A 1 that is written clears its bit."""
        word = self._access.read(0x50)
        return Errors(
            word & 0x1,
            word >> 1 & 0x1,
            word >> 2 & 0x1,
            word >> 3 & 0x1,
            word >> 4 & 0x1,
            word >> 5 & 0x1,
            word >> 6 & 0x1,
        )

    def write_errors(
        self,
        *,
        line_early: int = 0,
        line_late: int = 0,
        frame_early: int = 0,
        frame_late: int = 0,
        frame_size: int = 0,
        calibration: int = 0,
        refused: int = 0,
    ) -> None:
        """Faults so far. A 1 that is written clears its bit."""
        self._access.write(
            0x50,
            (line_early & 0x1)
            | ((line_late & 0x1) << 1)
            | ((frame_early & 0x1) << 2)
            | ((frame_late & 0x1) << 3)
            | ((frame_size & 0x1) << 4)
            | ((calibration & 0x1) << 5)
            | ((refused & 0x1) << 6),
        )

    def read_interrupt_status(self) -> InterruptStatus:
        """What has happened. A 1 that is written clears its bit."""
        word = self._access.read(0x54)
        return InterruptStatus(word & 0x1, word >> 1 & 0x1, word >> 2 & 0x1)

    def write_interrupt_status(
        self, *, frame_in: int = 0, frame_out: int = 0, error: int = 0
    ) -> None:
        """What has happened. A 1 that is written clears its bit."""
        self._access.write(0x54, (frame_in & 0x1) | ((frame_out & 0x1) << 1) | ((error & 0x1) << 2))

    def read_interrupt_mask(self) -> InterruptMask:
        """What the interrupt tells.

        It is high while a bit is 1 in both `interrupt_status` and here.
        """
        word = self._access.read(0x58)
        return InterruptMask(word & 0x1, word >> 1 & 0x1, word >> 2 & 0x1)

    def write_interrupt_mask(self, *, frame_in: int, frame_out: int, error: int) -> None:
        """What the interrupt tells.

        It is high while a bit is 1 in both `interrupt_status` and here.
        """
        self._access.write(0x58, (frame_in & 0x1) | ((frame_out & 0x1) << 1) | ((error & 0x1) << 2))

    def read_frames_in(self) -> int:
        """Frames that began to go in."""
        word = self._access.read(0x5C)
        return word

    def read_frames_out(self) -> int:
        """Frames that began to come out."""
        word = self._access.read(0x60)
        return word

    def read_lines_in(self) -> int:
        """Lines that began to go in."""
        word = self._access.read(0x64)
        return word

    def read_lines_out(self) -> int:
        """Lines that came out."""
        word = self._access.read(0x68)
        return word

    def read_stalls_in(self) -> int:
        """Clocks in which the source had to wait."""
        word = self._access.read(0x6C)
        return word

    def read_stalls_out(self) -> int:
        """Clocks in which the sink kept the core waiting."""
        word = self._access.read(0x70)
        return word

    def read_dropped(self) -> int:
        """Transfers (pixels, or P of them) that belong to no frame.

        They come while disabled, of a wrong size, in excess of a line, between two frames.
        """
        word = self._access.read(0x74)
        return word

    def read_load_place(self) -> LoadPlace:
        """Where the next word of a calibration goes.

        Refused unless all four bytes are written at once, and with kind 3.
        """
        word = self._access.read(0x78)
        return LoadPlace(word & 0xFFFFF, word >> 20 & 0x3)

    def write_load_place(self, *, address: int = 0, kind: int = 0) -> None:
        """Where the next word of a calibration goes.

        Refused unless all four bytes are written at once, and with kind 3.
        """
        self._access.write(0x78, (address & 0xFFFFF) | ((kind & 0x3) << 20))

    def read_load_high(self) -> int:
        """Bits 39 to 32 of the words to come."""
        word = self._access.read(0x7C)
        return word & 0xFF

    def write_load_high(self, bits: int) -> None:
        """What `load_word` has no room for."""
        self._access.write(0x7C, bits & 0xFF)

    def write_load_word(self, low: int) -> None:
        """Writes a word to `load_place`. Refused unless all four bytes are written at once."""
        self._access.write(0x80, low & 0xFFFFFFFF)


NEEDS = {
    "engine": 3,
    "sharpness": 4,
    "confidence": 4,
    "resampler": 8,
    "lenses": 8,
    "asked_slice": 3,
    "slice_shift": 3,
    "slice": 1,
    "sweep_frames": 1,
    "red_place": 16,
    "raster_size": 8,
    "load_place": 8,
    "load_high": 8,
    "load_word": 8,
}
"""Bits of the register `parts` of which a register needs one; the others are always there."""

ADDRESSES = {
    "identification": 0x00,
    "version": 0x04,
    "parts": 0x08,
    "geometry": 0x0C,
    "limits": 0x10,
    "engine": 0x14,
    "sharpness": 0x18,
    "confidence": 0x1C,
    "resampler": 0x20,
    "lenses": 0x24,
    "asked_slice": 0x28,
    "slice_shift": 0x2C,
    "control": 0x30,
    "command": 0x34,
    "slice": 0x38,
    "sweep_frames": 0x3C,
    "frame_size": 0x40,
    "red_place": 0x44,
    "status": 0x48,
    "raster_size": 0x4C,
    "errors": 0x50,
    "interrupt_status": 0x54,
    "interrupt_mask": 0x58,
    "frames_in": 0x5C,
    "frames_out": 0x60,
    "lines_in": 0x64,
    "lines_out": 0x68,
    "stalls_in": 0x6C,
    "stalls_out": 0x70,
    "dropped": 0x74,
    "load_place": 0x78,
    "load_high": 0x7C,
    "load_word": 0x80,
}
"""Address of each register in bytes."""
