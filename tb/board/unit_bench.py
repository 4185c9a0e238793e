"""cocotb tests of the board's control entities; each is for the entity that it names."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, Timer

from plenofir.fpga.hdmi.edid import make_edid, offered_modes
from plenofir.fpga.hdmi.pll import HIGH, LOW
from plenofir.fpga.hdmi.pll import registers as registers_of
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()


class I2cMaster:
    """A master on the data channel: open-drain lines, with ringing on the edges.

    Parameters
    ----------
    dut
        Slave with ``scl``, ``sda``, ``sda_low``.
    rng
        Source of randomness.
    """

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
        """Set the data line."""
        self.low = not level
        self._drive()
        await self.wait()

    async def start(self) -> None:
        """Start condition, repeated or not."""
        await self.data(1)
        await self.clock(1)
        await self.data(0)
        await self.clock(0)

    async def stop(self) -> None:
        """Stop condition."""
        await self.data(0)
        await self.clock(1)
        await self.data(1)

    async def bit(self, level: int) -> int:
        """Send a bit (1: leave the line to the slave), return what the line said."""
        await self.data(level)
        await self.clock(1)
        seen = int(self.dut.sda.value)
        await self.clock(0)
        return seen

    async def write(self, byte: int) -> bool:
        """Send a byte, return whether it was acknowledged."""
        for i in range(7, -1, -1):
            await self.bit(byte >> i & 1)
        return not await self.bit(1)

    async def read(self, *, more: bool) -> int:
        """Receive a byte, acknowledging it if more are wanted."""
        byte = 0
        for _ in range(8):
            byte = byte << 1 | await self.bit(1)
        await self.bit(int(not more))
        return byte

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
    """The whole block, parts of it, other devices, broken transfers: never a hang."""
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
    # Another device is not answered.
    await master.start()
    assert not await master.write(0xA2)
    await master.stop()
    # Transfers that break off anywhere, also while the slave holds the line.
    for _ in range(6):
        await master.start()
        await master.write(0xA1)
        for _ in range(rng.randrange(1, 20)):
            await master.bit(1)
        if rng.random() < 0.5:
            # The way out of a slave that holds the data line: nine clocks and a stop.
            for _ in range(9):
                await master.bit(1)
        await master.stop()
        assert await master.read_block(0, 3) == edid[:3]
    # Nothing can be written.
    await master.start()
    assert await master.write(0xA0)
    assert await master.write(8)
    assert not await master.write(0x55)
    await master.stop()
    assert await master.read_block(8, 2) == edid[8:10]


@for_entity("debouncer")
async def bouncing_contact(dut: Any) -> None:
    """A bouncing contact makes one press."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.contact.value = 0
    presses = 0
    for level in (0, 1, 0, 1, 0):
        for bounce in range(12):
            dut.contact.value = bounce % 2
            for _ in range(rng.randrange(1, 15)):
                await FallingEdge(dut.clk)
                presses += str(dut.pressed.value) == "1"
        dut.contact.value = level
        for _ in range(30):
            await FallingEdge(dut.clk)
            presses += int(dut.pressed.value)
        assert int(dut.level.value) == level
    assert presses == 2


