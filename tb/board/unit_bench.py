# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the board's control entities; each is for the entity that it names."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, Timer

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
        return await self.read_here(count)

    async def read_here(self, count: int) -> list[int]:
        """Read bytes without writing an address."""
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
    # The address wraps at the size, as that of a 24LCS21 does, with and without being written.
    assert await master.read_block(126, 4) == [*edid[126:], *edid[:2]]
    assert await master.read_block(120, 4) == edid[120:124]
    assert await master.read_here(6) == [*edid[124:], *edid[:2]]
    assert await master.read_here(3) == edid[2:5]
    # A reset clears it.
    dut.reset.value = 1
    await Timer(100, "ns")
    dut.reset.value = 0
    assert await master.read_here(3) == edid[:3]
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
            assert clocks <= CASE["pause"] + 2
        assert abs(clocks - CASE["pause"]) <= 2
        await ClockCycles(dut.clk, 100)
        assert int(dut.present.value)
        dut.reset.value = 1
        await ClockCycles(dut.clk, 5)
        assert not int(dut.present.value)
        dut.reset.value = 0


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


@for_entity("camera_report")
async def what_a_camera_tells(dut: Any) -> None:
    """Each number in its place of the status; commands are obeyed, those of others refused."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.s_axis_tvalid.value, dut.m_axis_tready.value = 0, 1
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    # Characters come between the clock's edges; the first one would be missed at an edge.
    await FallingEdge(dut.clk)
    ports = {"setup_state": 2, "setup_entry": 12, "setup_fault": 2, "setup_retried": 8}
    ports |= {"frames": 15, "lines": 15, "fault_counts": 64, "left_counts": 32}
    ports |= {"left_identifier": 8, "lens_flags": 6, "core_flags": 5}
    pulses = {"clear": 0, "set_up": 0}

    async def ask(line: str) -> str:
        answer = ""
        for character in line + "\n":
            dut.s_axis_tdata.value, dut.s_axis_tvalid.value = ord(character), 1
            await FallingEdge(dut.clk)
        dut.s_axis_tvalid.value = 0
        for _ in range(1000):
            if answer.endswith("\n"):
                break
            await FallingEdge(dut.clk)
            for name in pulses:
                pulses[name] += int(getattr(dut, name).value)
            if dut.m_axis_tvalid.value == 1:
                answer += chr(int(dut.m_axis_tdata.value))
        else:
            raise AssertionError(f"no end of the answer {answer!r} to {line!r}")
        await ClockCycles(dut.clk, 3)
        await FallingEdge(dut.clk)
        return answer.strip()

    # Some draws, as two bits that are exchanged look the same in half of them.
    for _ in range(5):
        values = {name: rng.getrandbits(bits) for name, bits in ports.items()}
        for name, value in values.items():
            getattr(dut, name).value = value
        wanted = [values[name] for name in list(ports)[:6]]
        for name, count in (("fault_counts", 8), ("left_counts", 4)):
            wanted += [values[name] >> 8 * n & 255 for n in range(count)]
        wanted += [values["left_identifier"] >> 6, values["left_identifier"] & 63]
        wanted += [values["lens_flags"], values["core_flags"]]
        status = await ask("?")
        names = [field.partition("=")[0] for field in status.split()]
        assert names[:6] == ["setup", "entry", "fault", "repeated", "frames", "lines"]
        assert names[14:19] == ["other_type", "other_channel", "no_lines", "no_pixels", "left_out"]
        numbers = [int(n) for field in status.split() for n in field.partition("=")[2].split("/")]
        assert numbers == wanted
    assert await ask("i") == "ok"
    assert await ask("c") == "ok"
    assert pulses == {"clear": 1, "set_up": 1}
    for line in ("i 1", "w 1", "p 1", "t 1", "s 0", "o 0", "h 0", "x"):
        assert await ask(line) == "error", line
    assert pulses == {"clear": 1, "set_up": 1}
