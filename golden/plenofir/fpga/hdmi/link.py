# SPDX-License-Identifier: Apache-2.0
"""Whole frames as TMDS words and back: an ideal source and an ideal sink.

The words of the three channels of a pixel are packed into one number: channel 0 (blue, with the
syncs) in bits 0 to 9, channel 1 (green) in bits 10 to 19, channel 2 (red) in bits 20 to 29.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.tmds import TOKENS, Bytes, Flags, decode_channel, encode_channel

Packed = npt.NDArray[np.uint32]
Frame = npt.NDArray[np.uint8]

TOKEN_RUN = 8
"""Control tokens in a row at which the sink believes in a word phase."""

MAX_SKEW = 16
"""Pixels by which the channels may lie apart."""


class LinkError(ValueError):
    """A signal in which the sink finds no picture."""


@dataclass(frozen=True)
class RasterSignals:
    """Contents of the three channels, one entry a pixel."""

    active: Flags  # data enable
    h_sync: Flags  # levels, as `v_sync`; undefined where active
    v_sync: Flags
    pixels: Bytes  # shape (pixels, 3): red, green, blue; 0 where not active


def raster_signals(mode: VideoMode, frames: Sequence[Frame]) -> RasterSignals:
    """Serialise frames (v_active, h_active, 3) with blanking, from their first active pixels on."""
    size = (mode.v_total, mode.h_total)
    active = np.zeros(size, bool)
    active[: mode.v_active, : mode.h_active] = True
    column = np.arange(mode.h_total)
    h_start = mode.h_active + mode.h_front
    h_pulse = (column >= h_start) & (column < h_start + mode.h_sync)
    # Vertical sync changes at the leading edge of horizontal sync.
    place = np.arange(mode.v_total)[:, None] * mode.h_total + column[None, :]
    v_start = (mode.v_active + mode.v_front) * mode.h_total + h_start
    v_pulse = (place >= v_start) & (place < v_start + mode.v_sync * mode.h_total)
    # With a short back porch a pulse reaches into the next frame, so the first frame begins with
    # one.
    wrapped = place + mode.v_total * mode.h_total
    v_pulse |= wrapped < v_start + mode.v_sync * mode.h_total
    h_sync = np.broadcast_to(h_pulse == mode.h_positive, size)
    v_sync = v_pulse == mode.v_positive
    pixels = np.zeros((len(frames), *size, 3), np.uint8)
    for i, frame in enumerate(frames):
        if frame.shape != (mode.v_active, mode.h_active, 3):
            raise ValueError(f"frame of shape {frame.shape} in mode {mode.name}")
        pixels[i, : mode.v_active, : mode.h_active] = frame

    def repeat(signal: Flags) -> Flags:
        return np.tile(signal.ravel(), len(frames))

    return RasterSignals(repeat(active), repeat(h_sync), repeat(v_sync), pixels.reshape(-1, 3))


def encode_signals(signals: RasterSignals) -> Packed:
    """Code raster signals: words of all channels, one number a pixel."""
    packed = np.zeros(len(signals.active), np.uint32)
    for channel in range(3):
        control = np.zeros(len(signals.active), np.uint8)
        if channel == 0:
            control = (2 * signals.v_sync + signals.h_sync).astype(np.uint8)
        words = encode_channel(signals.pixels[:, 2 - channel], signals.active, control)
        packed |= words.astype(np.uint32) << np.uint32(10 * channel)
    return packed


def encode_frames(mode: VideoMode, frames: Sequence[Frame]) -> Packed:
    """Code RGB frames (v_active, h_active, 3), each beginning with its first active pixel.

    Words of all channels, one number a pixel.
    """
    return encode_signals(raster_signals(mode, frames))


def _bits(packed: Packed, channel: int) -> Bytes:
    """Bits of a channel in the order in which they were sent."""
    words = packed >> np.uint32(10 * channel) & np.uint32(0x3FF)
    return (words[:, None] >> np.arange(10, dtype=np.uint32) & 1).astype(np.uint8).ravel()


def _words(bits: Bytes, phase: int) -> npt.NDArray[np.uint16]:
    count = (len(bits) - phase) // 10
    groups = bits[phase : phase + 10 * count].reshape(-1, 10).astype(np.uint16)
    return np.asarray((groups << np.arange(10, dtype=np.uint16)).sum(axis=1), np.uint16)


def _longest_run(flags: Flags) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def align_channel(packed: Packed, channel: int) -> npt.NDArray[np.uint16]:
    """Words of a channel (0 to 2), their phase found by its longest run of control tokens.

    `packed` has ten sampled bits of each channel in each number, at any phase; LinkError if no
    phase has control tokens.
    """
    bits = _bits(packed, channel)
    candidates = [_words(bits, phase) for phase in range(10)]
    runs = [_longest_run(np.isin(words, TOKENS)) for words in candidates]
    best = int(np.argmax(runs))
    if runs[best] < TOKEN_RUN:
        raise LinkError(f"channel {channel}: no control tokens")
    return candidates[best]


def decode_signals(packed: Packed) -> RasterSignals:
    """Decode sampled bits (see `align_channel`); each channel's word phase and skew are found.

    LinkError if a channel has no control tokens or no picture, or the channels do not fit each
    other.
    """
    decoded = [decode_channel(align_channel(packed, channel)) for channel in range(3)]
    starts: list[int] = []
    for channel, (on, _, _) in enumerate(decoded):
        rises = np.flatnonzero(on[1:] & ~on[:-1])
        if len(rises) < 2:
            raise LinkError(f"channel {channel}: no active pixels")
        # Skew: from a line of channel 0 to the line of the other channel that begins nearest to it.
        near = int(np.argmin(np.abs(rises - starts[0]))) if starts else 1
        starts.append(int(rises[near]))
    first = min(starts)
    skews = [start - first for start in starts]
    if max(skews) > MAX_SKEW:
        raise LinkError(f"channels are {max(skews)} pixels apart")
    length = min(len(d[0]) - skew for d, skew in zip(decoded, skews, strict=True))
    flags = [d[0][skew : skew + length] for d, skew in zip(decoded, skews, strict=True)]
    values = [d[1][skew : skew + length] for d, skew in zip(decoded, skews, strict=True)]
    control = decoded[0][2][skews[0] : skews[0] + length]
    if not all(np.array_equal(flags[0], other) for other in flags[1:]):
        raise LinkError("data enable differs between the channels")
    return RasterSignals(
        active=flags[0],
        h_sync=(control & 1).astype(bool),
        v_sync=(control & 2).astype(bool),
        pixels=np.stack(values[::-1], axis=1),
    )


@dataclass(frozen=True)
class ReceivedFrame:
    """A frame that the sink found."""

    start: int  # index of its first active pixel in the decoded signal
    to_end: int  # pixels from there to the end of the signal
    mode: VideoMode  # named "measured", the pixel clock being unknown (1)
    pixels: Frame  # shape (rows, columns, 3), RGB


def split_frames(signals: RasterSignals, *, from_start: bool = False) -> list[ReceivedFrame]:
    """Cut a decoded signal into whole frames and measure the timing of each.

    A frame is whole if the beginning of the next one was received too. `from_start`: the first
    active pixel is known to be the first of a frame. LinkError if lines of a frame differ in length
    or position, or a sync pulse is missing or irregular.
    """
    active = signals.active
    rises = np.flatnonzero(np.diff(active.astype(np.int8), prepend=np.int8(active[0])) == 1)
    falls = np.flatnonzero(np.diff(active.astype(np.int8), prepend=np.int8(active[0])) == -1)
    if len(rises) < 2:
        return []
    falls = falls[falls > rises[0]]
    count = min(len(rises), len(falls))
    rises, falls = rises[:count], falls[:count]
    # The shortest distance of two lines is the line length; longer ones are vertical blanking.
    steps = np.diff(rises)
    line = int(steps.min())
    firsts = [0, *(int(i) + 1 for i in np.flatnonzero(steps > line))]
    frames = []
    for begin, end in itertools.pairwise(firsts if from_start else firsts[1:]):
        frames.append(_measure(signals, rises[begin:end], falls[begin:end], line, int(rises[end])))
    return frames


def _measure(
    signals: RasterSignals,
    rises: npt.NDArray[np.intp],
    falls: npt.NDArray[np.intp],
    line: int,
    following: int,
) -> ReceivedFrame:
    """Measure one frame whose lines begin at `rises`; the next frame begins at `following`."""
    start = int(rises[0])
    columns = set((falls - rises).tolist())
    total = following - start
    if len(columns) != 1 or total % line or np.any(np.diff(rises) != line):
        raise LinkError(f"frame at {start}: irregular lines")
    width, rows = columns.pop(), len(rises)
    # Levels in the blanking of a line, beginning with the front porch.
    inside = signals.h_sync[start : start + total].reshape(-1, line)[:, width:]
    if np.any(inside != inside[0]):
        raise LinkError(f"frame at {start}: irregular horizontal sync")
    blank = np.ones((total // line, line), bool)
    blank[:rows, :width] = False
    h_level, h_front, h_sync = _pulse(inside[0])
    h_place = width + h_front
    # Vertical sync, seen once a line at the place where horizontal sync begins.
    v_lines = signals.v_sync[start : start + total].reshape(-1, line)[:, h_place]
    v_level, v_first, v_sync = _pulse(v_lines[rows:])
    v_change = np.flatnonzero(np.diff(signals.v_sync[start : start + total][blank.ravel()]))
    places = np.flatnonzero(blank.ravel())[v_change + 1]
    if any(int(place) % line != h_place for place in places):
        raise LinkError(f"frame at {start}: vertical sync changes apart from horizontal sync")
    mode = VideoMode(
        name="measured",
        pixel_clock=1,
        h_active=width,
        h_front=h_front,
        h_sync=h_sync,
        h_back=line - width - h_front - h_sync,
        v_active=rows,
        v_front=v_first,
        v_sync=v_sync,
        v_back=total // line - rows - v_first - v_sync,
        h_positive=h_level,
        v_positive=v_level,
    )
    pixels = signals.pixels[start : start + total].reshape(-1, line, 3)[:rows, :width]
    return ReceivedFrame(start, len(signals.active) - start, mode, pixels.copy())


def _pulse(levels: Flags) -> tuple[bool, int, int]:
    """Level, start and length of the one pulse that does not touch the ends of a blanking."""
    if len(levels) == 0:
        raise LinkError("no blanking between lines or frames")
    level = not levels[0]
    places = np.flatnonzero(levels == level)
    if len(places) == 0 or np.any(np.diff(places) != 1) or levels[-1] == level:
        raise LinkError("no single sync pulse in the blanking")
    return bool(level), int(places[0]), len(places)


def decode_frames(packed: Packed, *, from_start: bool = False) -> list[ReceivedFrame]:
    """Find all whole frames in sampled bits (see `align_channel`, `split_frames`).

    The frame that the recording begins in and the last one are not whole.
    """
    return split_frames(decode_signals(packed), from_start=from_start)
