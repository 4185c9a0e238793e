# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the board's control entities; each is for the entity that it names."""

import random
from itertools import product
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, Timer

from plenofir.fpga.hdmi.edid import make_edid, offered_modes
from plenofir_tb import i2c
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()


class I2cMaster(i2c.I2cMaster):
    """A master on ``scl``, ``sda``, ``sda_low``: open-drain lines, with ringing on the edges."""

    def __init__(self, dut: Any, rng: random.Random) -> None:
        self.dut = dut
        self.rng = rng
        self.low = False
        dut.scl.value = 1
        dut.sda.value = 1

    def _drive(self) -> None:
        slave_low = str(self.dut.sda_low.value) == "1"
        self.dut.sda.value = int(not (self.low or slave_low))

    async def wait(self) -> None:
        """Wait a quarter of a bit of 400 kHz, the slave's level being on the line."""
        for _ in range(6):
            await Timer(104, "ns")
            self._drive()

    async def clock(self, level: int) -> None:
        """Move the clock line, with glitches shorter than the filter."""
        for _ in range(self.rng.randrange(3)):
            self.dut.scl.value = level
            await Timer(self.rng.randrange(20, 120), "ns")
            self.dut.scl.value = 1 - level
            await Timer(20, "ns")
        self.dut.scl.value = level
        await self.wait()

    async def data(self, level: int) -> None:
        self.low = not level
        self._drive()
        await self.wait()

    def seen(self) -> int:
        return int(self.dut.sda.value)

    async def read_block(self, address: int, count: int) -> list[int]:
        """Read bytes as sources do: write the address, start again, read."""
        await self.start()
        assert await self.write(0xA0)
        assert await self.write(address)
        await self.start()
        assert await self.write(0xA1)
        block = [await self.read(more=i < count - 1) for i in range(count)]
        await self.stop()
        return block


@for_entity("i2c_rom_slave")
async def edid_over_i2c(dut: Any) -> None:
    """The whole block, and parts of it, on lines that ring; the hunter tests the rest."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    master = I2cMaster(dut, rng)
    dut.reset.value = 1
    await Timer(100, "ns")
    dut.reset.value = 0
    await Timer(1, "us")
    edid = list(make_edid(offered_modes(CASE["max_columns"])))
    assert await master.read_block(0, 128) == edid
    at = rng.randrange(100)
    assert await master.read_block(at, 5) == edid[at : at + 5]
    assert await master.read_block(126, 4) == [*edid[126:], 0xFF, 0xFF]
    # A source disappears while the slave holds the data line low: it releases it after a time-out.
    await master.start()
    assert await master.write(0xA0)
    assert await master.write(0)
    await master.start()
    assert await master.write(0xA1)
    await ClockCycles(dut.clk, CASE["let_go"] - 400)
    assert int(dut.sda_low.value)
    await ClockCycles(dut.clk, 401)
    assert not int(dut.sda_low.value)
    assert all([await master.bit(1) for _ in range(12)])
    await master.stop()
    assert await master.read_block(0, 3) == edid[:3]
    # Noise on both lines, then silence: the slave has released them and answers again.
    for _ in range(400):
        dut.scl.value, dut.sda.value = rng.randrange(2), rng.randrange(2)
        await Timer(rng.randrange(20, 2000), "ns")
    dut.scl.value = dut.sda.value = 1
    master.low = False
    await ClockCycles(dut.clk, CASE["let_go"] + 100)
    assert not int(dut.sda_low.value)
    assert await master.read_block(0, 3) == edid[:3]


@for_entity("debouncer")
async def bouncing_contact(dut: Any) -> None:
    """A bouncing contact makes one press."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.contacts.value = 0
    presses = 0
    for level in (0, 1, 0, 1, 0):
        for bounce in range(12):
            dut.contacts.value = bounce % 2
            for _ in range(rng.randrange(1, 15)):
                await FallingEdge(dut.clk)
                presses += str(dut.pressed.value) == "1"
        dut.contacts.value = level
        for _ in range(30):
            await FallingEdge(dut.clk)
            presses += int(dut.pressed.value)
        assert int(dut.levels.value) == level
    assert presses == 2
    # A level is accepted when it has lasted long enough without interruption.
    stable = CASE["stable"]
    for runs, want in (([stable - 1], 0), ([stable - 1, stable - 1], 0), ([stable], 1)):
        presses = 0
        for run in [*runs, 0]:
            for level, clocks in ((1, run), (0, 1 if run else 3 * stable)):
                dut.contacts.value = level
                for _ in range(clocks):
                    await FallingEdge(dut.clk)
                    presses += int(dut.pressed.value)
        assert presses == want, runs
        assert not int(dut.levels.value)


