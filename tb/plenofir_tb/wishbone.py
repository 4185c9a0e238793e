# SPDX-License-Identifier: Apache-2.0
"""Wishbone with the master of cocotbext-wishbone: standard cycles, words of 32 bits."""

import logging
import random
from typing import Any

from cocotb.triggers import Lock
from cocotbext.wishbone.driver import WBOp, WishboneMaster

ACK, ERR = 1, 2
_SIGNALS = {
    **{name: name for name in ("cyc", "stb", "we", "adr", "sel", "ack", "err")},
    "datwr": "dat_w",
    "datrd": "dat_r",
}


class Master:
    """Words by their addresses in bytes; it idles before some of them."""

    def __init__(self, dut: Any, prefix: str = "s_wb") -> None:
        logging.getLogger("cocotb").setLevel(logging.WARNING)
        self._master = WishboneMaster(dut, prefix, dut.clk, signals_dict=_SIGNALS)
        self._lock = Lock()
        self._rng = random.Random()
        self._share = 0.0

    def pause(self, rng: random.Random, share: float) -> None:
        """Idle before a share of the cycles."""
        self._rng, self._share = random.Random(rng.random()), share

    async def access(
        self, address: int, word: int | None = None, strobes: int = 15
    ) -> tuple[int, int]:
        """Write a word, or read one: what came back, and the answer."""
        idle = self._rng.randrange(1, 6) if self._rng.random() < self._share else 0
        async with self._lock:
            operation = WBOp(address // 4, word, idle=idle, sel=strobes)
            (result,) = await self._master.send_cycle([operation])
        return (int(result.datrd) if word is None else 0), result.ack

    async def write(self, address: int, word: int) -> None:
        _, answer = await self.access(address, word)
        assert answer == ACK, f"write to {address:#x}: {answer}"

    async def read(self, address: int) -> int:
        word, answer = await self.access(address)
        assert answer == ACK, f"read of {address:#x}: {answer}"
        return word
