# SPDX-License-Identifier: Apache-2.0
"""Test frames, and a model of what the core makes of damaged streams."""

import random
from collections.abc import Sequence

import numpy as np

from plenofir_tb.axi_video import Beat, Frame

KINDS = ("white", "black", "impulse", "gradient", "random")


def make_frame(
    kind: str, rows: int, columns: int, channels: int, pixel_bits: int, rng: random.Random
) -> Frame:
    """Make a test frame of one of the `KINDS`; one channel gives shape (rows, columns)."""
    shape = (rows, columns) if channels == 1 else (rows, columns, channels)
    dtype = np.uint8 if pixel_bits <= 8 else np.uint16
    largest = (1 << pixel_bits) - 1
    if kind == "white":
        return np.full(shape, largest, dtype)
    if kind == "black":
        return np.zeros(shape, dtype)
    if kind == "impulse":
        frame = np.zeros(shape, dtype)
        frame[rng.randrange(rows), rng.randrange(columns)] = largest
        return frame
    if kind == "gradient":
        ramp = np.arange(rows)[:, None] * 3 + np.arange(columns)[None, :] * 7
        planes = [(ramp * (c + 1)) % (largest + 1) for c in range(channels)]
        return np.stack(planes, axis=-1).reshape(shape).astype(dtype)
    if kind == "random":
        return np.random.default_rng(rng.randrange(1 << 32)).integers(
            0, largest, shape, dtype, endpoint=True
        )
    raise ValueError(kind)


def damaged(beats: Sequence[Beat], tokens: int, rng: random.Random) -> list[Beat]:
    """A frame with a fault: beats missing or doubled, cut off, no mark, random marks."""
    broken = list(beats)
    fault = rng.choice(["drop", "repeat", "cut", "no last", "no start", "noise"])
    at = rng.randrange(len(broken))
    if fault == "drop":
        del broken[at : at + rng.randint(1, 3)]
    elif fault == "repeat":
        extra = [Beat(b.data, False, b.end_of_line) for b in broken[at : at + tokens]]
        broken[at:at] = extra[: rng.randint(1, tokens)]
    elif fault == "cut":
        broken = broken[: at + 1]
    elif fault == "no last":
        broken = [Beat(b.data, b.start_of_frame, False) for b in broken]
    elif fault == "no start":
        broken = [Beat(b.data, False, b.end_of_line) for b in broken]
    else:
        broken = [Beat(b.data, rng.random() < 0.05, rng.random() < 0.2) for b in broken]
    # A start that lasts into the next frame would be that one's.
    if broken:
        broken[-1] = broken[-1]._replace(start_of_frame=False)
    return broken


def repaired_frames(
    beats: list[Beat], columns: int, rows: int
) -> tuple[list[list[list[int]]], set[str]]:
    """The frame sequencer's output for a possibly broken stream, by its rules in Python.

    Result: frames as lists of whole lines of packed pixels, with fewer lines if they were cut
    short; and the names of the faults: "line early", "line late", "frame early", "frame late".
    """
    frames: list[list[list[int]]] = []
    faults: set[str] = set()
    lines: list[list[int]] | None = None
    line: list[int] = []
    dropping = lasting = False

    def end_line() -> None:
        nonlocal lines, line
        assert lines is not None
        lines.append(line + [0] * (columns - len(line)))
        line = []
        if len(lines) == rows:
            lines = None

    for beat in beats:
        # A mark of start that lasts several pixels of a line is one start.
        again, lasting = lasting, False
        if beat.start_of_frame and not again:
            dropping = False
            if lines is not None:
                faults.add("frame early")
                if line:
                    end_line()
            lines = []
            frames.append(lines)
        elif dropping:
            dropping = not beat.end_of_line
            continue
        elif lines is None:
            if frames:
                faults.add("frame late")
            continue
        line.append(beat.data)
        if len(line) == columns:
            if not beat.end_of_line:
                faults.add("line late")
                dropping = True
            end_line()
        elif beat.end_of_line:
            faults.add("line early")
            end_line()
        else:
            lasting = beat.start_of_frame
    return frames, faults
