# SPDX-License-Identifier: Apache-2.0
"""Raw frames of a sensor over MIPI CSI-2, from the bytes of a D-PHY's lanes to the picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import Scope, within
from plenofir.fpga.csi import LANES, RAW_BITS, frame_packets, lane_clocks
from plenofir.fpga.simulate.file_bench import (
    BenchResult,
    bench_sources,
    core_generics,
    core_sources,
    core_waves,
    output_poll,
    stream_waves,
)
from plenofir.fpga.simulate.report import CsiReport, Report, StallReport
from plenofir.fpga.simulate.request import Run
from plenofir.fpga.simulate.simulations import Place, Simulation
from plenofir.fpga.simulate.stalls import run_stalled
from plenofir.fpga.simulate.waves import WaveSignal, wave_signals_of
from plenofir.fpga.tools.simulators import SimulationError
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration
from plenofir.plan.sensor.sensor_bench import WAVES, load_words
from plenofir.refocus.operator import Image

TOP = "csi_bench"
COUNTS = (
    *("headers corrected", "headers damaged", "payloads damaged", "packets cut short"),
    *("bursts that not all lanes began", "packets out of order", "wrong sizes", "frames cut"),
    *("packets of other types", "packets of other channels", "frames without lines"),
    "packets without pixels",
)
"""What `csi_receiver` counts: faults, then what it leaves out."""
# Clock periods of core and lanes in ps. A raw pixel comes every other clock of the core, which
# stands for a sensor's blanking.
_CLOCK_PS = 10_000
_CLOCKS_PER_PIXEL = 2
# Clocks of the lanes between packets; lines of the raster between frames in addition to the core's.
_GAP = 24
_BLANK_LINES = 16
# Generics that have other names in the bench, where the core has them too.
_RECEIVER_WAVES: tuple[Scope, ...] = (
    ("downto", "merge/", "active"),
    ("bit", "", "word_first"),
    ("downto", "", "word_live word_data"),
    ("bit", "parser/", "header_full known known_bad busy is_line frame_open crc_wrong"),
    ("downto", "parser/", "header facts left"),
    ("downto", "", "payload_data pixels_data"),
    ("bit", "", "write_enable full"),
    ("downto", "", "write_data"),
    ("bit", "", "read_valid read_ready"),
    ("downto", "", "read_word"),
    ("bit", "stream/", "running"),
    ("downto", "stream/", "pixels lines"),
)
_RENAMED = {
    "PIXEL_BITS": "RAW_BITS",
    "MAX_COLUMNS": "RAW_COLUMNS",
    "FRACTION_BITS": "RAW_FRACTION_BITS",
    "GUARD_BITS": "RAW_GUARD_BITS",
}


def wave_signals(core: CoreConfiguration) -> tuple[WaveSignal, ...]:
    """Signals in a waveform of a camera's lanes, receiver, resampler and core."""
    return wave_signals_of(
        TOP,
        (
            ("bit", "", "byte_clk clk reset"),
            ("downto", "", "lane_valid lane_sync lane_data"),
            *within("receiver", _RECEIVER_WAVES),
            *stream_waves("raw"),
            *within("sensor", WAVES),
            *stream_waves("raster"),
            *within("design", core_waves(core)),
            ("bit", "", "m_axis_tvalid m_axis_tready"),
            ("downto", "", "m_axis_tdata m_axis_tuser m_axis_tid"),
            ("bit", "", "m_axis_tlast"),
            ("downto", "", "fault_counts left_counts left_out sensor_flags error_flags"),
        ),
    )


@dataclass(frozen=True)
class CsiFrame:
    """A sensor's raw frame, the resampler for it, and the lanes that it comes on."""

    resampler: ResamplerConfiguration
    loads: tuple[Load, ...]
    red_place: tuple[int, int] | None  # of a mosaic
    raw: Image  # shape (rows, columns)
    bits: int  # of a pixel: 8, 10 or 12
    lanes: int
    where: str  # what messages call the capture

    def __post_init__(self) -> None:
        """Refuse pixels that do not fit raw packets."""
        if self.raw.ndim == 3:
            raise InputError(
                "has colours; a sensor's lines have one channel, grey or a mosaic",
                where=self.where,
            )
        if self.bits not in RAW_BITS:
            raise InputError(
                f"has values up to {(1 << self.bits) - 1}; RAW8, RAW10 and RAW12 have 8, 10 and 12 "
                "bits",
                where=self.where,
            )
        if self.lanes not in LANES:
            raise InputError(f"there are 1, 2 or 4 lanes, not {self.lanes}", where="lanes")

    @property
    def lines(self) -> int:
        """Raw lines in the resampler's ring."""
        return self.resampler.lines

    @property
    def byte_ps(self) -> int:
        pixels = 8 * self.lanes / self.bits
        return 2 * round(_CLOCKS_PER_PIXEL * pixels * _CLOCK_PS / 2)

    def simulation(self, what: Run, raster: Picture) -> Simulation:
        """Simulation of this frame; the raw image is its raster by the model."""
        return CsiSimulation(what, raster, self)


