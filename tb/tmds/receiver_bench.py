# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``tmds_receiver`` against the Python receiver: DVI and HDMI, with wrong bits."""

import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import Timer

from hunt.video_sources import EDGES, Source
from plenofir.fpga.hdmi.link import Packed, encode_frames
from plenofir.fpga.hdmi.tmds import TOKENS
from plenofir_tb.hdmi import packets
from plenofir_tb.hdmi.islands import encode_hdmi, receive
from plenofir_tb.hdmi.packets import AviInfo, Colorimetry, ColourSpace, Packet
from plenofir_tb.video import shrunken

# Room for an island between lines, and for many in the vertical blanking.
MODE = shrunken(
    "hdmi", h_active=20, h_front=9, h_sync=30, h_back=37, v_active=18, v_front=1, v_sync=2, v_back=2
)
FRAME = MODE.h_total * MODE.v_total
# Frames until the receiver is locked and knows the source.
FIRST_FRAMES = 3
# Reports come two clocks after the last word of a packet.
TOLD_LATE = 2


def random_packets(rng: random.Random) -> Iterator[Packet]:
    """Make packets of all kinds, now and then an InfoFrame with a wrong sum."""
    while True:
        info = AviInfo(
            ColourSpace(rng.randrange(4)),
            Colorimetry(rng.randrange(4)),
            rng.randrange(8),
            rng.randrange(4),
            rng.randrange(4),
            rng.choice([0, 1, 2, 4, 16, 17, 19, 35, 59, 60, rng.randrange(256)]),
        ).packet()
        yield rng.choice(
            [
                info,
                info,
                Packet(info.header, bytes([info.body[0] ^ 1 << rng.randrange(8)]) + info.body[1:]),
                packets.NULL_PACKET,
                packets.audio_clock_packet(rng.randrange(1 << 20), rng.randrange(1 << 20)),
                packets.audio_sample_packet([(rng.randrange(1 << 24), rng.randrange(1 << 24))]),
                packets.general_control_packet(mute=rng.random() < 0.5),
                packets.audio_info_packet(),
                Packet(rng.randbytes(3), rng.randbytes(28)),
            ]
        )


