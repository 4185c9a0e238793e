# SPDX-License-Identifier: Apache-2.0
"""Scoreboard that compares frames as they come out, pixel by pixel."""

from pathlib import Path

import numpy as np

from plenofir.fpga.compare import compare_frames, difference_picture
from plenofir.ground.images import write_png
from plenofir_tb.axi_video import AxiVideoSink, Beat, Frame, frame_beats


class FrameScoreboard:
    """Compares each transfer with the expected frames, and writes pictures of those that differ.

    `pictures` is the folder for got, want and difference; `pixels` are those of a transfer.
    """

    def __init__(
        self, sink: AxiVideoSink, pixel_bits: int, pictures: Path, pixels: int = 1
    ) -> None:
        self.pixel_bits = pixel_bits
        self.pictures = pictures
        self.pixels = pixels
        self.frames: list[Frame] = []
        self.slices: list[int] = []
        self.received: list[Beat] = []
        self.frames_done = 0
        # Off: the output is not compared.
        self.listening = True
        sink.add_callback(self._take)

    def expect(self, frame: Frame, slice_: int = 0) -> None:
        """Add a frame, refocused to a slice, to those expected next."""
        self.frames.append(frame)
        self.slices.append(slice_)

    @property
    def waiting(self) -> bool:
        """Whether frames are still to come."""
        return self.frames_done < len(self.frames)

    def _take(self, beat: Beat) -> None:
        if not self.listening:
            return
        if not self.waiting:
            raise AssertionError(f"transfer {beat} after the last of {len(self.frames)} frames")
        want = self.frames[self.frames_done]
        rows, columns = want.shape[0], -(-want.shape[1] // self.pixels)
        line, column = divmod(len(self.received), columns)
        assert beat.end_of_line == (column == columns - 1), (
            f"frame {self.frames_done}, line {line}, column {column}: tlast {beat.end_of_line}"
        )
        assert beat.start_of_frame == (line == 0 and column == 0), (
            f"frame {self.frames_done}, line {line}, column {column}: tuser {beat.start_of_frame}"
        )
        assert beat.slice == self.slices[self.frames_done], (
            f"frame {self.frames_done}, line {line}, column {column}: slice {beat.slice}, "
            f"want {self.slices[self.frames_done]}"
        )
        self.received.append(beat)
        if len(self.received) == rows * columns:
            self._compare_frame(want)
            self.received = []
            self.frames_done += 1

    def _compare_frame(self, want: Frame) -> None:
        if [beat.data for beat in self.received] == [
            beat.data for beat in frame_beats(want, self.pixel_bits, self.pixels)
        ]:
            return
        mask = (1 << self.pixel_bits) - 1
        channels = 1 if want.ndim == 2 else want.shape[2]
        values = [
            (b.data >> (lane * self.pixel_bits)) & mask
            for b in self.received
            for lane in range(self.pixels * channels)
        ]
        lines = np.array(values, dtype=want.dtype).reshape(len(want), -1, *want.shape[2:])
        got = lines[:, : want.shape[1]]
        self.pictures.mkdir(parents=True, exist_ok=True)
        for name, picture in (
            ("got", got),
            ("want", want),
            ("diff", difference_picture(got, want)),
        ):
            write_png(self.pictures / f"frame{self.frames_done}_{name}.png", picture)
        comparison = compare_frames(got[np.newaxis], want[np.newaxis])
        first = str(comparison.first).replace("frame 0", f"frame {self.frames_done}", 1)
        raise AssertionError(
            f"{comparison.mismatches} of {comparison.pixels} pixels differ, first: {first}; "
            f"pictures in {self.pictures}"
        )

    @property
    def result(self) -> None:
        """Fail if frames are missing or incomplete."""
        missing = len(self.frames) - self.frames_done
        assert not missing, f"{missing} frames missing, {len(self.received)} pixels of the next one"
        assert not self.received, f"{len(self.received)} pixels too many"