class CsiSimulation(Simulation):
    """Simulation in which the frame comes over the lanes, once for each slice."""

    name = "from CSI-2"

    def __init__(self, what: Run, raw: Picture, frame: CsiFrame) -> None:
        super().__init__(what, raw)
        self.frame = frame
        self.wave_signals = wave_signals(what.core)
        self.packets = [
            frame_packets(frame.raw, frame.bits, number=number + 1) for number in range(self.frames)
        ]

    def run(self, place: Place) -> BenchResult:
        """Send the frame for each slice and capture the core's output."""
        return self._bench(place, self.frames)

    def stalled(self, place: Place, seed: int) -> StallReport:
        """Send a frame at half the rate, as no camera waits while the sink stalls."""
        golden = self.core.golden(self.raw)[:1]
        return run_stalled(
            seed,
            lambda percent, seed: self._bench(place, 1, percent, seed),
            lambda result: [(result.frames, golden)],
        )

    def _bench(self, place: Place, frames: int, percent: int = 0, seed: int = 1) -> BenchResult:
        directory, frame, core = place.directory, self.frame, self.core
        rows, columns = self.raw.shape[:2]
        directory.mkdir(parents=True, exist_ok=True)
        clocks = self._clocks(frame, self.packets[:frames])
        clocks.astype("<i4").tofile(directory / "input.bin")
        words = load_words(frame.loads)
        words.tofile(directory / "loads.bin")
        output = directory / "output.bin"
        ours = {k: v for k, v in frame.resampler.generics().items() if k != "CHANNELS"}
        red = frame.red_place
        seconds = place.simulator.simulate(
            [*core_sources(), *bench_sources(TOP)],
            TOP,
            {
                **{_RENAMED.get(name, name): value for name, value in ours.items()},
                **{k: v for k, v in core_generics(core).items() if k != "INPUT_LINES"},
                "LANES": frame.lanes,
                "MOSAIC": red is not None,
                "RED_PLACE": 0 if red is None else 2 * red[0] + red[1],
                "BYTE_PS": frame.byte_ps * (2 if percent else 1),
                "CLOCKS": len(clocks),
                "LOADS": len(words),
                "RAW_ROWS": frame.raw.shape[0],
                "COLUMNS": columns,
                "ROWS": rows,
                "FRAMES": frames,
                "SWEEP_FRAMES": 1 if frames > 1 else 0,
                "STALL_PERCENT": percent,
                "SEED": seed,
            },
            directory,
            built=percent > 0,
            waves=place.waves,
            poll=output_poll(output, core.channels, place.progress),
        )
        lines = (directory / "clocks.txt").read_text(encoding="utf-8").splitlines()
        pairs = [(name, int(value)) for name, value in map(str.split, lines)]
        counts = dict(pairs)
        _check(counts, [value for name, value in pairs if name == "count"], frames, self.raw)
        shape = (frames, *self.raw.shape)
        return BenchResult(
            frames=np.fromfile(output, "<i4").reshape(shape).astype(self.raw.dtype),
            clocks=counts["clocks"],
            input_clocks=counts["input_clocks"],
            latency_clocks=counts["latency"],
            slices=tuple(value for name, value in pairs if name == "slice"),
            seconds=seconds,
        )

    def _clocks(self, frame: CsiFrame, packets: Sequence[Sequence[bytes]]) -> Image:
        """Clocks of the lanes: packets, each lane a clock later, a gap after each frame."""
        blank = (self.core.delay + _BLANK_LINES) * max(self.raw.shape[1], frame.raw.shape[1])
        gap = np.zeros((blank * _CLOCK_PS // frame.byte_ps, frame.lanes), np.uint16)
        skews = range(frame.lanes)
        parts = [[lane_clocks(p, frame.lanes, skews=skews, gap=_GAP), gap] for p in packets]
        return np.vstack([part for pair in parts for part in pair])

    def complete(self, report: Report, result: BenchResult, golden: Image, folder: Path) -> Report:
        """Add the packets on the lanes to the report."""
        del result, golden, folder
        sent = [packet for packets in self.packets for packet in packets]
        return CsiReport(
            **dict(report),
            lanes=self.frame.lanes,
            format=f"RAW{self.frame.bits}",
            packets=len(sent),
            packet_bytes=sum(map(len, sent)),
            faults=0,
        )


def _check(counts: dict[str, int], reported: Sequence[int], frames: int, raw: Image) -> None:
    """Refuse pixels that are missing or wrongly framed, and whatever the receiver counts."""
    pixels = frames * raw.shape[0] * raw.shape[1]
    texts = [f"{count} {name}" for count, name in zip(reported, COUNTS, strict=True) if count]
    if identifier := counts["left_out"]:
        texts.append(f"left out last: type {identifier % 64} of channel {identifier // 64}")
    if texts or counts["received"] != pixels:
        raise SimulationError(
            f"{counts['received']} of {pixels} pixels received, {counts['accepted']} raw ones "
            f"accepted; the receiver counts: {', '.join(texts) or 'nothing'}"
        )
    if counts["framing_errors"] or counts["error_flags"]:
        raise SimulationError(
            f"{counts['framing_errors']} pixels with wrong tuser or tlast, "
            f"error flags {counts['error_flags']:011b}"
        )
