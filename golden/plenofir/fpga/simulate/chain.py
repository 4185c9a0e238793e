# SPDX-License-Identifier: Apache-2.0
"""Frames through the whole board, serial bits in and out (``tb/file_bench/hdmi_bench.vhd``)."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from plenofir import project
from plenofir.errors import InputError
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.boards import BOARDS, Board
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import SignalKind
from plenofir.fpga.hdmi.link import LinkError, Packed, decode_frames, encode_frames
from plenofir.fpga.hdmi.modes import VideoMode, find_mode, range_limits
from plenofir.fpga.hdmi.script import Code, Command, pixel_period, write_script
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.fpga.screen.shown import ShownFrame, shown_frames, told_before
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.simulate.waves import WaveSignal
from plenofir.fpga.tools.simulators import SimulationError, Simulator
from plenofir.refocus.operator import Image

TOP = "hdmi_bench"

FRAMES_TO_FOLLOW = 3
"""Whole frames that the video path measures before it follows."""

# The clock meter's window, in 10 ns: a hundredth of the board's.
METER_WINDOW = 1600
# Blanking that is sent first, in ns: clocks, word phases and sampling phases settle.
SETTLE_NS = 250_000
# A character over the serial port of the bench.
_LETTER_US = 1
# Lines behind the last frame: what the link itself holds, and the beginning of the next frame.
LINES_BEHIND = 3

_BIT: SignalKind = "bit"
_DOWNTO: SignalKind = "downto"
WAVE_SIGNALS = tuple(
    WaveSignal(f"/{TOP}/board/top/{name}", kind)
    for kind, names in (
        (_BIT, "clk run path/reset path/link_locked path/link_error"),
        (_DOWNTO, "path/link_aligned"),
        (_BIT, "path/video_active path/video_h_sync path/video_v_sync"),
        (_DOWNTO, "path/video_pixel control/settings_to_pixels/pixel_together"),
        (_BIT, "path/following path/shown_active path/shown_h_sync path/shown_v_sync"),
        (_DOWNTO, "path/shown_pixel path/video_errors"),
    )
    for name in names.split()
)


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


def check_chain(
    configuration: CoreConfiguration, rows: int, columns: int, screen: Screen | None = None
) -> None:
    """Refuse what the board's video path cannot carry."""
    screen = screen or Screen()
    if configuration.pixel_bits != 8:
        raise InputError(
            f"pixels of {configuration.pixel_bits} bits", where="raw", expected="8 bits for HDMI"
        )
    if configuration.sharpens:
        raise InputError("is not in the video path", where="sharpening", expected="off for HDMI")
    if configuration.parallel_rows != 1:
        raise InputError(
            f"{configuration.parallel_rows} rows at once",
            where="parallel_rows",
            expected="1 for HDMI: a video stream brings one pixel a clock",
        )
    if configuration.pixels_per_clock != 1:
        raise InputError(
            f"{configuration.pixels_per_clock} pixels a clock",
            where="pixels_per_clock",
            expected="1 for HDMI: a video stream brings one pixel a clock",
        )
    if configuration.engine != configuration.engine.for_video():
        raise InputError(
            "True", where="any_rows", expected="False for HDMI: video has its blanking"
        )
    mode = mode_for(columns, rows)
    lines, pixels = screen.delay_lines(configuration), screen.delay_pixels(configuration)
    if screen.needs_stack:
        # Lines in which a depth index judges.
        pixels = max(pixels, screen.index(configuration).band_steps(columns) - 1)
    if mode.v_total <= lines or mode.h_total <= pixels:
        raise InputError(
            f"a delay of {lines} lines in frames of {mode.v_total} lines of "
            f"{mode.h_total} pixels, blanking included",
            where="shifts",
            expected="a delay shorter than a frame and, with the pipeline, than a line",
        )
    told = told_before(shown_frames(configuration, screen), screen)
    letters = max((len(commands) for commands in told[1:]), default=0)
    left = max(mode.v_total - lines - LINES_BEHIND, 0)
    if left * mode.h_total * 1000 < letters * _LETTER_US * mode.pixel_clock:
        raise InputError(
            f"{mode.v_total} lines of {mode.h_total} pixels, blanking included, and {lines} lines "
            f"of delay: {left} are left to tell what the next frame shows",
            where="raw",
            expected="a picture of more lines",
        )


def range_of(board: Board, mode: VideoMode) -> int:
    """Range of pixel clocks that a board is built for to take a mode, which it need not offer."""
    for clock_range in board.clock_ranges:
        low, high = range_limits(clock_range)
        if low <= mode.pixel_clock <= high:
            return clock_range
    raise InputError(
        f"a pixel clock of {mode.pixel_clock / 1000:g} MHz ({mode.name})",
        where=board.title,
        expected=", ".join(known.name for known in board.modes),
    )


