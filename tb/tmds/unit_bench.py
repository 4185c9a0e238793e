# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the TMDS entities against the Python codec; each is for the entity it names."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from plenofir.fpga.hdmi import tmds
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity
from plenofir_tb.hdmi.packets import AviInfo, Colorimetry, ColourSpace, Packet, audio_info_packet
from plenofir_tb.hdmi.words import ISLAND_GUARD, TERC4, VIDEO_GUARDS, is_data_word
from plenofir_tb.resets import reset_is_whole

CASE = read_case()
PERIOD = 10


def start(dut: Any) -> random.Random:
    Clock(dut.clk, PERIOD, "ns").start()
    return random.Random(cocotb.RANDOM_SEED)


async def reset(dut: Any, clocks: int = 3) -> None:
    dut.reset.value = 1
    for _ in range(clocks):
        await FallingEdge(dut.clk)
    dut.reset.value = 0


def covering_bytes(rng: random.Random) -> list[int]:
    """Bytes whose coding visits every byte at every running disparity."""
    todo = {d: set(range(256)) for d in tmds.DISPARITIES}
    disparity = 0
    sent = []
    while any(todo.values()):
        byte = todo[disparity].pop() if todo[disparity] else rng.randrange(256)
        sent.append(byte)
        disparity = tmds.encode_byte(byte, disparity)[1]
    return sent


@for_entity("tmds_encoder")
async def every_byte_at_every_disparity(dut: Any) -> None:
    """All 9 * 256 pairs of disparity and byte, and all tokens between random data."""
    rng = start(dut)
    data = covering_bytes(rng)
    active = [True] * len(data)
    for _ in range(200):
        length = rng.randint(1, 6)
        active += [rng.random() < 0.5] * length
        data += [rng.randrange(256) for _ in range(length)]
    control = [rng.randrange(4) for _ in data]
    want = tmds.encode_channel(
        np.array(data, np.uint8), np.array(active), np.array(control, np.uint8)
    ).tolist()
    dut.active.value = 0
    dut.control.value = 0
    dut.data.value = 0
    await reset(dut, 4)
    got = []
    for i in range(len(data) + 3):
        if i >= 3:
            got.append(int(dut.word.value))
        at = min(i, len(data) - 1)
        dut.active.value = int(active[at])
        dut.control.value = control[at]
        dut.data.value = data[at]
        await FallingEdge(dut.clk)
    wrong = [(i, hex(g), hex(w)) for i, (g, w) in enumerate(zip(got, want, strict=True)) if g != w]
    assert not wrong, f"{len(wrong)} wrong, first (index, got, want) {wrong[0]}"


@for_entity("tmds_encoder")
async def encoder_begins_anew(dut: Any) -> None:
    """A reset at any time clears the disparity and the words under way."""
    rng = start(dut)
    await FallingEdge(dut.clk)
    inputs = [
        {"active": rng.random() < 0.8, "control": rng.randrange(4), "data": rng.randrange(256)}
        for _ in range(300)
    ]
    ends = rng.sample(range(40, 290), 12)
    await reset_is_whole(dut, inputs, ends, cleared=(), others=["word"], after=10)
    dut.active.value = 1
    for _ in range(4):
        await reset(dut, 1)
        for _ in range(2):
            await FallingEdge(dut.clk)
            assert int(dut.word.value) in tmds.TOKENS
        for _ in range(rng.randrange(3, 6)):
            await FallingEdge(dut.clk)
            assert int(dut.word.value) not in tmds.TOKENS


@for_entity("tmds_decoder")
async def decoder_begins_anew(dut: Any) -> None:
    """A reset at any time invalidates the words under way."""
    rng = start(dut)
    await FallingEdge(dut.clk)
    inputs = [{"word": rng.choice([rng.randrange(1024), *tmds.TOKENS])} for _ in range(300)]
    await reset_is_whole(
        *(dut, inputs, rng.sample(range(40, 290), 12)),
        cleared=["active", "error"],
        others=["data", "control", "is_nibble", "nibble", "is_guard"],
        settled=2,
        after=10,
    )


