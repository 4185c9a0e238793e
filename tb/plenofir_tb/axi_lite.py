# SPDX-License-Identifier: Apache-2.0
"""AXI4-Lite with the channels of cocotbext-axi: any address, any strobes, random pauses."""

import logging
import random
from collections.abc import Iterator
from typing import Any

from cocotbext.axi import AxiLiteBus, AxiLiteMaster
from cocotbext.axi.axil_channels import (
    AxiLiteARSource,
    AxiLiteARTransaction,
    AxiLiteAWSource,
    AxiLiteAWTransaction,
    AxiLiteBSink,
    AxiLiteRSink,
    AxiLiteWSource,
    AxiLiteWTransaction,
)

from plenofir_tb.axi_video import StallPattern

OKAY, SLVERR = 0, 2


def quiet(dut: Any) -> None:
    """Log only errors of the library."""
    logging.getLogger(f"cocotb.{dut._name}").setLevel(logging.WARNING)


class Channels:
    """The five channels of a slave; address and data of a write come in any order."""

    def __init__(self, dut: Any, prefix: str = "s_axi_ctrl") -> None:
        quiet(dut)
        bus = AxiLiteBus.from_prefix(dut, prefix)
        clock = dut.clk, dut.reset
        self.write_address = AxiLiteAWSource(bus.write.aw, *clock)
        self.write_data = AxiLiteWSource(bus.write.w, *clock)
        self.written = AxiLiteBSink(bus.write.b, *clock)
        self.read_address = AxiLiteARSource(bus.read.ar, *clock)
        self.read_data = AxiLiteRSink(bus.read.r, *clock)

        self.all = (
            self.write_address,
            self.write_data,
            self.written,
            self.read_address,
            self.read_data,
        )

    def pause(self, patterns: Iterator[StallPattern]) -> None:
        """Give each channel a pattern of pauses."""
        for channel in self.all:
            channel.set_pause_generator(next(patterns))

    def clear(self) -> None:
        """Drop pending transfers, as in a reset."""
        for channel in self.all:
            channel.clear()

    async def write(self, address: int, word: int, strobes: int = 15) -> int:
        """Write a word; the answer."""
        await self.write_address.send(AxiLiteAWTransaction(awaddr=address, awprot=0))
        await self.write_data.send(AxiLiteWTransaction(wdata=word, wstrb=strobes))
        return int((await self.written.recv()).bresp)

    async def read(self, address: int) -> tuple[int, int]:
        """Read a word: it and the answer."""
        await self.read_address.send(AxiLiteARTransaction(araddr=address, arprot=0))
        answer = await self.read_data.recv()
        return int(answer.rdata), int(answer.rresp)


class Master:
    """The library's master, for words only; an error fails the test."""

    def __init__(self, dut: Any, prefix: str = "s_axi_ctrl") -> None:
        quiet(dut)
        self.master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, prefix), dut.clk, dut.reset)

    def pause(self, rng: random.Random, share: float) -> None:
        """Pause each channel in a share of the clocks."""
        write, read = self.master.write_if, self.master.read_if
        for channel in (
            write.aw_channel,
            write.w_channel,
            write.b_channel,
            read.ar_channel,
            read.r_channel,
        ):
            generator = random.Random(rng.random())
            channel.set_pause_generator(
                iter(lambda generator=generator: generator.random() < share, None)
            )

    async def write(self, address: int, word: int) -> None:
        answer = await self.master.write(address, word.to_bytes(4, "little"))
        assert int(answer.resp) == OKAY, f"write to {address:#x}: {answer.resp!r}"

    async def read(self, address: int) -> int:
        answer = await self.master.read(address, 4)
        assert int(answer.resp) == OKAY, f"read of {address:#x}: {answer.resp!r}"
        return int.from_bytes(answer.data, "little")
