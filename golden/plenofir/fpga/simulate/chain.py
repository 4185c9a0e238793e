# SPDX-License-Identifier: Apache-2.0
"""Frames through the whole board, serial bits in and out (``tb/file_bench/hdmi_bench.vhd``)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.boards import BOARDS, Board
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import Scope, within
from plenofir.fpga.hdmi.link import LinkError, Packed, ReceivedFrame, decode_frames, encode_frames
from plenofir.fpga.hdmi.modes import VideoMode, find_mode, range_limits
from plenofir.fpga.hdmi.script import Code, Command, pixel_period, write_script
from plenofir.fpga.names import DEFAULT_BOARD
from plenofir.fpga.screen.board_frames import ShownFrame, commands_before, shown_frames
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.simulate.waves import wave_signals_of
from plenofir.fpga.tools.simulators import SimulationError, Simulator, Waves
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

TOP = "hdmi_bench"

FRAMES_TO_FOLLOW = 3
"""Whole frames that the video path measures before it follows."""

# The clock meter's window, in 10 ns: a hundredth of the board's.
METER_WINDOW = 1600
# Blanking in ns that is sent first, in which clocks, word phases and sampling phases settle.
SETTLE_NS = 250_000
# Time of a character on the bench's serial port.
_LETTER_US = 1
# Lines after the last frame: the latency of the link, and the beginning of the next frame.
LINES_BEHIND = 3

# Only signals that are no records: others are not in a dump of GHDL that GTKWave shows.
_VIDEO = "path/picture/"
_RASTER: tuple[Scope, ...] = (
    ("bit", "", "in_rows in_columns h_pulse v_pulse"),
    ("downto", "", "y x"),
)
_WAVES: tuple[Scope, ...] = (
    ("bit", "", "clk"),
    ("bit", "path/", "run reset"),
    ("downto", "path/", "in_bits aligned wrong_words"),
    *(("downto", f"path/receiver/channel({i})/decoder/", "word octet") for i in range(3)),
    ("downto", "control/settings_to_pixels/", "pixel_together"),
    ("bit", "path/", "following unsupported varying"),
    ("bit", f"{_VIDEO}to_stream/", "frame_start stable start m_axis_tready"),
    ("downto", f"{_VIDEO}to_stream/", "pixel_3"),
    *within(f"{_VIDEO}to_stream/raster", _RASTER),
    *within(f"{_VIDEO}to_video/raster", _RASTER),
    ("bit", f"{_VIDEO}to_video/", "take s_axis_tready"),
    ("downto", "path/", "video_errors out_words"),
)
WAVE_SIGNALS = wave_signals_of(TOP, within("board/top", _WAVES))


def mode_for(columns: int, rows: int) -> VideoMode:
    """Timing for a picture: the standard mode of its size at 60 Hz, else one with reduced blanking.

    The latter is that of VESA CVT 1.2 (version 2), with the pixel clock of 720p60.
    """
    return find_mode(columns, rows, 60) or VideoMode(
        name=f"{columns}x{rows}",
        pixel_clock=74_250,
        h_active=columns,
        h_front=8,
        h_sync=32,
        h_back=40,
        v_active=rows,
        v_front=1,
        v_sync=8,
        v_back=6,
        h_positive=True,
        v_positive=False,
    )


def check_core(configuration: CoreConfiguration) -> None:
    """Refuse a core that a video path cannot have."""

    def refuse(field: str, feature: str, advice: str) -> InputError:
        return InputError(f"{feature} cannot go over HDMI; use {advice}", where=field)

    if configuration.pixel_bits != 8:
        raise refuse("raw", f"a picture with pixels of {configuration.pixel_bits} bits", "8 bits")
    if configuration.sharpens:
        raise refuse("sharpening", "a sharpened picture", "no sharpening, or the chain core")
    if configuration.normalises:
        raise refuse("border", "a normalised border", "zero, or the chain core")
    for field in ("parallel_rows", "pixels_per_clock"):
        if (number := getattr(configuration, field)) != 1:
            feature_text = f"{number} {'rows' if field == 'parallel_rows' else 'pixels'} at once"
            raise refuse(field, feature_text, "1, as a video stream brings one pixel a clock")
    if configuration.engine != configuration.engine.for_video():
        raise refuse(
            "any_rows",
            "a core for any number of rows",
            "none, as video has blank lines in any case",
        )


def check_chain(
    configuration: CoreConfiguration, rows: int, columns: int, screen: Screen | None = None
) -> None:
    """Refuse frames that the board's video path cannot carry."""
    screen = screen or Screen()
    check_core(configuration)
    mode = mode_for(columns, rows)
    lines, pixels = screen.delay_lines(configuration), screen.delay_pixels(configuration)
    if screen.needs_stack:
        # A depth index needs these lines.
        pixels = max(pixels, screen.index(configuration).band_steps(columns) - 1)
    if mode.v_total <= lines or mode.h_total <= pixels:
        raise InputError(
            f"the delay of {lines} lines and {pixels} pixels is longer than a frame of "
            f"{mode.v_total} lines of {mode.h_total} pixels, blanking included; use "
            "focus settings a closer to 1/M, or a larger picture",
            where="shifts",
        )
    scripts = commands_before(shown_frames(configuration, screen), screen)
    letters = max((len(commands) for commands in scripts[1:]), default=0)
    spare = max(mode.v_total - lines - LINES_BEHIND, 0)
    if spare * mode.h_total * 1000 < letters * _LETTER_US * mode.pixel_clock:
        raise InputError(
            f"a frame of {mode.v_total} lines of {mode.h_total} pixels, blanking "
            f"included, leaves {spare} lines beside the {lines} of delay to tell what the "
            "next frame shows; use a picture of more lines",
            where="raw",
        )


