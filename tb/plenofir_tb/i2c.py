# SPDX-License-Identifier: Apache-2.0
"""An I2C master, composed of moves of one line and a wait each."""

from abc import ABC, abstractmethod


class I2cMaster(ABC):
    """Conditions, bits and bytes; a bench implements the moves of the lines."""

    @abstractmethod
    async def clock(self, level: int) -> None:
        """Move the clock line, and wait a quarter of a bit."""

    @abstractmethod
    async def data(self, level: int) -> None:
        """Pull the data line (0) or leave it (1), and wait a quarter of a bit."""

    @abstractmethod
    def seen(self) -> int:
        """Level of the data line."""

    async def start(self) -> None:
        """Start condition, repeated or not."""
        await self.data(1)
        await self.clock(1)
        await self.data(0)
        await self.clock(0)

    async def stop(self) -> None:
        await self.clock(0)
        await self.data(0)
        await self.clock(1)
        await self.data(1)

    async def bit(self, level: int) -> int:
        """Send a bit (1: leave the line to the slave) ; what the line said."""
        await self.data(level)
        await self.clock(1)
        seen = self.seen()
        await self.clock(0)
        return seen

    async def write(self, byte: int) -> bool:
        """Send a byte; whether it was acknowledged."""
        for i in range(7, -1, -1):
            level = byte >> i & 1
            assert await self.bit(level) == level, "the slave pulls the line while the master sends"
        return not await self.bit(1)

    async def read(self, *, more: bool) -> int:
        """Receive a byte, acknowledging it if more are wanted."""
        byte = 0
        for _ in range(8):
            byte = byte << 1 | await self.bit(1)
        await self.bit(int(not more))
        return byte