class Panel:
    """The board's buttons, switches and serial port.

    Parameters
    ----------
    dut
        The control.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.clear_pulses = 0
        dut.line_in.value = 1
        for name in ("button_up", "button_down", "switch_pattern", "switch_pass", "switch_sweep"):
            getattr(dut, name).value = 0
        cocotb.start_soon(self._count_pulses())

    async def _count_pulses(self) -> None:
        while True:
            await RisingEdge(self.dut.clear_errors)
            self.clear_pulses += 1

    async def clocks(self, count: int) -> None:
        """Wait."""
        await ClockCycles(self.dut.clk, count)
        await FallingEdge(self.dut.clk)

    async def reset(self) -> None:
        """Reset for a few clocks."""
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
        """Receive a line."""
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
        """Press and release a button."""
        for level in (1, 0):
            button.value = level
            await self.clocks(2 * CASE["stable"] + 6)

    def state(self) -> tuple[int, int, int, int, int]:
        """Slice, sweep, frames of a sweep, pass-through, pattern."""
        dut = self.dut
        ports = (dut.slice, dut.sweep, dut.sweep_frames, dut.pass_through, dut.pattern)
        return tuple(int(port.value) for port in ports)


@for_entity("board_control")
async def commands_buttons_switches_reset(dut: Any) -> None:
    """All that a person can do, and that a reset undoes it."""
    Clock(dut.clk, 10, "ns").start()
    panel = Panel(dut)
    await panel.reset()
    first, slices = CASE["first_slice"], CASE["slices"]
    begin = (first, 0, 0, 0, 0)
    assert panel.state() == begin
    for number in (743, 0, 32767, -1, -32767, -32768):
        dut.status_values.value = number & 0xFFFF
        assert await panel.ask("?") == f"clock={number}."
    for command, answer in (
        ("s 2", "ok"),
        ("w 17", "ok"),
        ("p 1", "ok"),
        ("t 1", "ok"),
        (f"s {slices}", "error"),
        ("s 256", "error"),
        ("s", "error"),
        ("s x", "error"),
        ("p 2", "error"),
        ("x", "error"),
        ("? 1", "error"),
    ):
        assert await panel.ask(command) == answer, command
    assert panel.state() == (2, 1, 17, 1, 1)
    assert panel.clear_pulses == 0
    assert await panel.ask("c") == "ok"
    assert panel.clear_pulses == 1
    # A reset inside a character: all settings are the first, and the next command is understood.
    await panel.send("s")
    dut.line_in.value = 0
    await panel.clocks(CASE["bit_clocks"] * 3 // 2)
    dut.line_in.value = 1
    await panel.reset()
    assert panel.state() == begin
    await panel.clocks(2)
    assert await panel.ask("w 3") == "ok"
    assert await panel.ask("w 0") == "ok"
    assert panel.state() == begin
    # What is shorter than half a bit is no character, whenever the next one comes.
    for offset in range(CASE["bit_clocks"]):
        dut.line_in.value = 0
        await ClockCycles(dut.clk, CASE["bit_clocks"] // 2 - 2)
        dut.line_in.value = 1
        await ClockCycles(dut.clk, 4 * CASE["bit_clocks"] + offset)
        assert await panel.ask("w 0", 1.03) == "ok", offset
    # Buttons go around both ends.
    for button, step in ((dut.button_up, 1), (dut.button_down, -1)):
        for number in range(1, slices + 1):
            await panel.press(button)
            assert panel.state()[0] == (first + step * number) % slices
    # A switch and a command for the same thing: it is on if either is.
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


class Plls:
    """Settings and locks as the supervisor sees them.

    Parameters
    ----------
    dut
        The supervisor.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.settings: list[int] = []
        self.restarts = 0
        self.locks = [True, True]
        dut.want_own.value = 0
        dut.own_ready.value = 0
        dut.rate.value = 0
        dut.rate_updated.value = 0
        dut.data.value = 1
        dut.configured.value = 1
        dut.receive_locked.value = 0
        dut.transmit_locked.value = 0

    async def clocks(self, count: int) -> None:
        """Let the PLLs follow for some clocks."""
        busy = 0
        dut = self.dut
        for _ in range(count):
            await FallingEdge(dut.clk)
            self.restarts += str(dut.restarted.value) == "1"
            if str(dut.configure.value) == "1":
                self.settings.append(int(dut.high.value))
                assert int(dut.receive_reset.value), "settings change in reset only"
                busy = 4
            dut.configured.value = int(busy == 0)
            busy = max(busy - 1, 0)
            for reset, locked, can in zip(
                (dut.receive_reset, dut.transmit_reset),
                (dut.receive_locked, dut.transmit_locked),
                self.locks,
                strict=True,
            ):
                locked.value = int(str(reset.value) == "0" and can)

    async def measure(self, *tenths: int, clocks: int = 60) -> None:
        """Measure the TMDS clock, tenths of a MHz, each time for long enough that all settles."""
        for measured in tenths:
            self.dut.rate.value = measured * CASE["counts_10_mhz"] // 100
            self.dut.rate_updated.value = 1
            await self.clocks(1)
            self.dut.rate_updated.value = 0
            await self.clocks(clocks - 1)

    async def steady(self, tenths: int) -> None:
        """Measure a clock until it counts: not before the fourth time."""
        for _ in range(3):
            await self.measure(tenths)
            self.expect(runs=0, present=0)
        await self.measure(tenths)

    def expect(self, *, runs: int, present: int) -> None:
        """Check what the supervisor drives."""
        dut = self.dut
        assert (int(dut.run.value), int(dut.present.value)) == (runs, present)
        assert int(dut.receive_reset.value) == int(dut.transmit_reset.value) == 1 - runs


async def supervised(dut: Any) -> Plls:
    """Reset the supervisor."""
    Clock(dut.clk, 10, "ns").start()
    plls = Plls(dut)
    dut.reset.value = 1
    await plls.clocks(4)
    plls.expect(runs=0, present=0)
    dut.reset.value = 0
    # No rate and no restart of a test before.
    await plls.measure(0)
    plls.restarts = 0
    return plls


