# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``text_overlay``: every pixel of every frame against the golden model."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir.fpga.hdmi.link import raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.screen.overlay import OVERLAY_CLOCKS, Overlay
from plenofir_tb.case import read_case
from plenofir_tb.video import VideoTap

KINDS = ("refocused", "all-in-focus", "depth")


@cocotb.test()
async def texts_over_pictures(dut: Any) -> None:
    """Slices, outputs, positions, errors, raw pictures and no text, changed between frames."""
    case = read_case()
    rng, pick = np.random.default_rng(cocotb.RANDOM_SEED), random.Random(cocotb.RANDOM_SEED)
    overlay = Overlay(*(tuple(map(tuple, p)) if p and not isinstance(p[0], str) else tuple(p)
                        for p in (case["texts"], case["labels"], case["colours"])))  # fmt: skip
    mode = VideoMode.model_validate(case["mode"])
    Clock(dut.clk, 10, "ns").start()
    tap = VideoTap(dut)
    for name in ("show", "bottom", "slice", "kind", "raw", "errors"):
        getattr(dut, name).value = 0
    dut.rows.value = mode.v_active
    dut.reset.value = 1
    for _ in range(3):
        await FallingEdge(dut.clk)
    dut.reset.value = 0
    frames = list(rng.integers(0, 256, (9, mode.v_active, mode.h_active, 3), np.uint8))
    wanted = []
    # Settings of a frame are made in the blanking before its vertical sync.
    total = mode.h_total * mode.v_total
    signals = raster_signals(mode, frames)
    last = mode.h_total * mode.v_active + 10
    settings = [
        (0, 1, 0, 0, 0),
        (1, 1, 0, 0, 0),
        (0, 0, 0, 0, 0),
        (2, 2, 0, 1, 0),
        (1, 0, 0, 0, 31),
    ]
    settings += [
        tuple(pick.randrange(n) for n in (overlay.slices + 1, 3, 2, 2, 32)) for _ in range(9)
    ]
    begin = 0
    for number in range(len(frames)):
        end = number * total + last
        await tap.drive(type(signals)(*(part[begin:end] for part in vars(signals).values())))
        begin = end
        slice_, kind, raw, bottom, errors = settings[number]
        show = int(number != 5)
        names = ("slice", "kind", "raw", "bottom", "errors", "show")
        for name, value in zip(names, (slice_, kind, raw, bottom, errors, show), strict=True):
            getattr(dut, name).value = value
        if number + 1 < len(frames):
            picture = frames[number + 1]
            shown = "raw" if raw else KINDS[kind]
            wanted.append(
                overlay.draw(picture, shown, slice_, errors=errors, bottom=bool(bottom))
                if show
                else picture
            )
    await tap.drive(type(signals)(*(part[begin:] for part in vars(signals).values())))
    got = tap.frames(from_start=True)
    # The first frame came before any setting; the last one is incomplete.
    for number, (frame, want) in enumerate(zip(got[1:], wanted, strict=False)):
        assert frame.mode == mode.as_measured()
        assert np.array_equal(frame.pixels, want), f"frame {number}"
    assert len(got) >= len(frames) - 1


@cocotb.test()
async def resets_end_the_text(dut: Any) -> None:
    """No pixel in the clock after a reset; then the plain picture up to the next frame."""
    case = read_case()
    rng, pick = np.random.default_rng(cocotb.RANDOM_SEED), random.Random(cocotb.RANDOM_SEED)
    mode = VideoMode.model_validate(case["mode"])
    Clock(dut.clk, 10, "ns").start()
    tap = VideoTap(dut)
    for name in ("bottom", "slice", "kind", "raw", "errors"):
        getattr(dut, name).value = 0
    dut.show.value = 1
    dut.rows.value = mode.v_active
    dut.reset.value = 0
    picture = rng.integers(0, 256, (mode.v_active, mode.h_active, 3), np.uint8)
    signals = raster_signals(mode, [picture] * 3)

    async def drive(begin: int, end: int) -> None:
        await tap.drive(type(signals)(*(part[begin:end] for part in vars(signals).values())))

    total = mode.h_total * mode.v_total
    place = total + pick.randrange(12, 20) * mode.h_total + mode.h_active // 2
    await drive(0, place)
    got = np.array(tap.taken[-total:])
    sent = signals.pixels.astype(int) @ (1, 256, 65536)
    shown = got[OVERLAY_CLOCKS - 1 :, 3] != sent[place - total : place - OVERLAY_CLOCKS + 1]
    assert np.any(shown & signals.active[place - total : place - OVERLAY_CLOCKS + 1])
    dut.reset.value = 1
    await drive(place, place + 1)
    assert not tap.taken[-1][0]
    dut.reset.value = 0
    tap.taken = []
    # Up to the lines after the picture; pixels under way may still be text.
    end = total + mode.v_active * mode.h_total
    await drive(place + 1, end)
    got = np.array(tap.taken)[2 * OVERLAY_CLOCKS :]
    begin = place + 1 + OVERLAY_CLOCKS + 1
    active = signals.active[begin : begin + len(got)].astype(bool)
    assert np.array_equal(got[:, 0], active)
    assert np.array_equal(got[active, 3], sent[begin : begin + len(got)][active])
