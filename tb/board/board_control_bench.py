# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``board_control``: commands, buttons, switches, the serial line."""

from itertools import product
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()


class Panel:
    """The board's buttons, switches and serial port."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.clear_pulses = 0
        dut.line_in.value = 1
        for name in (
            *("button_up", "button_down", "switch_pattern", "switch_pass", "switch_sweep"),
            *("button_output", "switch_hide", "switch_bottom"),
        ):
            getattr(dut, name).value = 0
        cocotb.start_soon(self._count_pulses())

    async def _count_pulses(self) -> None:
        while True:
            await RisingEdge(self.dut.clear_errors)
            self.clear_pulses += 1

    async def clocks(self, count: int) -> None:
        await ClockCycles(self.dut.clk, count)
        await FallingEdge(self.dut.clk)

    async def reset(self) -> None:
        self.dut.reset.value = 1
        await self.clocks(5)
        self.dut.reset.value = 0
        await self.clocks(5)

    async def send(self, text: str, slow: float = 1) -> None:
        """Send characters, slower than the receiver expects by a factor."""
        for code in text.encode():
            passed = 0
            for number, bit in enumerate((0, *(code >> i & 1 for i in range(8)), 1), 1):
                self.dut.line_in.value = bit
                clocks = round(number * slow * CASE["bit_clocks"]) - passed
                await ClockCycles(self.dut.clk, clocks)
                passed += clocks

    async def line(self) -> str:
        bit_clocks = CASE["bit_clocks"]
        text = ""
        while not text.endswith("\r\n"):
            for _ in range(120 * bit_clocks):
                if not int(self.dut.line_out.value):
                    break
                await FallingEdge(self.dut.clk)
            else:
                raise AssertionError(f"no answer behind {text!r}")
            code = 0
            await ClockCycles(self.dut.clk, bit_clocks // 2)
            for i in range(8):
                await ClockCycles(self.dut.clk, bit_clocks)
                code |= int(self.dut.line_out.value) << i
            await ClockCycles(self.dut.clk, bit_clocks)
            assert int(self.dut.line_out.value), "no stop bit"
            text += chr(code)
            assert len(text) < 600, text
        return text.strip()

    async def ask(self, text: str, slow: float = 1) -> str:
        """Send a command and receive its answer."""
        answer = cocotb.start_soon(self.line())
        await self.send(text + "\r", slow)
        return await answer

    async def press(self, button: Any) -> None:
        for level in (1, 0):
            button.value = level
            await self.clocks(2 * CASE["stable"] + 6)

    def state(self) -> tuple[int, int, int, int, int]:
        """Current slice, sweep, frames of a sweep, pass-through, pattern."""
        dut = self.dut
        ports = (dut.slice, dut.sweep, dut.sweep_frames, dut.pass_through, dut.pattern)
        return tuple(int(port.value) for port in ports)

    def screen(self) -> tuple[int, int]:
        """Current output and position of the text."""
        return int(self.dut.shown.value), int(self.dut.text_place.value)


@for_entity("board_control")
async def commands_buttons_switches_reset(dut: Any) -> None:
    """All commands, buttons and switches, and that a reset restores the defaults."""
    Clock(dut.clk, 10, "ns").start()
    panel = Panel(dut)
    await panel.reset()
    first, slices = CASE["first_slice"], CASE["slices"]
    begin = (first, 0, 0, 0, 0)
    assert panel.state() == begin
    for numbers in ((743, 0, 32767), (-1, -32767, -32768), (10, 9999, -10000)):
        dut.status_values.value = sum((n & 0xFFFF) << 16 * i for i, n in enumerate(numbers))
        assert await panel.ask("?") == "clock={} rows={} taps={}.".format(*numbers)
    for command, answer in (
        ("s 2", "ok"),
        ("w 17", "ok"),
        ("p 1", "ok"),
        ("t 1", "ok"),
        (f"s {slices}", "error"),
        ("s 256", "error"),
        ("s", "error"),
        ("s x", "error"),
        ("ss 1", "error"),
        ("1 s", "error"),
        ("w", "error"),
        ("w 256", "error"),
        ("w 1000", "error"),
        ("p", "error"),
        ("p 2", "error"),
        ("t", "error"),
        ("t 2", "error"),
        ("x", "error"),
        ("x 1", "error"),
        ("c 0", "error"),
        ("? 1", "error"),
    ):
        assert await panel.ask(command) == answer, command
    assert panel.state() == (2, 1, 17, 1, 1)
    assert panel.clear_pulses == 0
    assert await panel.ask("c") == "ok"
    assert panel.clear_pulses == 1
    # After a reset inside a character, settings are the defaults, and the next command is
    # understood.
    await panel.send("s")
    dut.line_in.value = 0
    await panel.clocks(CASE["bit_clocks"] * 3 // 2)
    dut.line_in.value = 1
    await panel.reset()
    assert panel.state() == begin
    await panel.clocks(2)
    for command, state in (
        (" w 2 5 5 ", (first, 1, 255, 0, 0)),
        ("w 0", begin),
        ("p1", (first, 0, 0, 1, 0)),
        ("p 0", begin),
        ("t1", (first, 0, 0, 0, 1)),
        ("t 00", begin),
    ):
        assert await panel.ask(command) == "ok"
        assert panel.state() == state
    # A pulse shorter than half a bit is no character, whenever the next one comes.
    for offset in range(CASE["bit_clocks"]):
        dut.line_in.value = 0
        await ClockCycles(dut.clk, CASE["bit_clocks"] // 2 - 2)
        dut.line_in.value = 1
        await ClockCycles(dut.clk, 4 * CASE["bit_clocks"] + offset)
        assert await panel.ask("w 0", 1.03) == "ok", offset
    # Buttons wrap around at both ends.
    for button, step in ((dut.button_up, 1), (dut.button_down, -1)):
        for number in range(1, slices + 1):
            await panel.press(button)
            assert panel.state()[0] == (first + step * number) % slices
    # A setting with a switch and a command is on if either is.
    for name, want in (
        ("switch_pass", (first, 0, 0, 1, 0)),
        ("switch_pattern", (first, 0, 0, 0, 1)),
        ("switch_sweep", (first, 1, CASE["switch_frames"], 0, 0)),
    ):
        getattr(dut, name).value = 1
        await panel.clocks(2 * CASE["stable"] + 6)
        assert panel.state() == want, name
        getattr(dut, name).value = 0
        await panel.clocks(2 * CASE["stable"] + 6)
    assert panel.state() == begin
    # Outputs by button, with wrap-around, and by command; the text's position by command and
    # switches.
    assert panel.screen() == (0, 1)
    for shown in (1, 2, 0):
        await panel.press(dut.button_output)
        assert panel.screen() == (shown, 1)
    for command, answer, want in (
        *(("o 2", "ok", (2, 1)), ("o 3", "error", (2, 1)), ("h 2", "ok", (2, 2))),
        *(("h 3", "error", (2, 2)), ("o", "error", (2, 2)), ("h 0", "ok", (2, 0))),
    ):
        assert await panel.ask(command) == answer, command
        assert panel.screen() == want, command
    assert int(dut.polarity.value) == 8
    for command, answer, number in (
        *(("i 5", "ok", 5), ("i 9", "error", 5), ("i", "error", 5), ("i 0", "ok", 0)),
        *(("i 8", "ok", 8), ("i 7", "ok", 7)),
    ):
        assert await panel.ask(command) == answer, command
        assert int(dut.polarity.value) == number, command
    # A switch cannot show a text that a command has turned off.
    for place, name, want in ((0, "bottom", 0), (1, "bottom", 2), (2, "hide", 0)):
        assert await panel.ask(f"h {place}") == "ok"
        getattr(dut, f"switch_{name}").value = 1
        await panel.clocks(2 * CASE["stable"] + 6)
        assert panel.screen() == (2, want), name
        getattr(dut, f"switch_{name}").value = 0
        await panel.clocks(2 * CASE["stable"] + 6)
    await panel.reset()
    assert panel.screen() == (0, 1)
    assert panel.state() == begin
    assert int(dut.polarity.value) == 8


@for_entity("board_control")
async def serial_line_clock_by_clock(dut: Any) -> None:
    """Bits have the right length; invalid characters and commands have no effect on later ones."""
    Clock(dut.clk, 10, "ns").start()
    panel = Panel(dut)
    bit = CASE["bit_clocks"]
    dut.status_values.value = 0
    await panel.reset()
    levels: list[int] = []

    async def record() -> None:
        while True:
            await FallingEdge(dut.clk)
            levels.append(int(dut.line_out.value))

    async def is_quiet() -> bool:
        levels.clear()
        await panel.clocks(40 * bit)
        return all(levels)

    cocotb.start_soon(record())
    await panel.send("c\r")
    await panel.clocks(50 * bit)
    text = ""
    while 0 in levels:
        del levels[: levels.index(0)]
        bits = [levels[i * bit : (i + 1) * bit] for i in range(10)]
        assert all(len(set(clocks)) == 1 for clocks in bits), bits
        assert bits[9][0]
        text += chr(sum(clocks[0] << i for i, clocks in enumerate(bits[1:9])))
        del levels[: 10 * bit]
    assert text == "ok\r\n"
    assert await panel.ask("w 0", slow=1.04) == "ok"
    # Lines without a command, a break, a character without its stop bit: no answer.
    await panel.send("\n \r\n")
    assert await is_quiet()
    dut.line_in.value = 0
    await panel.clocks(35 * bit)
    dut.line_in.value = 1
    assert await is_quiet()
    await panel.send("w")
    dut.line_in.value = 0
    await panel.clocks(10 * bit)
    dut.line_in.value = 1
    await panel.clocks(bit)
    assert await panel.ask("w 0") == "error"
    # Characters during an answer are dropped.
    pulses = panel.clear_pulses
    answer = cocotb.start_soon(panel.line())
    await panel.send("?\rc\r")
    assert (await answer).startswith("clock=0")
    assert await is_quiet()
    assert panel.clear_pulses == pulses
    # A reset inside a command, and inside an answer.
    for begun in ("w 9", "xx", "7"):
        await panel.send(begun)
        await panel.reset()
        assert await panel.ask("c") == "ok"
        assert panel.state()[1] == 0
    # And in a character: the line must be idle before the next one.
    dut.line_in.value = 0
    await panel.clocks(2 * bit)
    await panel.reset()
    await panel.clocks(2 * bit)
    dut.line_in.value = 1
    await panel.clocks(12 * bit)
    assert await panel.ask("c") == "ok"
    for clocks in (2, 12 * bit + 3, 30 * bit):
        await panel.send("?\r")
        await panel.clocks(clocks)
        await panel.reset()
        assert await is_quiet()
        assert await panel.ask("c") == "ok"
    # A reset of one clock around the last bit removes a character or a command.
    for text, clocks in product(("x", "c\r", "h 0\r", "s 0\r"), range(bit // 2, bit + 4)):
        cocotb.start_soon(panel.send(text))
        await panel.clocks((10 * len(text) - 1) * bit + clocks)
        dut.reset.value = 1
        await panel.clocks(1)
        dut.reset.value = 0
        assert not int(dut.clear_errors.value), clocks
        await panel.clocks(bit)
        assert (panel.state()[0], panel.screen()) == (CASE["first_slice"], (0, 1)), clocks
        assert await panel.ask("c") == "ok", (text, clocks)