@for_entity("tmds_decoder")
async def every_word(dut: Any) -> None:
    """All 1024 words: byte, token, legal or not, four bits of an island, guard band."""
    rng = start(dut)
    words = list(range(1024)) + rng.choices(range(1024), k=500)
    dut.word.value = tmds.TOKENS[0]
    await reset(dut)
    control = 0
    for i in range(len(words) + 2):
        if i >= 2:
            word = words[i - 2]
            token = word in tmds.TOKENS
            control = tmds.TOKENS.index(word) if token else control
            got = (int(dut.active.value), int(dut.data.value), int(dut.control.value))
            assert got == (not token, 0 if token else tmds.decode_word(word), control), hex(word)
            assert int(dut.error.value) == (not token and not is_data_word(word)), hex(word)
            nibble = TERC4.index(word) if word in TERC4 else None
            assert int(dut.is_nibble.value) == (nibble is not None), hex(word)
            assert int(dut.nibble.value) == (nibble or 0), hex(word)
            assert int(dut.is_guard.value) == (word == ISLAND_GUARD), hex(word)
        dut.word.value = words[min(i, len(words) - 1)]
        await FallingEdge(dut.clk)


@for_entity("tmds_periods")
async def what_a_preamble_begins(dut: Any) -> None:
    """Preambles and guard bands with faults, resets in preambles: what follows, and HDMI or DVI.

    Of a source that is not known to send HDMI all words must be right, of another one some.
    """
    rng = start(dut)
    words, enough, guards, plain_lines = 8, 4, 3, 16
    for port in ("active", "control", "data", "error", "is_nibble", "nibble", "is_guard"):
        getattr(dut, f"words_{port}").value = 0
    await reset(dut)
    hdmi, plain, kinds = False, 0, set()
    for _ in range(2000):
        # Votes of channels 1 and 2; tokens of a preamble in a row in channel 1.
        votes, run = [0, 0], 0
        # Whole ones and their imitations are rare by chance.
        whole = rng.choice(("video", "island", "")) if rng.random() < 0.3 else ""
        length = rng.choice((words, words, words - 1, words + 1, 14))
        shares = [rng.choice((0.1, 0.6, 0.9, 1)) for _ in votes]
        begins_anew = rng.choice((None, None, None, rng.randrange(4, 14)))
        dut.words_active.value = 0
        for clock in range(14):
            dut.reset.value = int(clock == begins_anew)
            if clock == begins_anew:
                votes, run, hdmi, plain = [0, 0], 0, False, 0
            control = rng.randrange(4)
            for i, share in enumerate(shares):
                token = 1 if rng.random() < share else rng.choice((0, 2, 3))
                if whole:
                    token = int(14 - clock <= length and (i == 0 or whole == "island"))
                votes[i] = min(words, votes[i] + 1) if token == 1 else max(0, votes[i] - 1)
                if i == 0:
                    run = run + 1 if token == 1 else 0
                control |= token << 2 * (i + 1)
            dut.words_control.value = control
            await FallingEdge(dut.clk)
        dut.reset.value = 0
        dut.words_active.value = 7
        island = video = 0
        spoilt = rng.choice((None, None, rng.randrange(6)))
        for i in range(2):
            blue, red = (rng.choice((8, 8, 12, 15, rng.randrange(16))) for _ in range(2))
            blue_is, red_is, green_guard, red_guard = (rng.random() < 0.6 for _ in range(4))
            if whole:
                right = [spoilt != 3 * i + c for c in range(3)]
                blue, red = 8 if whole == "video" else rng.randrange(12, 16), 8
                blue_is, green_guard = right[0], right[1]
                red_is, red_guard = (
                    right[2] and whole == "video",
                    right[2] and whole == "island",
                )
            video += (blue_is and blue == 8) + green_guard + (red_is and red == 8)
            island += (blue_is and blue >= 12) + green_guard + red_guard
            dut.words_is_nibble.value = blue_is | red_is << 2
            dut.words_nibble.value = blue | red << 8
            dut.words_is_guard.value = green_guard << 1 | red_guard << 2
            await FallingEdge(dut.clk)
        begun = [(int(dut.active.value), int(dut.island_start.value))]
        for _ in range(2):
            dut.words_is_nibble.value = dut.words_is_guard.value = 0
            await FallingEdge(dut.clk)
            begun.append((int(dut.active.value), int(dut.island_start.value)))
        is_island = all_island = run == words and votes[1] == words and island == 6
        is_video = all_video = run == words and votes[1] == 0 and video == 6
        if hdmi:
            is_island = all_island or (min(votes) >= enough and island >= guards)
            is_video = all_video or (votes[0] >= enough > votes[1] and video >= guards)
        if is_island:
            want = [(0, 1), (0, 1), (0, 0)]
        elif is_video:
            want = [(0, 0), (0, 0), (1, 0)]
        else:
            want = [(1, 0)] * 3
        case = (whole, length, hdmi, votes, run, begins_anew, video, island)
        assert begun == want, case
        kinds.add((hdmi, is_island, is_video))
        if all_island or all_video:
            hdmi, plain = True, 0
        elif plain == plain_lines - 1:
            hdmi = False
        else:
            plain += 1
        assert int(dut.hdmi.value) == hdmi, case
    assert len(kinds) == 6, kinds


