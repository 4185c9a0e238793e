# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of csi_receiver: each format, each header bit, another project's transmitter."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from csi.transmitter import Lanes, TransmitterOnPins
from plenofir.fpga.csi import (
    Kind,
    checksum,
    frame_packets,
    header,
    lane_clocks,
    long_packet,
    raw_kind,
)
from plenofir_tb.case import read_case

CASE = read_case()
LANES, BITS, PIXELS = CASE["lanes"], CASE["bits"], CASE["pixels"]
UNIT = {8: 1, 10: 4, 12: 2}[BITS]
COUNTS = ("corrected", "damaged", "payload", "cut", "lanes", "order", "size", "lost")
CLOCK_PS = 10_000
# Not faster than pixels can leave.
BYTE_PS = CASE.get("byte_ps") or 2 * int(CLOCK_PS * max(0.6, 1.5 * 8 * LANES / BITS / PIXELS) / 2)


class Bench:
    """The receiver, its lanes, and what came out: frames, lines, pixels."""

    def __init__(self, dut: Any, columns: int, rows: int) -> None:
        self.dut, self.columns, self.rows = dut, columns, rows
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.pixels = np.random.default_rng(cocotb.RANDOM_SEED)
        self.frames: list[list[list[int]]] = []

    async def begin(self, channel: int = 0, lanes: Lanes | None = None) -> None:
        """Start clocks and lanes, if they do not run yet, reset, take what comes."""
        dut = self.dut
        if lanes is None:
            Clock(dut.clk, CLOCK_PS, "ps").start()
        for name in ("lane_valid", "lane_sync", "lane_data", "lane_missed", "fault_clear"):
            getattr(dut, name).value = 0
        dut.m_axis_tready.value, dut.reset.value = 1, 1
        dut.columns.value, dut.rows.value = self.columns, self.rows
        dut.virtual_channel.value = channel
        self.lanes = lanes or Lanes(dut, LANES, BYTE_PS)
        await ClockCycles(dut.clk, 20)
        dut.fault_clear.value = 1
        await ClockCycles(dut.clk, 2)
        dut.reset.value, dut.fault_clear.value = 0, 0
        cocotb.start_soon(self.take())

    async def take(self) -> None:
        """Collect frames for good."""
        dut, line = self.dut, []
        while True:
            await FallingEdge(dut.clk)
            if dut.m_axis_tvalid.value != 1 or dut.m_axis_tready.value != 1:
                continue
            word = str(dut.m_axis_tdata.value)[::-1]
            if dut.m_axis_tuser.value == 1:
                assert not line, "a frame begins inside a line"
                self.frames.append([])
            line.append([word[n * BITS : (n + 1) * BITS][::-1] for n in range(PIXELS)])
            if dut.m_axis_tlast.value == 1:
                pixels = [text for part in line for text in part][: self.columns]
                self.frames[-1].append([int(text, 2) for text in pixels])
                line = []

    def picture(self) -> np.ndarray:
        return self.pixels.integers(0, 1 << BITS, (self.rows, self.columns), np.uint16)

    def counts(self) -> dict[str, int]:
        """Read the counts that are not zero."""
        text = str(self.dut.fault_counts.value)[::-1]
        width = len(text) // len(COUNTS)
        values = [int(text[n * width : (n + 1) * width][::-1], 2) for n in range(len(COUNTS))]
        return {name: value for name, value in zip(COUNTS, values, strict=True) if value}

    def left_out(self) -> tuple[list[int], int]:
        """Counts of packets that are left out, and the last one's data identifier."""
        value = int(self.dut.left_counts.value)
        width = len(self.dut.left_counts) // 4
        counts = [value >> n * width & (1 << width) - 1 for n in range(4)]
        return counts, int(self.dut.left_identifier.value)

    def check(self, pictures: list[np.ndarray]) -> None:
        """Compare the frames that came, and forget them."""
        assert len(self.frames) == len(pictures)
        for got, want in zip(self.frames, pictures, strict=True):
            assert np.array_equal(np.array(got), want)
        self.frames.clear()

    def skews(self) -> list[int]:
        """Draw a skew for each lane."""
        return [self.rng.randint(0, 3) for _ in range(LANES)]