def range_of(board: Board, mode: VideoMode) -> int:
    """Range of pixel clocks to build a board for so that it accepts a mode, offered or not."""
    for clock_range in board.clock_ranges:
        low, high = range_limits(clock_range)
        if low <= mode.pixel_clock <= high:
            return clock_range
    raise InputError(
        f"has no pixel clock of {mode.pixel_clock / 1000:g} MHz ({mode.name}); its "
        f"modes are {', '.join(offered.name for offered in board.modes)}",
        where=board.title,
    )


def chain_sources(board: str = DEFAULT_BOARD) -> list[Path]:
    """VHDL files of the bench and a board, in order of analysis."""
    return [*hdl.board_sources(board), *bench_around(board)]


def bench_around(board: str = DEFAULT_BOARD) -> list[Path]:
    """VHDL files of the bench alone."""
    bench = project.root() / "tb" / "file_bench"
    names = ("tmds_monitor", "board_under_test", f"board_{board}", TOP)
    return [bench / f"{name}.vhd" for name in names]


@dataclass(frozen=True)
class BoardRun:
    """Input of a board, and where in its output the result is."""

    board: str
    mode: VideoMode
    core: CoreConfiguration  # of the generics of its top
    packages: Mapping[str, str]  # VHDL packages in place of the board's own: name to text
    script: Sequence[Command | Packed]  # words and commands after the settling time
    frame_count: int  # frames to find at the end
    sweeps: bool  # the board goes through its slices
    delay_pixels: int  # from input to output, whole lines included
    behind: int  # words after the last of these frames
    progress: Callable[[float], None]  # called with the finished share

    def run(
        self, simulator: Simulator, directory: Path, waves: Waves | None = None
    ) -> tuple[list[ReceivedFrame], int, int, float]:
        """Frames at the output, words sent, clocks from input to output, and seconds.

        SimulationError if the signal at the output is not the one expected.
        """
        words = sum(part.size for part in self.script if not isinstance(part, Command))
        directory.mkdir(parents=True, exist_ok=True)
        output = directory / "output.bin"
        settled = [pixel_period(self.mode), Command(Code.CLOCK, 1), Command(Code.WAIT, SETTLE_NS)]
        write_script(directory / "input.bin", [*settled, *self.script])
        for name, text in self.packages.items():
            (directory / f"{name}.vhd").write_text(text)
        board = BOARDS[self.board]

        def poll() -> None:
            if output.exists():
                self.progress(min(output.stat().st_size / (4 * words), 1))

        seconds = simulator.simulate(
            [
                directory / source.name if source.stem in self.packages else source
                for source in chain_sources(self.board)
            ],
            TOP,
            {
                **board_generics(self.core, board.top),
                "AUTO_START": True,
                "SWEEP": self.sweeps,
                "METER_WINDOW": METER_WINDOW,
                "CLOCK_RANGE": range_of(board, self.mode),
            },
            directory,
            models=hdl.model_sources(board.library),
            waves=waves,
            poll=poll,
        )
        received = np.fromfile(output, "<u4")
        # Both signals end at the same time; before the first frame followed there is only blanking.
        sent_to_end = self.frame_count * self.mode.h_total * self.mode.v_total + self.behind
        shown_to_end = sent_to_end - self.delay_pixels
        try:
            frames = decode_frames(received[-shown_to_end - self.mode.h_total :], from_start=True)
        except LinkError as error:
            raise SimulationError(f"no picture at the output: {error}") from None
        expected = self.mode.as_measured()
        if len(frames) != self.frame_count or any(frame.mode != expected for frame in frames):
            sizes = ", ".join(
                f"{frame.mode.h_active} x {frame.mode.v_active} in "
                f"{frame.mode.h_total} x {frame.mode.v_total}"
                for frame in frames
            )
            raise SimulationError(
                f"{self.frame_count} frames of {self.mode.name} expected, found: {sizes or 'none'}"
            )
        return frames, words, sent_to_end - frames[0].to_end, seconds