@for_entity("link_supervisor")
async def rates_and_settings(dut: Any) -> None:
    """Limits, the middle, settings kept while the clock drifts, restarts when it jumps."""
    rng = random.Random(cocotb.RANDOM_SEED)
    plls = await supervised(dut)
    # Tenths of MHz, whether it runs, and the settings that were written on the way.
    for tenths, settings in (
        (239, []),
        (748, []),
        (240, [0]),
        (747, [1]),
        (450, [0]),
        (743, [1]),
        (253, [0]),
        (453, [1]),
    ):
        plls.settings.clear()
        await plls.steady(tenths)
        plls.expect(runs=len(settings), present=len(settings))
        assert plls.settings == settings, tenths
    assert plls.restarts == 5, "each jump but the first ones takes a running link down"
    # Drift, a count a measurement: each setting is kept as far as it reaches.
    for begin, last, setting in ((453, 400, 0), (450, 500, 1)):
        await plls.steady(begin + 10)
        await plls.steady(begin)
        plls.settings.clear()
        step = 1 if last > begin else -1
        await plls.measure(*range(begin + step, last + step, step), clocks=10)
        plls.expect(runs=1, present=1)
        assert plls.settings == []
        await plls.measure(last + step)
        assert plls.settings == [setting]
        plls.expect(runs=1, present=1)
    # The limits of the whole range are found while drifting too.
    await plls.steady(746)
    await plls.measure(747)
    plls.expect(runs=1, present=1)
    await plls.measure(748)
    plls.expect(runs=0, present=0)
    # A clock that flickers by a count is steady; one that jumps by two is a new one.
    await plls.measure(742, 743, 742, 743, 742)
    plls.expect(runs=1, present=1)
    restarts = plls.restarts
    for step in (2, -2):
        await plls.measure(742 + step, clocks=4)
        plls.expect(runs=0, present=0)
        await plls.measure(742 + step, 742 + step)
        plls.expect(runs=0, present=0)
        await plls.measure(742 + step)
        plls.expect(runs=1, present=1)
        await plls.measure(0, 742, 742, 742, 742)
    assert plls.restarts == restarts + 4
    # An open input: any rate, never the same one four times.
    await plls.measure(0)
    plls.settings.clear()
    last = 0
    for _ in range(200):
        now = rng.choice([n for n in range(0, 4095, rng.choice((3, 50))) if abs(n - last) > 1])
        await plls.measure(*[now] * rng.randrange(1, 4), clocks=3)
        plls.expect(runs=0, present=0)
        last = now
    await plls.measure(*[4095] * 5)
    assert plls.settings == []
    # A reset begins anew.
    await plls.steady(742)
    dut.reset.value = 1
    await plls.clocks(4)
    plls.expect(runs=0, present=0)
    dut.reset.value = 0
    await plls.clocks(100)
    plls.expect(runs=0, present=0)
    await plls.measure(742, 742)
    plls.expect(runs=0, present=0)
    await plls.measure(742)
    plls.expect(runs=1, present=1)