@cocotb.test()
async def frames_of_any_width(dut: Any) -> None:
    """Lines of any number of pixel groups, skewed lanes, other packets in between: all pixels."""
    lanes = None
    for number, units in enumerate(range(1, 12)):
        bench = Bench(dut, UNIT * units, 3)
        channel = number % 4
        await bench.begin(channel, lanes)
        lanes = bench.lanes
        pictures = [bench.picture() for _ in range(2)]
        for frame, picture in enumerate(pictures):
            packets = frame_packets(picture, BITS, channel=channel, number=frame)
            others = [
                long_packet(channel, Kind.EMBEDDED, bytes(range(frame + 5))),
                header(channel, Kind.LINE_START, 1),
                long_packet(channel ^ 1, raw_kind(BITS), bytes(12)),
                header(channel ^ 2, Kind.FRAME_END, 0),
            ]
            for other in others:
                packets.insert(bench.rng.randint(0, len(packets)), other)
            gap = bench.rng.randint(2, 9)
            bench.lanes.send(packets, skews=bench.skews(), gap=gap)
        await bench.lanes.sent()
        bench.check(pictures)
        assert bench.counts() == {}
        if number >= CASE["widths"]:
            break


@cocotb.test()
async def frames_that_are_not_shown(dut: Any) -> None:
    """Lines of another type and channel, frames without any, are counted and named."""
    bench = Bench(dut, UNIT * 2, 3)
    await bench.begin(1)
    other = 8 if BITS != 8 else 12
    picture = bench.picture() & 0xFF
    bench.lanes.send(frame_packets(picture, other, channel=1))
    await bench.lanes.sent()
    assert bench.left_out() == ([3, 0, 1, 0], 1 << 6 | raw_kind(other))
    assert bench.counts() == {"size": 1}
    bench.lanes.send(frame_packets(picture, BITS, channel=2))
    await bench.lanes.sent()
    # The start and the end of another channel's frame have no pixels.
    assert bench.left_out() == ([3, 3, 1, 2], 2 << 6 | raw_kind(BITS))
    bench.lanes.send([long_packet(1, Kind.EMBEDDED, bytes(7)), header(1, 0x08, 77)])
    await bench.lanes.sent()
    assert bench.left_out() == ([3, 3, 1, 4], 2 << 6 | raw_kind(BITS))
    assert bench.counts() == {"size": 1}
    bench.check([])


@cocotb.test()
async def bursts_that_follow_at_once(dut: Any) -> None:
    """A clock of rest on each lane is enough, with any skew; a dead lane is counted by bursts."""
    bench = Bench(dut, UNIT * 2, 2)
    await bench.begin()
    pictures = [bench.picture() for _ in range(8)]
    for number, picture in enumerate(pictures):
        packets = [header(0, Kind.LINE_START, number), *frame_packets(picture, BITS)]
        for packet in packets:
            # `lane_clocks` lets all lanes end; this leaves the clock that the latest one needs.
            skews = bench.skews()
            bench.lanes.send([packet], skews=skews, gap=1)
    await bench.lanes.sent()
    bench.check(pictures)
    assert bench.counts() == {}
    if LANES > 1:
        for entries in lane_clocks(frame_packets(pictures[0], BITS), LANES, gap=2).tolist():
            bench.lanes.clock([entries[0], *[0] * (LANES - 1)])
        await bench.lanes.sent()
        assert bench.counts() == {"lanes": 4}


@cocotb.test()
async def bursts_that_no_lane_begins(dut: Any) -> None:
    """A D-PHY that tells of bursts without a sync: each counts once, whatever the lanes' skews."""
    bench = Bench(dut, UNIT * 2, 2)
    await bench.begin()
    await bench.lanes.sent()

    async def end_without_sync(lanes: range) -> None:
        skews = bench.skews()
        for clock in range(60):
            await FallingEdge(dut.byte_clk)
            dut.lane_missed.value = sum((clock == skews[n]) << n for n in lanes)

    for number in range(1, 9):
        await end_without_sync(range(LANES))
        await bench.lanes.sent()
        assert bench.counts() == {"lanes": number}
    if LANES > 1:
        # Lane 0 began this one: its sync alone tells, and the next burst is not taken for it.
        bench.lanes.clock([0x300, *[0] * (LANES - 1)])
        await FallingEdge(dut.byte_clk)
        await end_without_sync(range(1, LANES))
        await end_without_sync(range(LANES))
        await bench.lanes.sent()
        assert bench.counts() == {"lanes": 10}
    picture = bench.picture()
    bench.lanes.send(frame_packets(picture, BITS), skews=bench.skews(), gap=4)
    await bench.lanes.sent()
    bench.check([picture])