@for_entity("reset_filter")
async def reset_without_bounces(dut: Any) -> None:
    """Resets from configuration on; short requests and short gaps change nothing."""
    rng = random.Random(cocotb.RANDOM_SEED)
    begins, ends = CASE["assert_clocks"], CASE["release_clocks"]
    Clock(dut.clk, 10, "ns").start()
    # One of the synchroniser's two clocks comes after those that count.
    level, late = 1, 1

    async def hold(request: int, clocks: int, want: int) -> None:
        dut.request.value = request
        for _ in range(clocks):
            await FallingEdge(dut.clk)
            assert int(dut.reset.value) == want
        dut.request.value = 1 - request

    await hold(1, 4, 1)
    for _ in range(6):
        last = begins if not level else ends
        # Bounces that do not last.
        for _ in range(10):
            await hold(1 - level, rng.randrange(1, last), level)
            await hold(level, rng.randrange(1, 9), level)
        await hold(1 - level, last + late, level)
        level = 1 - level
        await hold(level, 1, level)


@for_entity("hot_plug")
async def monitor_is_plugged_in(dut: Any) -> None:
    """A number of clocks after each reset, and after configuration."""
    dut.reset.value = 0
    Clock(dut.clk, 10, "ns").start()
    for _ in range(3):
        clocks = 0
        while str(dut.present.value) != "1":
            await FallingEdge(dut.clk)
            clocks += 1
        assert abs(clocks - CASE["pause"]) <= 2
        await ClockCycles(dut.clk, 100)
        assert int(dut.present.value)
        dut.reset.value = 1
        await ClockCycles(dut.clk, 5)
        assert not int(dut.present.value)
        dut.reset.value = 0


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


@for_entity("demo_control")
async def focus_to_and_fro(dut: Any) -> None:
    """Random frames and keys: the slice is that of a model."""
    slices, frames, stable = CASE["slices"], CASE["frames"], CASE["stable"]
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.v_sync.value = dut.key_stop.value = dut.key_step.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 6)
    dut.reset.value = 0
    slice_, step, going, shown = 0, 1, True, 0

    def move() -> None:
        nonlocal slice_, step
        if slices > 1:
            step = step if 0 <= slice_ + step < slices else -step
            slice_ += step

    for _ in range(300):
        what = rng.choice(["frame"] * 6 + ["stop", "step"])
        if what == "frame":
            for level in (1, 0):
                dut.v_sync.value = level
                await ClockCycles(dut.clk, rng.randrange(1, 4))
            shown = shown + 1 if going else 0
            if shown == frames:
                shown = 0
                move()
        else:
            key = dut.key_stop if what == "stop" else dut.key_step
            key.value = 1
            await ClockCycles(dut.clk, stable + 8)
            key.value = 0
            await ClockCycles(dut.clk, stable + 8)
            going = not going and what == "stop"
            shown = 0 if not going else shown
            if what == "step":
                move()
        await ClockCycles(dut.clk, 3)
        await FallingEdge(dut.clk)
        assert int(dut.slice.value) == slice_, what
        assert int(dut.going.value) == going, what
        assert not int(dut.sweep.value)
