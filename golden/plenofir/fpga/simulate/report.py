# SPDX-License-Identifier: Apache-2.0
"""The report of a run, ``report.json``, and the lines that are printed of it."""

from pydantic import BaseModel, ConfigDict

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.names import BoardName, Chain
from plenofir.fpga.screen.board_frames import ShownReport
from plenofir.refocus import Border
from plenofir.refocus.arithmetic import Arithmetic

REPORT = "report.json"


class SliceReport(BaseModel):
    """What ``report.json`` holds of each slice; docs/simulation.md explains the fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    a: str
    shift: int
    sharpening: str
    box: int
    pictures: tuple[str, ...]
    mismatches: int
    first_mismatch: str | None
    largest_error: float
    rms_error: float


def agreement(compared: int, mismatches: int, first: str | None) -> str:
    """Whether pixels equal the golden model, for people; `first`: the first that does not."""
    if not mismatches:
        return f"all {compared} pixels equal the golden model"
    return f"{mismatches} of {compared} pixels differ; first: {first}"


class StallReport(BaseModel):
    """What ``report.json`` holds of the run with stalls; docs/simulation.md explains the fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    seed: int
    percent: int
    pixels_compared: int
    mismatches: int
    first_mismatch: str | None

    @property
    def summary(self) -> str:
        """The line that is printed."""
        agree = agreement(self.pixels_compared, self.mismatches, self.first_mismatch)
        return f"seed {self.seed}, up to {self.percent} % of the clocks: {agree}"


class Report(BaseModel):
    """What ``report.json`` holds; docs/simulation.md explains the fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    raw: str
    chain: Chain
    board: BoardName | None
    M: int
    slices: tuple[SliceReport, ...]
    columns: int
    rows: int
    channels: int
    pixel_bits: int
    engine: str
    parallel_rows: int
    pixels_per_clock: int
    interpolation: int
    border: Border
    pixels_compared: int
    mismatches: int
    clocks: int
    clocks_per_pixel: float
    latency_clocks: int | None
    simulated_clocks_per_second: int
    simulator: str
    arithmetic: Arithmetic
    error_bound: float
    taps: int
    line_buffer_bits: int
    stalls: StallReport | None = None

    @property
    def agrees(self) -> bool:
        """Whether all pixels equal the golden model, with stalls too."""
        return not self.mismatches and not (self.stalls and self.stalls.mismatches)


class ScreenReport(Report):
    """What ``report.json`` holds of a board that shows more than its slices besides."""

    shown: tuple[ShownReport, ...]


class CsiReport(Report):
    """What ``report.json`` holds of frames that came over MIPI CSI-2 besides."""

    lanes: int
    format: str
    packets: int
    packet_bytes: int
    faults: int


class StackReport(Report):
    """What ``report.json`` holds of a stack and its depth index besides."""

    pictures: tuple[str, ...]
    radius: int
    micro_images_of_slice: tuple[int, ...]
    history_bits: int
    slice_bits: int
    waiting_bits: int
    sharpness_bits: int


def _weights(report: Report) -> str:
    return "b = " + " ".join(slice_.sharpening for slice_ in report.slices)


def report_summary(core: CoreConfiguration, report: Report) -> list[tuple[str, str]]:
    """Name and value of each line that is printed of a report."""
    wrong = next((s for s in report.slices if s.mismatches), None)
    agree = f"all {report.pixels_compared} pixels equal the golden model"
    if report.mismatches:
        first = f"first: a = {wrong.a}, {wrong.first_mismatch}" if wrong else "none in a slice"
        of_screen = report.shown if isinstance(report, ScreenReport) and not wrong else ()
        if other := next((s for s in of_screen if s.mismatches), None):
            first = f"first: {other.picture}, {other.first_mismatch}"
        agree = f"{report.mismatches} of {report.pixels_compared} pixels differ; {first}"
    depth = f"{report.channels} x {report.pixel_bits} bit"
    # A board may show depth alone, or what is sharp everywhere.
    focus = [f"a = {' '.join(slice_.a for slice_ in report.slices)}"] if report.slices else []
    if core.smaller_box and focus:
        focus += [f"box {' '.join(map(str, sorted({slice_.box for slice_ in report.slices})))}"]
    order = f", interpolation of order {report.interpolation}" if report.interpolation else ""
    largest = max((slice_.largest_error for slice_ in report.slices), default=0)
    rms = max((slice_.rms_error for slice_ in report.slices), default=0)
    errors = f"largest {largest:.4f}, RMS {rms:.4f} grey levels (bound {report.error_bound:.4f})"
    latency = "" if report.latency_clocks is None else f", latency {report.latency_clocks}"
    lines = [
        ("image", f"{report.raw}, {report.columns} x {report.rows}, {depth}"),
        ("focus", ", ".join([f"M = {report.M}", *focus, core.engine.summary(core)]) + order),
        *([("sharpening", _weights(report))] if core.sharpens else []),
        ("arithmetic", report.arithmetic.kind),
        *([("border", report.border)] if core.normalises else []),
        *([("chain", f"{report.board}, serial TMDS bits in and out")] if report.board else []),
        *(
            [("chain", f"CSI-2, {report.lanes} lanes, {report.packets} packets of {report.format}")]
            if isinstance(report, CsiReport)
            else []
        ),
        ("result", agree),
        *([] if report.stalls is None else [("stalls", report.stalls.summary)]),
        *([("error", errors)] if report.slices else []),
        ("clocks", f"{report.clocks}, {report.clocks_per_pixel:g} for each pixel{latency}"),
        (
            "simulator",
            f"{report.simulator}, {report.simulated_clocks_per_second} clocks a second",
        ),
    ]
    pictures = [name for slice_ in report.slices for name in slice_.pictures]
    if isinstance(report, ScreenReport):
        pictures += [entry.picture for entry in report.shown]
    if isinstance(report, StackReport):
        # Each slice may have come twice, with two boxes.
        counts = report.micro_images_of_slice
        once = report.slices[:: len(report.slices) // len(counts)]
        for slice_, count in zip(once, counts, strict=True):
            lines.append((f"a = {slice_.a}", f"sharpest in {count} micro images"))
        parts = {
            "shared": report.history_bits,
            "of the slices": report.slice_bits,
            "waiting": report.waiting_bits,
            "judged": report.sharpness_bits,
        }
        kbit = ", ".join(f"{bits / 1024:.0f} {name}" for name, bits in parts.items())
        lines.append(("memory", f"kbit: {kbit}"))
        pictures += report.pictures
    return [*lines, ("files", ", ".join([*pictures, REPORT]))]
