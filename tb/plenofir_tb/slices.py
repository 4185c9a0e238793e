# SPDX-License-Identifier: Apache-2.0
"""Model of the selection of slices."""


class SliceModel:
    """Slice of the next frame by the rules of ``slice_select``."""

    def __init__(self, slices: int) -> None:
        self.slices = slices
        self.swept = 0
        self.shown = 0

    def next_frame(self, slice_: int, sweep: int, sweep_frames: int) -> int:
        """Slice of a frame that starts with these values at the ports."""
        if not sweep:
            self.swept = min(slice_, self.slices - 1)
            self.shown = 0
            return self.swept
        current = self.swept
        self.shown += 1
        if self.shown >= max(sweep_frames, 1):
            self.swept = (self.swept + 1) % self.slices
            self.shown = 0
        return current
