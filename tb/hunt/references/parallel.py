# SPDX-License-Identifier: Apache-2.0
"""Parallel video in and out, from the headers of `parallel_to_stream` and `stream_to_parallel`."""

from collections.abc import Iterable, Sequence


def frames(items: Iterable, columns: int, rows: int) -> list[list[list[int]]]:
    """Lines of pixels of the output frames for beats; None: silence longer than STALL."""
    found: list[list[list[int]]] = []
    line: list[int] = []
    starts = dropping = is_open = False

    def end() -> None:
        nonlocal line, starts, is_open
        if starts:
            found.append([])
        if starts or is_open:
            found[-1].append(line)
            is_open = len(found[-1]) < rows
        line, starts = [], False

    for beat in items:
        if beat is None:
            is_open = False
            continue
        if beat.start:
            if line:
                end()
            starts, dropping = True, False
        elif dropping:
            dropping = not beat.last
            continue
        line.append(beat.data)
        if beat.last or len(line) == columns:
            dropping = not beat.last
            end()
    return found


def beats(clocks: Sequence[tuple[int, int, int]]) -> list[tuple[int, int, int, int]]:
    """Clock, data, tuser, tlast of the pixels of a camera: its frame_valid, line_valid, data."""
    found = []
    first = 0
    for clock, (frame, line, data) in enumerate(clocks):
        if frame and line:
            following = clocks[clock + 1] if clock + 1 < len(clocks) else (0, 0, 0)
            found.append((clock, data, first, int(not (following[0] and following[1]))))
            first = 0
        if not frame:
            first = 1
    return found
