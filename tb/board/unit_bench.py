"""cocotb tests of the board's control entities; each is for the entity that it names."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from plenofir.hdmi.edid import make_edid, offered_modes
from plenofir_tb.entities import for_entity
from plenofir_tb.runner import read_case

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
    modes = offered_modes(CASE["max_columns"])
    edid = list(make_edid(modes, preferred=modes[-1]))
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