def run_chain(
    simulator: Simulator,
    configuration: CoreConfiguration,
    raw: Image,
    directory: Path,
    waves: Waves | None = None,
    progress: Callable[[int], None] | None = None,
    board: str = DEFAULT_BOARD,
    screen: Screen | None = None,
    entries: tuple[ShownFrame, ...] | None = None,
) -> BenchResult:
    """Show a picture at the board's input and take what its output shows.

    The source shows the same picture (rows, columns, 3), uint8, all the time; with several shifts
    the board sweeps through them, one frame each. With a screen, commands over the serial port
    choose what it shows: `entries`, or else `shown_frames`. `directory` is empty; `progress` is
    called with the number of pixels that came out so far, blanking included in proportion.

    The result has one frame for each slice or each of `entries`; clocks are pixel clocks, and
    the latency is accurate to one or two of them. SimulationError if the output signal is not as
    expected.
    """
    rows, columns = raw.shape[:2]
    mode = mode_for(columns, rows)
    screen = screen or Screen()
    slices = len(configuration.shifts)
    frame = encode_frames(mode, [raw.astype(np.uint8)])
    lines = screen.delay_lines(configuration)
    begun = (lines + LINES_BEHIND) * mode.h_total
    if entries is None:
        entries = shown_frames(configuration, screen)
    count = len(entries) or slices
    script: list[Command | Packed] = [*commands_before(entries, screen)[0]] if entries else []
    script.append(np.concatenate([frame] * FRAMES_TO_FOLLOW))
    # The commands for the next frame are sent once this one has begun to come out.
    for commands in commands_before(entries, screen)[1:]:
        script += [frame[:begun], *commands, frame[begun:]]
    script.append(np.concatenate([frame] * (1 if entries else count)))
    script.append(np.resize(frame, begun))
    frames, words, latency, seconds = BoardRun(
        board=board,
        mode=mode,
        core=configuration,
        packages={} if screen == Screen() else {SCREEN_PACKAGE: screen_package(screen)},
        script=script,
        frame_count=count,
        sweeps=slices > 1 and not entries,
        delay_pixels=lines * mode.h_total + configuration.delay,
        behind=begun,
        progress=in_pixels(progress, slices * rows * columns),
    ).run(simulator, directory, waves)
    return BenchResult(
        frames=np.stack([picture.pixels for picture in frames]),
        clocks=words,
        input_clocks=slices * rows * columns,
        latency_clocks=latency,
        slices=tuple(range(slices)),
        seconds=seconds,
    )


def in_pixels(progress: Callable[[int], None] | None, pixels: int) -> Callable[[float], None]:
    """Progress in pixels, from a share of them all."""
    return lambda share: None if progress is None else progress(int(share * pixels))