def spoil(words: Packed, rng: random.Random) -> None:
    """Invert bits: single ones anywhere, and words that are wrong in all channels.

    The deskew accepts two equal measurements in a row, so lost tokens, which end a run too early,
    have a right run between them.
    """
    right = words.copy()
    for _ in range(len(words) // 150):
        words[rng.randrange(len(words))] ^= np.uint32(1 << rng.randrange(30))
    for _ in range(len(words) // 1500):
        words[rng.randrange(len(words))] ^= np.uint32(rng.getrandbits(30))
    last = 0
    for i in np.nonzero(words != right)[0].tolist():
        before, now = (
            [int(word) >> 10 * c & 0x3FF in TOKENS for c in range(3)]
            for word in (right[i], words[i])
        )
        if not any(was and not still for was, still in zip(before, now, strict=True)):
            continue
        if i - last < 2 * MODE.h_total:
            words[i] = right[i]
        else:
            last = i


@dataclass
class Taken:
    """The output, one entry a clock."""

    video: list[tuple[int, ...]] = field(default_factory=list)
    told: list[tuple[int, ...]] = field(default_factory=list)
    wrong: list[tuple[int, ...]] = field(default_factory=list)


VIDEO = ("active", "h_sync", "v_sync", "pixel", "errors", "hdmi")
TOLD = ("informed", "colour", "limited", "bt601", "format_code")
WRONG = ("packet_error", "sum_error")
NOTHING_TOLD = (0, 0, 0, 0, 0)


async def play(dut: Any, words: list[int]) -> Taken:
    taken = Taken()
    groups = [
        ([getattr(dut, name) for name in names], out)
        for names, out in ((VIDEO, taken.video), (TOLD, taken.told), (WRONG, taken.wrong))
    ]
    for word in words:
        dut.clk.value = 1
        await Timer(1, "ns")
        dut.clk.value = 0
        dut.bits.value = word
        await Timer(1, "ns")
        for ports, out in groups:
            values = [port.value for port in ports]
            good = all(value.is_resolvable for value in values)
            out.append(tuple(map(int, values)) if good else ())
    return taken


def told_by(info: AviInfo) -> tuple[int, ...]:
    return (1, info.colour_space, info.limited, info.bt601, info.format_code)


@cocotb.test()
async def as_the_python_receiver(dut: Any) -> None:
    """HDMI, wrong bits, DVI, HDMI again: video, errors, packets and their contents agree."""
    rng = random.Random(cocotb.RANDOM_SEED)
    pixels = np.random.default_rng(cocotb.RANDOM_SEED)

    def frames(count: int) -> list[np.ndarray]:
        shape = (count, MODE.v_active, MODE.h_active, 3)
        return list(pixels.integers(0, 256, shape, np.uint8))

    sent = random_packets(rng)
    parts = [
        encode_hdmi(MODE, frames(FIRST_FRAMES), sent),
        encode_hdmi(MODE, frames(3), sent),
        encode_frames(MODE, frames(1)),
        encode_hdmi(MODE, frames(1), sent),
        # Values for a source without packets.
        encode_hdmi(MODE, frames(1), iter([])),
    ]
    spoil(parts[1], rng)
    spoil(parts[2], rng)
    words = np.concatenate(parts)
    want = receive(words)
    dut.reset.value = 1
    await play(dut, words[:8].tolist())
    dut.reset.value = 0
    taken = await play(dut, [*words.tolist(), *[int(words[0])] * 40])

    signals = want.signals
    rgb = signals.pixels.astype(int) @ np.array([1, 1 << 8, 1 << 16])
    errors = want.errors.astype(int) @ np.array([1, 2, 4])
    columns = (signals.active, signals.h_sync, signals.v_sync, rgb, errors, want.hdmi)
    video = list(zip(*(column.astype(int).tolist() for column in columns), strict=True))
    begin, end = FIRST_FRAMES * FRAME, len(words)
    # The clocks from a word to its output.
    late = taken.video.index(video[begin], begin) - begin
    for i in range(begin, end):
        assert taken.video[i + late] == video[i], (
            f"word {i}: {dict(zip(VIDEO, video[i], strict=True))}"
        )

    now = NOTHING_TOLD
    ends = {packet.end: packet for packet in want.packets}
    kinds = [0, 0, 0]
    for i in range(end - 1):
        at = i + late + TOLD_LATE
        torn = wrong = False
        # Information of a DVI source does not matter; that it is DVI is known a clock earlier.
        if not want.hdmi[i + 1]:
            now = NOTHING_TOLD
        elif i in ends:
            packet = ends[i].packet
            torn = not ends[i].intact
            wrong = not torn and packet.is_info_frame and not packet.sum_is_right
            info = None if torn else packets.read_avi(packet)
            now = told_by(info) if info else now
            if i >= begin:
                kinds = [n + k for n, k in zip(kinds, (torn, wrong, info is not None), strict=True)]
        if i >= begin:
            assert taken.wrong[at] == (torn, wrong), f"packet that ends at {i}"
            assert taken.told[at] == now, f"told behind word {i}"
    assert all(kinds), kinds
    assert int(dut.locked.value)
    assert int(dut.aligned.value) == 7
    dut.reset.value = 1
    after = await play(dut, words[:4].tolist())
    active, _, _, _, wrong_words, hdmi = after.video[-1]
    assert (active, wrong_words, hdmi, int(dut.locked.value)) == (0, 0, 0, 0)
    assert after.told[-1] == NOTHING_TOLD


@cocotb.test()
async def free_control_bits_and_swapped_pairs(dut: Any) -> None:
    """DVI with any constant control bits, or repeated syncs, shows its picture and no swapped pair.

    With all polarities of the syncs, and first pixels that are words of a guard band. With HDMI
    all combinations of swapped pairs are found.
    """
    rng = random.Random(cocotb.RANDOM_SEED)
    lines, rows = (8, 4, 6, 14), (3, 1, 1, 2)
    levels = [(h, v) for h in (0, 1) for v in (0, 1)]
    sources = [
        Source(rng, lines, rows, *levels[bits % 4], control="constant", constant=bits)
        for bits in range(16)
    ]
    sources += [
        Source(rng, lines, rows, h, v, control=control)
        for h, v in levels
        for control in ("syncs", "hsync", "noise")
    ]
    sources += [
        Source(rng, lines, rows, *levels[swapped % 4], hdmi=True, swapped=swapped)
        for swapped in range(8)
    ]
    dut.reset.value = 1
    await play(dut, [0] * 8)
    dut.reset.value = 0
    late = range(2, 40)
    for source in sources:
        if not source.hdmi:
            source.edge = rng.choice(EDGES)
        # Skew and polarity are found in the first frame.
        first = source.send(2)[1]
        signals, words = source.send(1)
        packed = [w[0] | w[1] << 10 | w[2] << 20 for w in (*first, *words)]
        taken = await play(dut, packed)
        want = [(*signal, 0, int(source.hdmi)) for signal in signals]
        got = taken.video[len(first) :]
        late = [n for n in late if got[n:] == want[: len(want) - n]]
        assert late, (source.control, source.constant, source.edge, source.swapped)
        assert int(dut.inverted.value) == source.swapped, (source.control, source.constant)