@cocotb.test()
async def each_wrong_bit_of_each_header(dut: Any) -> None:
    """Any single wrong bit is corrected and counted, and every pixel is right."""
    bench = Bench(dut, UNIT * 2, 1)
    await bench.begin()
    expected = 0
    for place in range(3):
        for bit in range(32):
            picture = bench.picture()
            packets = [bytearray(packet) for packet in frame_packets(picture, BITS)]
            packets[place][bit // 8] ^= 1 << bit % 8
            bench.lanes.send([bytes(packet) for packet in packets], skews=bench.skews(), gap=4)
            expected += 1
            await bench.lanes.sent()
            bench.check([picture])
            assert bench.counts() == {"corrected": expected}, (place, bit)


@cocotb.test()
async def each_wrong_bit_of_a_line(dut: Any) -> None:
    """One wrong bit of payload or checksum is reported, and the next frame is right."""
    bench = Bench(dut, UNIT * 2, 1)
    await bench.begin()
    packets = frame_packets(bench.picture(), BITS)
    bits = range(32, 8 * len(packets[1]))
    for bit in bits:
        wrong = bytearray(packets[1])
        wrong[bit // 8] ^= 1 << bit % 8
        bench.lanes.send([packets[0], bytes(wrong), packets[2]], skews=bench.skews(), gap=4)
    await bench.lanes.sent()
    assert bench.counts() == {"payload": len(bits)}
    bench.frames.clear()
    picture = bench.picture()
    bench.lanes.send(frame_packets(picture, BITS))
    await bench.lanes.sent()
    bench.check([picture])


@cocotb.test()
async def lines_cut_short(dut: Any) -> None:
    """A line that ends before its checksum does is reported, and the next frame is right.

    It is reported as a line of another size, too, if pixels are missing.
    """
    bench = Bench(dut, UNIT * 4, 1)
    await bench.begin()
    packets = frame_packets(bench.picture(), BITS)
    # Whole words of all lanes, with the header and something behind it.
    ends = range(-(-5 // LANES) * LANES, len(packets[1]), LANES)
    for end in ends:
        bench.lanes.send([packets[0], packets[1][:end], packets[2]], skews=bench.skews(), gap=4)
    await bench.lanes.sent()
    counts = bench.counts()
    assert counts["cut"] == len(ends)
    assert counts.keys() <= {"cut", "size"}
    bench.frames.clear()
    picture = bench.picture()
    bench.lanes.send(frame_packets(picture, BITS))
    await bench.lanes.sent()
    bench.check([picture])


@cocotb.test()
async def a_transmitter_of_others(dut: Any) -> None:
    """All pixels from the pins of cocotbext-mipi-csi2."""
    from cocotbext.mipi_csi2 import utils
    from cocotbext.mipi_csi2.config import DataType
    from cocotbext.mipi_csi2.packet import Csi2PacketBuilder

    pack = {8: bytes, 10: utils.pack_raw10, 12: utils.pack_raw12}[BITS]
    bench = Bench(dut, 8, 2)
    await bench.begin(2)
    builder = Csi2PacketBuilder().set_virtual_channel(2)
    transmitter = TransmitterOnPins(LANES, 100)
    picture = bench.picture()
    packets = [builder.build_frame_start(1)]
    for number, line in enumerate(picture.tolist(), 1):
        data = builder.build_pixel_data(DataType(raw_kind(BITS)), pack(line))
        packets += [builder.build_line_start(number), data, builder.build_line_end(number)]
    packets.append(builder.build_frame_end(1))
    for packet in packets:
        head = packet.header
        head.ecc = header(head.virtual_channel, head.data_type, head.word_count)[3]
        if packet.is_long_packet():
            packet.checksum = checksum(packet.payload)
        await transmitter.send(packet.to_bytes(), bench.lanes, bench.skews())
    await bench.lanes.sent()
    bench.check([picture])
    assert bench.counts() == {}