def some_lines(rng: random.Random, lines: int, active: int, blank: int) -> list[int]:
    """Words of a channel: lines of random data with random tokens between them."""
    width = active + blank
    on = np.tile(np.arange(width) < active, lines)
    data = np.array([rng.randrange(256) for _ in range(lines * width)], np.uint8)
    control = np.repeat(np.array([rng.randrange(4) for _ in range(lines * width // 4)]), 4)
    return tmds.encode_channel(data, on, control.astype(np.uint8)).tolist()


def bits_of(words: list[int]) -> list[int]:
    return [word >> i & 1 for word in words for i in range(10)]


def words_of(bits: list[int]) -> list[int]:
    return [
        sum(bit << i for i, bit in enumerate(bits[at : at + 10]))
        for at in range(0, len(bits) - 9, 10)
    ]


async def send_words(dut: Any, words: list[int]) -> list[tuple[int, bool, bool]]:
    """Send ten bits a clock; result: the output for each."""
    got = []
    for word in words:
        dut.bits.value = word
        await FallingEdge(dut.clk)
        if "U" in str(dut.word.value):
            continue
        seen = int(dut.word.value), bool(int(dut.token.value)), bool(int(dut.aligned.value))
        got.append(seen)
    return got


def find(words: list[int], run: list[int]) -> int:
    return next(i for i in range(len(words)) if words[i : i + len(run)] == run)


@for_entity("tmds_word_align")
async def every_phase(dut: Any) -> None:
    """All ten phases, one after the other without a reset, with occasional bit errors."""
    rng = start(dut)
    dut.bits.value = 0
    await reset(dut)
    phases = [*range(10), *rng.sample(range(10), 10)]
    for phase in phases:
        words = some_lines(rng, 6, 60, 24)
        bits = [rng.randrange(2) for _ in range(phase)] + bits_of(words) + [0] * (60 - phase)
        # Errors in the middle of lines, away from the compared parts.
        for line in (2, 3):
            bits[10 * 84 * line + rng.randrange(400)] ^= 1
        got = await send_words(dut, words_of(bits))
        assert got[200][2], f"phase {phase}: not aligned"
        # Lines 4 and 5 must come out whole.
        tail = words[4 * 84 : 6 * 84]
        out = [word for word, _, _ in got]
        at = find(out, tail)
        assert [t for _, t, _ in got[at : at + len(tail)]] == [w in tmds.TOKENS for w in tail]


@for_entity("tmds_word_align")
async def alignment_begins_anew(dut: Any) -> None:
    """A reset at any time clears the phase and the count of tokens for it."""
    rng = start(dut)
    await FallingEdge(dut.clk)
    bits: list[int] = []
    for _ in range(4):
        bits += [0] * rng.randrange(1, 10) + bits_of(some_lines(rng, 3, 16, 24))
    inputs = [{"bits": word} for word in words_of(bits)]
    ends = rng.sample(range(40, len(inputs) - 10), 20)
    await reset_is_whole(
        dut, inputs, ends, cleared=["aligned"], others=["word", "token"], after=120
    )
    # It is aligned exactly this many clocks after a reset: tokens before the reset do not count.
    run = CASE["run"]
    dut.bits.value = tmds.TOKENS[1]
    for _ in range(2 * run):
        await FallingEdge(dut.clk)
    await reset(dut, 1)
    for clock in range(2 * run):
        assert int(dut.aligned.value) == (clock > run), clock
        await FallingEdge(dut.clk)


@for_entity("tmds_word_align")
async def loss_is_noticed(dut: Any) -> None:
    """Without tokens, or with single ones, alignment is lost after the time-out, then found."""
    rng = start(dut)
    dut.bits.value = 0
    await reset(dut)
    assert (await send_words(dut, some_lines(rng, 3, 40, 24)))[-1][2]
    noise = [rng.randrange(1024) for _ in range(300)]
    noise[::20] = [rng.choice(tmds.TOKENS) for _ in noise[::20]]
    got = await send_words(dut, noise)
    held = [aligned for _, _, aligned in got]
    assert held[CASE["timeout"] - 40]
    assert not held[CASE["timeout"] + 10]
    assert not any(held[CASE["timeout"] + 10 :])
    for level in (0, 1023):
        assert not any(a for _, _, a in await send_words(dut, [level] * 100))
    assert (await send_words(dut, some_lines(rng, 3, 40, 24)))[-1][2]


@for_entity("tmds_deskew")
async def every_skew(dut: Any) -> None:
    """Skews up to 15 words, changing without a reset: the same pixel comes out of all channels."""
    rng = start(dut)
    for name in ("words", "tokens", "aligned"):
        getattr(dut, name).value = 0
    await reset(dut)
    skews = [(0, 0, 0), (0, 1, 0), (15, 0, 3), (2, 7, 15), (0, 15, 15), (5, 5, 0), (0, 0, 1)]
    skews += [tuple(rng.randrange(16) for _ in range(3)) for _ in range(6)]
    for skew in skews:
        lines = [some_lines(rng, 8, 50, 24) for _ in range(3)]
        late = [[tmds.TOKENS[0]] * s + words for s, words in zip(skew, lines, strict=True)]
        dut.aligned.value = 7
        got: list[list[int]] = [[], [], []]
        for i in range(len(lines[0])):
            # A wrong token early in a line's blanking must not count as a line.
            now = [channel[i] for channel in late]
            if i == 74 * 3 + 60:
                now[rng.randrange(3)] = 0x1F0
            dut.words.value = now[0] | now[1] << 10 | now[2] << 20
            dut.tokens.value = sum((w in tmds.TOKENS) << c for c, w in enumerate(now))
            await FallingEdge(dut.clk)
            packed = dut.out_words.value
            if "U" not in str(packed):
                for c in range(3):
                    got[c].append(int(packed) >> 10 * c & 0x3FF)
        assert int(dut.locked.value), skew
        # Lines 5 and 6 of all channels lie side by side.
        starts = [find(out, words[5 * 74 : 7 * 74]) for out, words in zip(got, lines, strict=True)]
        assert len(set(starts)) == 1, f"skew {skew}: lines begin at {starts}"
    # Without lines it stays locked for the time-out, less the time since the last one.
    dut.words.value = dut.tokens.value = 0
    held = 0
    while int(dut.locked.value) and held <= CASE["timeout"]:
        await FallingEdge(dut.clk)
        held += 1
    assert CASE["timeout"] - 74 <= held <= CASE["timeout"]
    for now in zip(*(some_lines(rng, 3, 50, 24) for _ in range(3)), strict=True):
        dut.words.value = now[0] | now[1] << 10 | now[2] << 20
        dut.tokens.value = sum((w in tmds.TOKENS) << c for c, w in enumerate(now))
        await FallingEdge(dut.clk)
    assert int(dut.locked.value)
    dut.aligned.value = 5
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert not int(dut.locked.value)


@for_entity("tmds_deskew")
async def deskew_begins_anew(dut: Any) -> None:
    """A reset at any time clears the taps and the measurements for them."""
    rng = start(dut)
    await FallingEdge(dut.clk)
    inputs = []
    lines = [[tmds.TOKENS[0]] * rng.randrange(6) + some_lines(rng, 12, 20, 8) for _ in range(3)]
    for now in zip(*lines, strict=False):
        tokens = sum((w in tmds.TOKENS) << c for c, w in enumerate(now))
        words = now[0] | now[1] << 10 | now[2] << 20
        inputs.append({"words": words, "tokens": tokens, "aligned": 7})
    # A line is measured before each reset, which must not count afterwards.
    ends = rng.sample(range(80, len(inputs) - 10), 20)
    await reset_is_whole(dut, inputs, ends, cleared=["locked"], others=["out_words"], after=120)


@for_entity("tmds_polarity")
async def swapped_wires(dut: Any) -> None:
    """A whole preamble and guard band of video tells the channels that are swapped, nothing else.

    What comes out is judged some clocks later, in step; an order holds at once.
    """
    rng = start(dut)
    token_00, token_01 = tmds.TOKENS[0], tmds.TOKENS[1]
    video, island = VIDEO_GUARDS, (TERC4[13], ISLAND_GUARD, ISLAND_GUARD)
    dut.words.value = dut.step_words.value = 0
    dut.polarity.value = 8
    await reset(dut)
    swapped, known, order, late = 0, 0, 8, 5
    under_way = [0] * late
    told: set[tuple[bool, int]] = set()
    for _ in range(400):
        if rng.random() < 0.3:
            swapped = rng.randrange(8)
        if rng.random() < 0.2:
            order = rng.choice((8, 8, rng.randrange(8)))
            dut.polarity.value = order
        # Whole, or a DVI source's control bits: constant for all of the blanking, one word longer
        # or shorter; first pixels that are a guard band, or parts of one.
        length = rng.choice((8, 8, 7, 9, 30))
        guard = rng.choice((video, video, island, (video[1],) * 3))
        spoilt = rng.choice((None, None, rng.randrange(6)))
        # The other level in channel 2, all the time.
        red = rng.choice((token_00, token_00, token_01)) if guard != island else token_01
        # In front of it the same, or syncs that are repeated in both channels.
        red_before = rng.choice((red, red, token_00, token_01))
        line = [[tmds.TOKENS[rng.randrange(4)], token_00, red_before] for _ in range(30 - length)]
        line += [[tmds.TOKENS[rng.randrange(4)], token_01, red] for _ in range(length)]
        for i in range(2):
            begun = [
                w if spoilt != 3 * i + c else w ^ 1 << rng.randrange(10)
                for c, w in enumerate(guard)
            ]
            line.append(begun)
        line += [[rng.choice((*TERC4, rng.randrange(1024))) for _ in range(3)] for _ in range(25)]
        # A guard band of one word in all channels is that of channels 0 and 2 swapped.
        whole = length == 8 and spoilt is None and red == red_before
        right = whole and guard is video and red == token_00
        other = whole and guard == (video[1],) * 3 and red == token_01
        told.add((right, other, length))
        for number, words in enumerate(line):
            sent = sum(
                (w ^ (0x3FF if swapped >> c & 1 else 0)) << 10 * c for c, w in enumerate(words)
            )
            used = known if order == 8 else order
            dut.words.value = sent
            dut.step_words.value = under_way[0]
            await Timer(1, "ns")
            want = sent ^ sum(0x3FF << 10 * c for c in range(3) if used >> c & 1)
            assert int(dut.inverted.value) == used, (number, order)
            assert int(dut.out_words.value) == want, number
            under_way = [*under_way[1:], want]
            await FallingEdge(dut.clk)
            if order == 8 and number == 30 + late + 1 and (right or other):
                known = swapped ^ (5 if other else 0)
    assert len(told) > 5
    await reset(dut)
    dut.polarity.value = 8
    await Timer(1, "ns")
    assert not int(dut.inverted.value)


@for_entity("info_frame_reader")
async def reader_begins_anew(dut: Any) -> None:
    """After a reset at any time, also after a packet's last word, the packet is not reported."""
    rng = start(dut)
    await FallingEdge(dut.clk)
    inputs, ends = [], []
    # Good ones, one with wrong check bits, one with a wrong checksum, one of another type.
    for kind in ("good", "torn", "good", "spoilt", "good", "audio"):
        info = AviInfo(ColourSpace(2), Colorimetry(1), format_code=rng.randrange(1, 60))
        packet = info.packet()
        if kind == "spoilt":
            packet = Packet(packet.header, bytes([packet.body[0] ^ 1]) + packet.body[1:])
        elif kind == "audio":
            packet = audio_info_packet()
        header, *parts = [int.from_bytes(block, "little") for block in packet.blocks()]
        header ^= kind == "torn"
        inputs.append(
            {
                "island_start": 1,
                "island_valid": 0,
                "island_header": 0,
                "island_even": 0,
                "island_odd": 0,
            }
        )
        for word in range(32):
            even, odd = (
                sum((part >> 2 * word + i & 1) << k for k, part in enumerate(parts)) for i in (0, 1)
            )
            bits = {"island_header": header >> word & 1, "island_even": even, "island_odd": odd}
            inputs.append({"island_start": 0, "island_valid": 1, **bits})
        ends += [len(inputs) + late for late in range(4)]
        inputs += [{"island_start": 0, "island_valid": 0}] * rng.randrange(6)
    inputs += [{"island_start": 0, "island_valid": 0}] * 5
    told = ("informed", "colour", "limited", "bt601", "format_code", "packet_error", "sum_error")
    await reset_is_whole(dut, inputs, ends[4:], cleared=told, after=40)
