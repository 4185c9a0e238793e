# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the whole board: buttons, switches and the serial port.

The bench of the chain imports them, so that one simulation is enough.
"""

from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import Timer

from plenofir.fpga.hdmi.link import encode_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.script import Code, Command
from plenofir_tb import sources, video
from plenofir_tb.board import Board, ask, fast, signal
from plenofir_tb.case import read_case
from plenofir_tb.hdmi.packets import ColourSpace
from plenofir_tb.hdmi.status import parse_status
from plenofir_tb.serial import last_frames
from plenofir_tb.sources import LIMITED_YCBCR, hdmi_source
from plenofir_tb.video import in_the_middle, light_field

MODE_FAST, MODE_HDMI = fast(video.MODE_720), fast(sources.MODE_HDMI)


@cocotb.test()
async def commands_and_status(dut: Any) -> None:
    """The serial port: status before and with a signal of HDMI, pass-through, errors."""
    bench = Board(dut)
    await bench.link.reset()
    status = parse_status(await ask(dut, "?"))
    assert status["slices"] == (len(read_case()["shifts"]),)
    for name in ("present", "running", "tracking", "aligned", "following", "rate"):
        assert status[name] == (0,), name
    own_mode = read_case()["own_mode"]
    # Both data channels are joined in the bench, so the monitor is the board itself.
    # An EDID of 128 bytes takes 2.4 ms of this bench. A board without an own mode has no data
    # channel at its output.
    for _ in range(10):
        if status["monitor"][0]:
            break
        await Timer(500, "us")
        status = parse_status(await ask(dut, "?"))
    assert status["monitor"] == (int(own_mode is not None),)
    if own_mode is not None:
        assert status["monitor_mode"] == tuple(own_mode)
        assert status["monitor_ok"] == (0,)
        assert status["edid"][0] >= 128
    assert await ask(dut, "c") == "ok"
    mode = MODE_HDMI
    await bench.relock(mode, [], LIMITED_YCBCR)
    # During the phase search a word may be wrong.
    assert await ask(dut, "c") == "ok"
    # The clock continues during the answer.
    frames = bench.pictures(mode, 28)
    asking = cocotb.start_soon(ask(dut, "?"))
    await bench.link.play([hdmi_source(LIMITED_YCBCR)(mode, frames)])
    status = parse_status(await asking)
    window_us = read_case()["meter_window"] / 100
    wanted = {
        **dict.fromkeys(("present", "running", "following", "hsync", "vsync", "hdmi", "avi"), 1),
        **dict.fromkeys(("unsupported", "restarts", "slice", "sweep", "pass"), 0),
        "tracking": 7,
        "aligned": 7,
        "colour": ColourSpace.YCBCR_444,
        "limited": 1,
        "vic": 4,
        "columns": mode.h_active,
        "rows": mode.v_active,
    }
    for name, value in wanted.items():
        assert status[name] == (value,), f"{name}={status[name]}"
    # The bench's blanking between scripts tears the raster.
    assert not status["errors"][0] & ~0b110
    assert status["packet_errors"] == (0, 0)
    assert status["hung"] == status["word_errors"] == (0, 0, 0)
    low, high = read_case()["taps"]
    assert all(low <= taps <= high for taps in status["taps"])
    # Both meters have the resolution of their window.
    assert abs(status["clock"][0] - mode.pixel_clock / 1000 * window_us / 16) <= 1
    # A division takes longer than one of these frames, and a torn frame may start one more.
    unit_us = window_us / 160
    frame_us = 1000 * mode.h_total * mode.v_total / mode.pixel_clock
    await Timer(250, "us")
    status = parse_status(await ask(dut, "?"))
    assert abs(status["rate"][0] / (1e7 * unit_us / frame_us) - 1) < 0.1
    assert await ask(dut, "p 1") == "ok"
    assert await ask(dut, "p 2") == "error"
    assert await ask(dut, "x") == "error"
    assert await ask(dut, "s") == "error"
    assert await ask(dut, "s 256") == "error"
    assert await ask(dut, f"s {len(read_case()['shifts'])}") == "error"


async def press(button: Any) -> None:
    for level in (1, 0):
        button.value = level
        await Timer(2, "us")


@cocotb.test()
async def focus_is_stepped(dut: Any) -> None:
    """Slices by buttons with wrap-around, serial port and sweep; no frame is lost."""
    bench = Board(dut)
    await bench.link.reset()
    await bench.relock(MODE_FAST, [])
    slices = len(read_case()["shifts"])
    shown = 0
    steps = [(dut.button_down, -1), (dut.button_up, 1), (dut.button_up, 1)] if slices > 1 else []
    for button, step in steps:
        await press(button)
        shown = (shown + step) % slices
        assert bench.led() >> 6 == shown & 3
        # Alike for long enough that torn rasters do not count as frames that differ.
        frames = bench.pictures(MODE_FAST, 12)
        taken = await bench.link.play([encode_frames(MODE_FAST, frames)])
        got = last_frames(taken, MODE_FAST.h_total)
        # The bench's blanking tears the raster; the last frame is incomplete at the output.
        want = bench.golden(frames[-2], shown)
        assert np.array_equal(got[-1].pixels, want)
        assert not np.array_equal(want, bench.golden(frames[-2], (shown + 1) % slices))
    assert await ask(dut, "s 0") == "ok"
    assert bench.led() >> 6 == 0
    assert await ask(dut, "w 1") == "ok"
    frames = bench.pictures(MODE_FAST, slices + 5)
    taken = await bench.link.play([encode_frames(MODE_FAST, frames)])
    got = last_frames(taken, MODE_FAST.h_total)[-slices:]
    order = []
    for frame, picture in zip(got, frames[-slices - 1 :], strict=False):
        fits = [s for s in range(slices) if np.array_equal(frame.pixels, bench.golden(picture, s))]
        assert len(fits) == 1, "a frame of a sweep is wrong"
        order += fits
    assert order == [(order[0] + i) % slices for i in range(slices)]


@cocotb.test()
async def passed_through(dut: Any) -> None:
    """With the switch on, the pictures are passed through unchanged."""
    bench = Board(dut)
    await bench.link.reset()
    dut.switch_pass.value = 1
    frames = bench.pictures(MODE_FAST, bench.lost_frames(MODE_FAST) + 3)
    taken = await bench.link.play([*signal(MODE_FAST), encode_frames(MODE_FAST, frames)])
    got = last_frames(taken, MODE_FAST.h_total)
    assert len(got) >= 2
    for frame, want in zip(got[::-1], frames[-2::-1], strict=False):
        assert np.array_equal(frame.pixels, want)
        assert frame.mode == MODE_FAST.as_measured()


@cocotb.test()
async def test_pattern(dut: Any) -> None:
    """No source, switch on: the refocused pattern at the board's clock; then a source."""
    bench = Board(dut)
    await bench.link.reset()
    dut.switch_pattern.value = 1
    got = last_frames(await bench.link.play([Command(Code.WAIT, 500_000)]), MODE_FAST.h_total)
    assert len(got) >= 2
    want = bench.golden(pattern(MODE_FAST))
    for frame in got[-2:]:
        assert np.array_equal(frame.pixels, want)
    dut.switch_pattern.value = 0
    await bench.relock(MODE_FAST, [])


def pattern(mode: VideoMode) -> np.ndarray:
    """The test pattern of the board, or its stored light field."""
    if stored := read_case().get("stored"):
        return in_the_middle(np.array(stored, np.uint8), read_case()["m"], mode)
    shifts = read_case()["shifts"]
    depths = (
        (shifts[0], shifts[len(shifts) // 2] if len(shifts) > 2 else 0, shifts[-1])
        if len(shifts) > 1
        else (shifts[0], 0, -shifts[0])
    )
    return light_field(mode, read_case()["m"], depths, (mode.h_active // 3, 2 * mode.h_active // 3))