def chain_sources(board: str = "atlys") -> list[Path]:
    """VHDL files of the bench and a board, in order of analysis."""
    bench = project.root() / "tb" / "file_bench"
    return [*hdl.board_sources(board), bench / f"board_{board}.vhd", bench / f"{TOP}.vhd"]


def run_chain(
    simulator: Simulator,
    configuration: CoreConfiguration,
    raw: Image,
    directory: Path,
    waves: Path | None = None,
    progress: Callable[[int], None] | None = None,
    board: str = "atlys",
    screen: Screen | None = None,
    told: tuple[ShownFrame, ...] | None = None,
) -> BenchResult:
    """Show a picture at the board's input and take what its output shows.

    The source shows the same picture (rows, columns, 3), uint8, all the time; with several shifts
    the board sweeps through them, a frame for each. With a screen it is told over its serial port
    what to show: `told`, or else `shown_frames`. `directory` is empty; `progress` is called with
    the number of pixels that came out so far, blanking counted in proportion.

    The result has a frame for each slice, or each that was told; clocks are pixel clocks, the
    latency is known to one or two of them. SimulationError if the signal at the output is not the
    one expected.
    """
    rows, columns = raw.shape[:2]
    mode = mode_for(columns, rows)
    screen = screen or Screen()
    slices = len(configuration.shifts)
    frame = encode_frames(mode, [raw.astype(np.uint8)])
    lines = screen.delay_lines(configuration)
    behind = (lines + LINES_BEHIND) * mode.h_total
    if told is None:
        told = shown_frames(configuration, screen)
    count = len(told) or slices
    script: list[Command | Packed] = [*told_before(told, screen)[0]] if told else []
    script.append(np.concatenate([frame] * FRAMES_TO_FOLLOW))
    # What the next frame shows is told when this one has begun to come out.
    begun = (lines + LINES_BEHIND) * mode.h_total
    for commands in told_before(told, screen)[1:]:
        script += [frame[:begun], *commands, frame[begun:]]
    script.append(np.concatenate([frame] * (1 if told else count)))
    script.append(np.resize(frame, behind))
    words = (FRAMES_TO_FOLLOW + count) * frame.size + behind
    directory.mkdir(parents=True, exist_ok=True)
    output = directory / "output.bin"
    write_script(
        directory / "input.bin",
        [pixel_period(mode), Command(Code.CLOCK, 1), Command(Code.WAIT, SETTLE_NS), *script],
    )
    sources = chain_sources(board)
    if screen != Screen():
        own = directory / f"{SCREEN_PACKAGE}.vhd"
        own.write_text(screen_package(screen))
        sources = [own if source.name == own.name else source for source in sources]
    generics = {
        **board_generics(configuration, BOARDS[board].top),
        "AUTO_START": True,
        "SWEEP": slices > 1 and not told,
        "METER_WINDOW": METER_WINDOW,
    }
    generics["CLOCK_RANGE"] = range_of(BOARDS[board], mode)
    models = hdl.model_sources(BOARDS[board].library)

    def poll() -> None:
        if progress is not None and output.exists():
            share = min(output.stat().st_size / (4 * words), 1)
            progress(int(share * slices * rows * columns))

    for command in simulator.build_commands(sources, TOP, models=models):
        simulator.run(command, directory)
    started = time.perf_counter()
    simulator.run(
        simulator.run_command(
            TOP,
            generics,
            board=True,
            waves=waves,
            wave_signals=[signal.path for signal in WAVE_SIGNALS],
        ),
        directory,
        poll=poll,
    )
    seconds = time.perf_counter() - started

    taken = np.fromfile(output, "<u4")
    # Both signals end at the same time; before the first frame followed there is only blanking.
    sent_to_end = count * frame.size + behind
    shown_to_end = sent_to_end - lines * mode.h_total - configuration.delay
    try:
        frames = decode_frames(taken[-shown_to_end - mode.h_total :], from_start=True)
    except LinkError as error:
        raise SimulationError(f"no picture at the output: {error}") from None
    wanted = mode.as_measured()
    if len(frames) != count or any(shown.mode != wanted for shown in frames):
        found = ", ".join(
            f"{shown.mode.h_active} x {shown.mode.v_active} in "
            f"{shown.mode.h_total} x {shown.mode.v_total}"
            for shown in frames
        )
        raise SimulationError(f"{count} frames of {mode.name} expected, found: {found or 'none'}")
    latency = sent_to_end - frames[0].to_end
    return BenchResult(
        frames=np.stack([shown.pixels for shown in frames]),
        clocks=words,
        input_clocks=slices * rows * columns,
        latency_clocks=latency,
        slices=tuple(range(slices)),
        seconds=seconds,
    )
