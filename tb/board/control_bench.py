# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the board's control as a whole: every field of the status line, and the LEDs."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge, Timer, ValueChange
from cocotb.utils import get_sim_time

from board.unit_bench import I2cMaster
from plenofir_tb.case import read_case
from plenofir_tb.hdmi.status import parse_status

CASE = read_case()
CHANNELS = 3
# Widths of the numbers that the video path and the delay lines report.
WIDTHS = {
    "aligned": 3,
    "following": 1,
    "unsupported": 1,
    "varying": 1,
    "inverted": 3,
    "errors": 5,
    "columns": 12,
    "rows": 12,
    "hsync": 1,
    "vsync": 1,
    "hdmi": 1,
    "avi": 1,
    "colour": 2,
    "limited": 1,
    "vic": 8,
    "tracking": 3,
}


def port(dut: Any, name: str) -> Any:
    """Port that a field's number comes from."""
    return getattr(dut, "error_flags" if name == "errors" else name)


class Control:
    """``hdmi_control_bench`` with ideal PLLs, a source's clock, and a serial port."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.random = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start()
        Clock(dut.pixel_clk, 13, "ns").start()
        for name in (*WIDTHS, "taps", "hung_toggle", "word_errors", "v_sync_now", "tmds_clk"):
            port(dut, name).value = 0
        for name in ("scl", "sda", "out_scl", "uart_rx"):
            getattr(dut, name).value = 1
        dut.button_clear.value = 0
        for side in ("receive", "transmit"):
            cocotb.start_soon(self._locks(side))

    async def _locks(self, side: str) -> None:
        reset, locked = (getattr(self.dut, f"{side}_{name}") for name in ("reset", "locked"))
        while True:
            locked.value = int(str(reset.value) == "0")
            await ValueChange(reset)

    async def clocks(self, count: int) -> None:
        await Timer(10 * count, "ns")

    async def reset(self) -> None:
        self.dut.reset.value = 1
        await self.clocks(40)
        self.dut.reset.value = 0
        await self.clocks(40)

    async def windows(self, count: int) -> None:
        """Wait for some windows of the meter."""
        await self.clocks(count * CASE["meter_window"])

    async def ask(self, text: str) -> str:
        """Send a command and receive its answer."""
        answer = cocotb.start_soon(self._line())
        for code in (text + "\r").encode():
            for bit in (0, *(code >> i & 1 for i in range(8)), 1):
                self.dut.uart_rx.value = bit
                await self.clocks(CASE["bit_clocks"])
        return await answer

    async def _line(self) -> str:
        text = ""
        while not text.endswith("\r\n"):
            await FallingEdge(self.dut.uart_tx)
            code = 0
            await self.clocks(CASE["bit_clocks"] // 2)
            for i in range(8):
                await self.clocks(CASE["bit_clocks"])
                code |= int(self.dut.uart_tx.value) << i
            text += chr(code)
        return text.strip()

    async def status(self) -> dict[str, tuple[int, ...]]:
        return parse_status(await self.ask("?"))

    async def toggle_hung(self, channel: int, times: int) -> None:
        """Have delay lines of a channel reset."""
        for _ in range(times):
            self.dut.hung_toggle.value = int(self.dut.hung_toggle.value) ^ 1 << channel
            await self.clocks(20)


def packed(values: tuple[int, ...], bits: int) -> int:
    """Numbers of the channels side by side."""
    return sum((value & (1 << bits) - 1) << bits * c for c, value in enumerate(values))


@cocotb.test(skip="runs" in CASE, timeout_time=20, timeout_unit="ms")
async def every_field(dut: Any) -> None:
    """Reports arrive in their fields and at their LEDs, with and without a running link."""
    control = Control(dut)
    rng = control.random
    await control.reset()
    status = await control.status()
    assert status.pop("slices") == (CASE["slices"],)
    assert status.pop("outputs") == (1,)
    # 8: the channels that are found to be swapped.
    assert status.pop("polarity") == (8,)
    assert not any(any(numbers) for numbers in status.values())
    clock = Clock(dut.tmds_clk, 13.468, "ns")
    clock.start()
    dut.aligned.value = dut.tracking.value = 7
    await control.windows(7)
    assert int(dut.run.value)
    for _ in range(3):
        # Without data the link would be restarted.
        dut.aligned.value = dut.tracking.value = 7
        await control.clocks(100)
        wanted = {name: (rng.randrange(1 << bits),) for name, bits in WIDTHS.items()}
        for name, (value,) in wanted.items():
            port(dut, name).value = value
        taps = tuple(rng.randrange(-127, 128) for _ in range(CHANNELS))
        words = tuple(rng.choice((rng.randrange(4096), 4095)) for _ in range(CHANNELS))
        dut.taps.value = packed(taps, 8)
        dut.word_errors.value = packed(words, 12)
        await control.clocks(40)
        aligned, errors = wanted["aligned"][0], wanted["errors"][0]
        led = 1 | wanted["following"][0] << 1 | aligned << 2 | (errors != 0) << 5
        assert int(dut.led.value) & 0x3F == led
        status = await control.status()
        assert status | wanted | {"taps": taps, "word_errors": words} == status
        assert status["present"] == status["running"] == (1,)
        assert abs(status["clock"][0] - CASE["meter_window"] / 1.6 / 13.468) <= 1
    # The clock is lost: values that depend on it are 0, errors stay.
    clock.stop()
    for name, bits in WIDTHS.items():
        port(dut, name).value = (1 << bits) - 1
    await control.windows(3)
    assert int(dut.led.value) & 0x3F == 0x20
    status = await control.status()
    zero = ("present", "running", "clock", "aligned", "tracking", "following", "unsupported")
    for name in (*zero, "varying", "inverted", "hdmi", "avi"):
        assert status[name] == (0,), name
    assert status["errors"] == (31,)
    assert status["columns"] == status["rows"] == (4095,)


@cocotb.test(skip="runs" in CASE, timeout_time=20, timeout_unit="ms")
async def counters(dut: Any) -> None:
    """Hung delay lines, restarts, EDID: counted up to a limit, cleared by command and button."""
    control = Control(dut)
    await control.reset()
    master = I2cMaster(dut, control.random)
    await master.read_block(0, 3)
    for channel, times in enumerate((3, 0, 260)):
        await control.toggle_hung(channel, times)
    status = await control.status()
    assert status["hung"] == (3, 0, 255)
    assert status["edid"] == (3,)
    assert status["restarts"] == (0,)
    assert await control.ask("c") == "ok"
    status = await control.status()
    assert status["hung"] == (0, 0, 0)
    assert status["edid"] == (0,)
    # There are no data if a channel does not track or is not aligned.
    Clock(dut.tmds_clk, 13.468, "ns").start()
    dut.aligned.value = dut.tracking.value = 7
    await control.windows(7)
    for restarts, levels in enumerate((dut.tracking, dut.aligned)):
        assert (await control.status())["restarts"] == (restarts,)
        levels.value = 7 ^ 1 << control.random.randrange(CHANNELS)
        await control.windows(CASE["data_patience"] + 1)
        levels.value = 7
    assert (await control.status())["restarts"] == (2,)
    await control.toggle_hung(1, 2)
    toggle = int(dut.clear_toggle.value)
    dut.button_clear.value = 1
    await Timer(1, "us")
    dut.button_clear.value = 0
    await Timer(1, "us")
    assert int(dut.clear_toggle.value) != toggle, "the errors of the video path too"
    status = await control.status()
    assert status["restarts"] == (0,)
    assert status["hung"] == (0, 0, 0)
    await control.toggle_hung(0, 1)
    await control.reset()
    assert (await control.status())["hung"] == (0, 0, 0)


@cocotb.test(skip="runs" in CASE, timeout_time=20, timeout_unit="ms")
async def settings_cross(dut: Any) -> None:
    """Settings by commands cross into the pixel clock, and are reported."""
    control = Control(dut)
    await control.reset()
    for command, name, value in (
        ("s 2", "slice", 2),
        ("w 200", "sweep_frames", 200),
        ("p 1", "pass_through", 1),
        ("i 5", "polarity", 5),
    ):
        assert await control.ask(command) == "ok"
        assert int(getattr(dut, name).value) == value
    assert int(dut.sweep.value)
    assert not int(dut.show_pattern.value)
    assert int(dut.led.value) >> 6 == 2
    assert await control.ask("t 1") == "ok"
    await control.clocks(60)
    assert int(dut.show_pattern.value)
    status = await control.status()
    assert [
        status[name] for name in ("slice", "slices", "sweep", "pass", "pattern", "polarity")
    ] == [*((2,), (CASE["slices"],), (200,), (1,), (1,), (5,))]


@cocotb.test(skip=not CASE.get("runs"), timeout_time=20, timeout_unit="ms")
async def range_of_clocks(dut: Any) -> None:
    """Only a clock in the board's range is accepted."""
    control = Control(dut)
    await control.reset()
    dut.aligned.value = dut.tracking.value = 7
    for mhz, runs in CASE["runs"]:
        clock = Clock(dut.tmds_clk, round(1e6 / mhz), "ps")
        clock.start()
        await control.windows(7)
        assert int(dut.run.value) == runs, f"{mhz} MHz"
        clock.stop()
        await control.windows(3)


@cocotb.test(skip="stretch" not in CASE)
async def clock_line_held_low(dut: Any) -> None:
    """A monitor held the clock line low for as long as it may: the control waits and asks anew."""
    control = Control(dut)
    await control.reset()
    await RisingEdge(dut.out_scl_low)
    dut.out_scl.value = 0
    await FallingEdge(dut.out_scl_low)
    released = get_sim_time("ns")
    await RisingEdge(dut.out_scl_low)
    clocks = (get_sim_time("ns") - released) / 10
    assert 0 <= clocks - CASE["stretch"] - CASE["pause"] < 1000, clocks
