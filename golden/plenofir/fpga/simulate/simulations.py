# SPDX-License-Identifier: Apache-2.0
"""The simulations: a raster core, a focal stack, a board from serial bits to serial bits.

`simulation_of` chooses the `Simulation`. Others are classes that are passed to
`plenofir.fpga.simulate.run.run`, as for a sensor's raw frames (`plenofir.plan.sensor`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plenofir.fpga.boards import BOARDS
from plenofir.fpga.compare import compare_frames
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.names import SLICE_ENGINE_NAMES
from plenofir.fpga.screen.board_frames import bare_slices, shown_frames, shown_names, write_shown
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.simulate import chain
from plenofir.fpga.simulate.file_bench import BenchResult, run_bench, wave_signals
from plenofir.fpga.simulate.report import Report, ScreenReport, StackReport, StallReport
from plenofir.fpga.simulate.request import Run, picture_names
from plenofir.fpga.simulate.stalls import run_stalled, stalled_part
from plenofir.fpga.simulate.waves import WaveSignal
from plenofir.fpga.tools.simulators import SimulationError, Simulator, Waves
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, write_png
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import (
    FRACTION_BITS,
    TEXTURE,
    confidence_level,
    depth_between_picture,
    depth_index_picture,
    has_order,
)

ALL_IN_FOCUS = "all_in_focus.png"
DEPTH_INDEX = "depth_index.png"
DEPTH, CONFIDENCE = "depth.png", "confidence.png"
_ONE_SLICE = " or ".join(SLICE_ENGINE_NAMES)


def depth_index_of(core: CoreConfiguration, screen: Screen) -> DepthIndexConfiguration:
    """The depth index behind a stack; InputError if there can be none."""
    if core.micro_image_size < 2:
        raise InputError(
            f"M = {core.micro_image_size} is too small for a depth index: a pixel alone "
            "has no sharpness; use 2 or more",
            where="micro_image_size",
        )
    index = screen.index(core)
    index.check_limits()
    return index


class Place(NamedTuple):
    """With what and where to simulate."""

    simulator: Simulator
    directory: Path  # made if missing
    waves: Waves | None  # waveform to write
    progress: Callable[[int], None]  # called with pixels that came out


class Simulation(ABC):
    """Simulation of a raw image passing through VHDL."""

    # How progress calls it.
    name = "core"
    # Signals of the waveform.
    wave_signals: tuple[WaveSignal, ...] = ()

    def __init__(self, request: Run, raw: Picture) -> None:
        """Keep the request and its raw image."""
        self.request, self.core, self.picture = request, request.core, raw
        self.raw = raw.pixels

    @property
    def pictures(self) -> list[tuple[str, ...]]:
        """Files of each slice: refocused, golden, difference."""
        shifts = self.core.shifts
        return [picture_names(s, self.core.micro_image_size, len(shifts)) for s in shifts]

    @property
    def more_files(self) -> tuple[str, ...]:
        return ()

    @property
    def frames(self) -> int:
        return len(self.core.shifts)

    def check(self) -> None:
        """Refuse requests that it cannot simulate, before anything is simulated; here none."""
        return

    @abstractmethod
    def run(self, place: Place) -> BenchResult:
        """Simulate."""

    def slices(self, result: BenchResult) -> Image:
        if result.slices != tuple(range(len(self.core.shifts))):
            raise SimulationError(f"the core swept through the slices {result.slices}")
        return result.frames

    def stalled(self, place: Place, seed: int) -> StallReport | None:
        """Simulate a part after `run`, in its folder, with stalls; None: nothing can wait."""
        del place, seed
        return None

    def complete(self, report: Report, result: BenchResult, golden: Image, folder: Path) -> Report:
        """Compare and write results other than the slices, and add them to the report."""
        del result, golden, folder
        return report


class RasterSimulation(Simulation):
    """A raster core, set to one slice after the other."""

    def __init__(self, request: Run, raw: Picture) -> None:
        super().__init__(request, raw)
        self.wave_signals = wave_signals(request.core)

    def run(self, place: Place) -> BenchResult:
        """Pass one frame for each slice through the core."""
        return self._bench(place, self.raw)

    def stalled(self, place: Place, seed: int) -> StallReport:
        part = stalled_part(self.raw, self.core.micro_image_size)
        return run_stalled(
            seed,
            lambda percent, seed: self._bench(place, part, percent, seed),
            lambda result: [(self.slices(result), self.core.golden(part))],
        )

    def _bench(self, place: Place, raw: Image, percent: int = 0, seed: int = 1) -> BenchResult:
        frames = np.stack([raw] * self.frames)
        return run_bench(
            *(place.simulator, self.core, frames, place.directory),
            sweep_frames=1 if len(frames) > 1 else 0,
            stall_percent=percent,
            seed=seed,
            waves=place.waves,
            built=percent > 0,
            progress=place.progress,
        )


class StackSimulation(Simulation):
    """A focal stack, all slices at once, and the depth index behind it."""

    more_files: tuple[str, ...] = (DEPTH_INDEX,)
    frames = 1

    def __init__(self, request: Run, raw: Picture) -> None:
        super().__init__(request, raw)
        # The scene's depth index, or one with the radius of the request.
        core = request.core
        between = len(core.shifts) > 2 and has_order(core.shifts)
        level = confidence_level(
            TEXTURE, core.micro_image_size, request.radius, core.channels, core.pixel_bits
        )
        screen = Screen(radius=request.radius, confidence=level if between else 0, between=between)
        self.depth = depth_index_of(core, request.screen if request.screen.needs_index else screen)
        if self.depth.picture:
            self.more_files = (ALL_IN_FOCUS, *self.more_files)
        if self.depth.shifts:
            self.more_files += (DEPTH, CONFIDENCE)
        self.wave_signals = wave_signals(core, self.depth)

    @property
    def pictures(self) -> list[tuple[str, ...]]:
        """The refocused picture of each slice and box, always with a in its name."""
        m, names = self.core.micro_image_size, list[tuple[str, ...]]()
        for shift, box in zip(self.core.shifts, self.core.slice_boxes, strict=True):
            name = picture_names(shift, m, 2)[0]
            # A slice comes twice if it has two boxes, the smaller one second.
            again = (name,) in names
            names.append((name.replace(".png", f"_box{box}.png") if again else name,))
        return names

    def run(self, place: Place) -> BenchResult:
        """Pass one frame through the stack."""
        return self._bench(place, self.raw)

    def stalled(self, place: Place, seed: int) -> StallReport:
        part = stalled_part(self.raw, self.core.micro_image_size)
        golden = self.core.golden(part)
        return run_stalled(
            seed,
            lambda percent, seed: self._bench(place, part, percent, seed),
            lambda result: [(self.slices(result), golden), *self._judged(result, golden)],
        )

    def _bench(self, place: Place, raw: Image, percent: int = 0, seed: int = 1) -> BenchResult:
        return run_bench(
            *(place.simulator, self.core, raw[np.newaxis], place.directory),
            index=self.depth,
            stall_percent=percent,
            seed=seed,
            waves=place.waves,
            built=percent > 0,
            progress=place.progress,
        )

    def _judged(self, result: BenchResult, golden: Image) -> list[tuple[Image, Image]]:
        """What the depth index gave, and what it has to give: frames of one picture each."""
        assert result.index is not None
        m, want = self.core.micro_image_size, self.depth.golden(golden)
        rows, columns = golden.shape[1:3]

        def of_pixels(lenses: Image) -> Image:
            return lenses.repeat(m, 0).repeat(m, 1)[np.newaxis, :rows, :columns]

        pairs: list[tuple[Image, Image]] = [(result.index, of_pixels(want.index))]
        if self.depth.picture:
            pairs.append((result.frames, want.image[np.newaxis]))
        if want.fraction is not None and want.confidence is not None:
            assert result.depth is not None
            between = want.confidence.astype(np.uint16) << FRACTION_BITS | want.fraction
            pairs.append((result.depth, of_pixels(between)))
        return pairs

    def slices(self, result: BenchResult) -> Image:
        assert result.stacks is not None
        stack: Image = result.stacks[0]
        return stack

    def complete(self, report: Report, result: BenchResult, golden: Image, folder: Path) -> Report:
        """Compare the depth index and the picture that is all in focus, and write both."""
        assert isinstance(self.core.engine, StackEngine)
        assert result.index is not None
        image, index, m, depth = result.frames[0], result.index[0], report.M, self.depth
        if depth.picture:
            write_png(folder / ALL_IN_FOCUS, self.picture.like(image))
        write_png(folder / DEPTH_INDEX, depth_index_picture(index, depth.slices))
        if depth.shifts:
            assert result.depth is not None
            sure, fraction = (
                part.astype(np.uint8) for part in np.divmod(result.depth[0], 1 << FRACTION_BITS)
            )
            write_png(folder / DEPTH, depth_between_picture(index, fraction, depth.slices))
            write_png(folder / CONFIDENCE, sure)
        comparisons = [compare_frames(*pair) for pair in self._judged(result, golden)]
        waiting, judged = depth.memory_bits
        counted = np.bincount(index[::m, ::m].ravel(), minlength=depth.slices)
        more = {
            "pixels_compared": report.pixels_compared + sum(part.pixels for part in comparisons),
            "mismatches": report.mismatches + sum(part.mismatches for part in comparisons),
        }
        return StackReport(
            **{**dict(report), **more},
            pictures=self.more_files,
            radius=depth.radius,
            micro_images_of_slice=tuple(counted.tolist()),
            history_bits=self.core.engine.history_bits(self.core),
            slice_bits=self.core.engine.slice_bits(self.core),
            waiting_bits=waiting,
            sharpness_bits=judged,
        )


class BoardSimulation(Simulation):
    """A whole board, serial bits in and out, with what its screen shows besides the slices."""

    name = "board"
    wave_signals = chain.WAVE_SIGNALS

    def __init__(self, request: Run, raw: Picture) -> None:
        super().__init__(request, raw)
        self.shown = shown_frames(self.core, request.screen)

    @property
    def pictures(self) -> list[tuple[str, ...]]:
        """Pictures of a core, if plain slices are shown."""
        has_slices = not self.shown or bare_slices(self.request.screen, self.shown)
        return super().pictures if has_slices else []

    @property
    def more_files(self) -> tuple[str, ...]:
        return shown_names(self.core, self.request.screen)

    def check(self) -> None:
        """Refuse frames that the video path cannot carry."""
        if isinstance(self.core.engine, StackEngine):
            if not self.request.screen.needs_stack:
                raise InputError(
                    "a board shows one slice at a time, a focal stack gives all; use engine "
                    f"{_ONE_SLICE}, or a scene whose screen shows depth",
                    where="chain",
                )
            depth_index_of(self.core, self.request.screen)
        rows, columns = self.raw.shape[:2]
        chain.check_chain(self.core, rows, columns, self.request.screen)
        chain.range_of(BOARDS[self.request.board], chain.mode_for(columns, rows))

    def run(self, place: Place) -> BenchResult:
        """Show the raw image at the input and capture the output."""
        request = self.request
        return chain.run_chain(
            *(place.simulator, self.core, self.raw, *place[1:], request.board, request.screen)
        )

    def slices(self, result: BenchResult) -> Image:
        """Frames that show a plain slice."""
        if not self.shown:
            return super().slices(result)
        bare: Image = result.frames[bare_slices(self.request.screen, self.shown)]
        return bare

    def complete(self, report: Report, result: BenchResult, golden: Image, folder: Path) -> Report:
        """Compare the outputs besides the slices, and write them."""
        if not self.shown:
            return report
        frames = write_shown(self.core, self.request.screen, result.frames, golden, folder)
        pixels = report.rows * report.columns * len(frames)
        more = {
            "pixels_compared": report.pixels_compared + pixels,
            "mismatches": report.mismatches + sum(part.mismatches for part in frames),
        }
        return ScreenReport(**{**dict(report), **more}, shown=frames)


def simulation_of(request: Run, raw: Picture) -> Simulation:
    if request.chain == "hdmi":
        return BoardSimulation(request, raw)
    stack = isinstance(request.core.engine, StackEngine)
    return (StackSimulation if stack else RasterSimulation)(request, raw)
