# SPDX-License-Identifier: Apache-2.0
"""Clocks that the module array takes for a frame, beside those of the thesis (Eqs. 6.10 to 6.12).

The counts follow from `CoreConfiguration`; the testbench of the array measures every case of
`SIMULATED` and must find the same numbers.
"""

from dataclasses import dataclass

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine


def array_latency_clocks(core: CoreConfiguration, columns: int) -> int:
    """Clocks from the array's first pixel in to its first pixel out.

    Bands follow each other without a pause. The latency is floor(D/N) bands until the one with
    the frame's first line, D columns of the row filter, D mod N (the line's place in its band)
    skew registers, and the pipeline.
    """
    bands, row = divmod(core.delay, core.parallel_rows)
    return bands * core.band_steps(columns) + core.delay + row + core.array_clocks


def array_frame_clocks(core: CoreConfiguration, columns: int, rows: int) -> int:
    """Clocks of the array for each frame of a sequence."""
    return -(-rows // core.parallel_rows) * core.band_steps(columns)


def array_first_frame_clocks(core: CoreConfiguration, columns: int, rows: int) -> int:
    """Clocks from the array's first pixel in to the frame's last one out, both included."""
    bands, row = divmod(rows - 1 + core.delay, core.parallel_rows)
    tokens = bands * core.band_steps(columns) + columns - 1 + core.delay + row
    return tokens + core.array_clocks + 1


@dataclass(frozen=True)
class ClockCase:
    """A frame on an array."""

    columns: int  # K in pixels
    rows: int  # L in pixels
    core: CoreConfiguration  # the array; its parallel rows are the degree of parallelism iota

    @property
    def first_frame(self) -> int:
        """Clocks from the first pixel in to the last pixel of the frame out."""
        return array_first_frame_clocks(self.core, self.columns, self.rows)

    @property
    def next_frame(self) -> int:
        """Clocks for each following frame."""
        return array_frame_clocks(self.core, self.columns, self.rows)

    @property
    def thesis_first_frame(self) -> int:
        """Eq. (6.10), which is for iota = L: multiplier, M, multiplier, M, K-1, L-1, K-1."""
        m = self.core.micro_image_size
        return 1 + m + 1 + m + 2 * (self.columns - 1) + self.rows - 1

    @property
    def thesis_next_frame(self) -> int:
        """Eq. (6.12), which is for iota = L."""
        return self.columns - 1 + self.rows - 1


def _case(size: int, m: int, shift: int, parallel_rows: int, *, hold: bool = False) -> ClockCase:
    core = CoreConfiguration(
        micro_image_size=m,
        shifts=(shift,),
        max_columns=size,
        engine=FirEngine(parallel_rows=parallel_rows, hold=hold),
    )
    return ClockCase(size, size, core)


SIMULATED = (
    *(_case(15, 3, 1, rows) for rows in (1, 3, 15)),
    *(_case(15, 3, 0, rows, hold=True) for rows in (1, 3, 15)),
    *(_case(15, 3, 2, rows) for rows in (1, 3, 15)),
    *(_case(15, 5, 1, rows) for rows in (1, 3, 5, 15)),
    *(_case(15, 5, -3, rows) for rows in (1, 3, 5, 15)),
    *(_case(22, 11, 1, rows) for rows in (1, 3, 11, 22)),
)
"""Cases that are simulated: iota of 1, 3, M and L."""

EXTRAPOLATED = (*(_case(3201, 11, 1, rows) for rows in (1, 3, 11, 3201)),)
"""The example of the thesis (section 6.1.2), too large to simulate."""


def table(cases: tuple[ClockCase, ...]) -> str:
    """Markdown table of cases, with the counts that the thesis gives (for iota = L, a = 1/M)."""
    lines = [
        "| K x L | M | a' | iota | first pixel | first frame | thesis | further frames | thesis |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for case in cases:
        core, engine = case.core, case.core.engine
        assert isinstance(engine, FirEngine)
        whole = core.parallel_rows == case.rows and core.shifts == (1,)
        lines.append(
            f"| {case.columns} x {case.rows} | {core.micro_image_size} | {core.shifts[0]}"
            f"{' (hold)' if engine.hold else ''} | {core.parallel_rows} "
            f"| {array_latency_clocks(core, case.columns)} "
            f"| {case.first_frame} | {case.thesis_first_frame if whole else ''} "
            f"| {case.next_frame} | {case.thesis_next_frame if whole else ''} |"
        )
    return "\n".join(lines)