@for_entity("link_supervisor")
async def lost_locks_and_the_own_clock(dut: Any) -> None:
    """Lost locks, locks that never come, the board's own clock."""
    plls = await supervised(dut)
    await plls.steady(742)
    for lost in (0, 1):
        restarts = plls.restarts
        plls.locks[lost] = False
        await plls.clocks(4)
        assert not int(dut.run.value)
        # It is tried again and again, and never runs.
        plls.settings.clear()
        for _ in range(5 * CASE["timeout"] // 2):
            await plls.clocks(1)
            assert not int(dut.run.value)
        assert len(plls.settings) in (2, 3)
        assert int(dut.transmit_reset.value) or lost
        plls.locks[lost] = True
        await plls.clocks(CASE["timeout"] + 100)
        assert int(dut.run.value)
        assert plls.restarts == restarts + 1
    # The board's own clock: chosen in reset, always the low setting; no restart is counted.
    plls.settings.clear()
    restarts = plls.restarts
    dut.want_own.value = 1
    await plls.clocks(100)
    assert (int(dut.run.value), int(dut.use_own.value)) == (0, 1)
    dut.own_ready.value = 1
    await plls.clocks(100)
    assert (int(dut.run.value), int(dut.use_own.value)) == (1, 1)
    assert plls.settings == [0]
    assert plls.restarts == restarts
    dut.own_ready.value = 0
    await plls.clocks(4)
    assert not int(dut.run.value)
    assert plls.restarts == restarts + 1
    dut.own_ready.value = 1
    await plls.clocks(100)
    dut.want_own.value = 0
    await plls.clocks(100)
    assert (int(dut.run.value), int(dut.use_own.value)) == (1, 0)
    assert plls.settings == [0, 0, 1]
    assert plls.restarts == restarts + 1


@for_entity("link_supervisor")
async def clock_without_data(dut: Any) -> None:
    """Restarts after so many measurements in a row without data, not before, not by itself."""
    plls = await supervised(dut)
    patience = CASE["patience"]
    await plls.steady(742)
    await plls.measure(*[742] * (2 * patience))
    assert plls.restarts == 0
    dut.data.value = 0
    for _ in range(3):
        await plls.measure(*[742] * (patience - 1))
        dut.data.value = 1
        await plls.clocks(1)
        dut.data.value = 0
    assert plls.restarts == 0
    for count in range(1, 4):
        await plls.measure(*[742] * (patience - 1))
        assert plls.restarts == count - 1
        plls.settings.clear()
        await plls.measure(742)
        assert plls.restarts == count
        assert plls.settings == [1], "the PLLs are set anew"
        plls.expect(runs=1, present=1)
    # The test pattern needs no data.
    dut.own_ready.value = 1
    dut.want_own.value = 1
    await plls.clocks(60)
    await plls.measure(*[742] * (3 * patience))
    assert plls.restarts == 3
    assert int(dut.run.value)


@for_entity("pll_configure")
async def settings_are_written(dut: Any) -> None:
    """Every register is read, changed where it may be, and written; a dead port is given up."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    registers: dict[int, int] = {}
    writes: list[int] = []
    alive = True

    async def port() -> None:
        while True:
            dut.drp_ready.value = 0
            await FallingEdge(dut.clk)
            if not alive or str(dut.drp_enable.value) != "1":
                continue
            address = int(dut.drp_address.value)
            if int(dut.drp_write.value):
                registers[address] = int(dut.drp_in.value)
                writes.append(address)
            await ClockCycles(dut.clk, rng.randrange(1, 5))
            await FallingEdge(dut.clk)
            dut.drp_out.value = registers[address]
            dut.drp_ready.value = 1
            await FallingEdge(dut.clk)

    async def write(high: int) -> int:
        """Start, and clocks until it is done."""
        await FallingEdge(dut.clk)
        dut.high.value = high
        dut.start.value = 1
        await FallingEdge(dut.clk)
        dut.start.value = 0
        for clocks in range(1, 2000):
            if int(dut.done.value):
                return clocks
            await FallingEdge(dut.clk)
        raise AssertionError("never done")

    dut.start.value = 0
    dut.drp_out.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    await ClockCycles(dut.clk, 3)
    assert int(dut.done.value)
    assert str(dut.drp_enable.value) == "0"
    cocotb.start_soon(port())
    for high, setting in ((0, LOW), (1, HIGH), (0, LOW)):
        before = {address: rng.randrange(1 << 16) for address in range(32)}
        registers |= before
        writes.clear()
        await write(high)
        wanted = registers_of(setting)
        assert sorted(writes) == sorted(wanted)
        for address, (mask, value) in wanted.items():
            assert registers[address] == before[address] & ~mask | value, hex(address)
    alive = False
    assert abs(await write(1) - CASE["timeout"]) < 8
    alive = True
    await write(1)
    assert len(writes) == 2 * len(wanted)


@for_entity("event_counter")
async def events_are_counted(dut: Any) -> None:
    """Up to the limit and no further, from 0 after each clearing."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    limit = 2 ** CASE["width"] - 1
    count = 0
    for i in range(200):
        add, clear = int(rng.random() < 0.7), int(i % 40 == 0)
        dut.add.value = add
        dut.clear.value = clear
        await FallingEdge(dut.clk)
        count = 0 if clear else min(count + add, limit)
        assert int(dut.count.value) == count


@for_entity("frame_rate_meter")
async def frame_rates(dut: Any) -> None:
    """Rates are rounded, at their limit, follow each frame, and are 0 when frames stop."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    tick = CASE["tick"]

    async def frames(units: int, count: int) -> None:
        for _ in range(count):
            for level, clocks in ((1, tick * units // 3), (0, tick * units - tick * units // 3)):
                dut.v_sync.value = level
                await ClockCycles(dut.clk, clocks)

    dut.v_sync.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    await frames(1000, 1)
    # An edge alone is no frame.
    assert int(dut.rate.value) == 0
    for units in (16683, 16667, 20000, 333, 305, 304, 100, rng.randrange(400, 30000)):
        # A frame, the division, and for short frames the one that it was busy with.
        await frames(units, 3 + 2 * (1 << 15) // (tick * units))
        assert int(dut.rate.value) in {
            min(int(1e7 / exact + 0.5), (1 << 15) - 1) for exact in (units, units - 1)
        }, units
    await ClockCycles(dut.clk, tick * (65535 - units) - 200)
    assert int(dut.rate.value) != 0
    await ClockCycles(dut.clk, 400)
    assert int(dut.rate.value) == 0
    # The first edge behind the silence is no frame.
    await frames(30000, 1)
    dut.v_sync.value = 1
    await ClockCycles(dut.clk, 4)
    assert int(dut.rate.value) == 0
    await ClockCycles(dut.clk, 400)
    assert int(dut.rate.value) == 333
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    assert int(dut.rate.value) == 0
