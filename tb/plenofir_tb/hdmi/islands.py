# SPDX-License-Identifier: Apache-2.0
"""HDMI around the picture: preambles, guard bands and data islands, as a source and as a receiver.

Words are packed as in `plenofir.fpga.hdmi.link`. A period of control tokens ends with a preamble
of eight words that tells what comes: video, after a guard band of two words, or a data island,
between two guard bands of two words. A DVI source sends neither preambles nor guard bands.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cache

import numpy as np
import numpy.typing as npt

from plenofir.fpga.hdmi.link import Frame, Packed, RasterSignals, encode_signals, raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.tmds import TOKENS, Bytes, Flags, decode_word
from plenofir_tb.hdmi.packets import PACKET_WORDS, Packet, check_byte
from plenofir_tb.hdmi.words import ISLAND_GUARD, TERC4, VIDEO_GUARDS, is_data_word

PREAMBLE = 8
GUARD = 2
MOST_PACKETS = 18
"""Packets of an island at most (HDMI 1.4, section 5.2.3.2)."""

_LEAST_CONTROL = 4
"""Words of control before a preamble, so that a control period has 12."""

_VIDEO_LEAD = PREAMBLE + GUARD
_CHANNELS = 3


def island_words(packets: Sequence[Packet], h_sync: Flags, v_sync: Flags) -> Packed:
    """Code a data island of 1 to 18 packets without its preamble (HDMI 1.4, figure 5-3).

    Sync levels, one for each word: 32 a packet and two for each guard band.
    """
    syncs = (2 * v_sync + h_sync).astype(np.uint32)
    terc4 = np.array(TERC4, np.uint32)
    packed = terc4[12 + syncs] | np.uint32(ISLAND_GUARD << 10 | ISLAND_GUARD << 20)
    for i, packet in enumerate(packets):
        header, *parts = [int.from_bytes(block, "little") for block in packet.blocks()]
        for word in range(PACKET_WORDS):
            at = GUARD + PACKET_WORDS * i + word
            # Bit 3 of channel 0 is low only in the first word of an island.
            low = syncs[at] | (header >> word & 1) << 2 | (word + i != 0) << 3
            even = sum((part >> 2 * word & 1) << k for k, part in enumerate(parts))
            odd = sum((part >> 2 * word + 1 & 1) << k for k, part in enumerate(parts))
            packed[at] = terc4[low] | terc4[even] << 10 | terc4[odd] << 20
    return np.asarray(packed, np.uint32)


def _gaps(mode: VideoMode, frames: int) -> Iterator[tuple[int, int]]:
    """Begin and length of the free part of each line: its blanking, or all of it."""
    for line in range(frames * mode.v_total):
        begin = mode.h_active if line % mode.v_total < mode.v_active else 0
        yield line * mode.h_total + begin, mode.h_total - begin


def encode_hdmi(mode: VideoMode, frames: Sequence[Frame], packets: Iterator[Packet]) -> Packed:
    """Code frames with preambles, guard bands and data islands.

    The horizontal blanking must have room for preamble and guard band. Frames are as in
    `plenofir.fpga.hdmi.link.encode_frames`; the end of the last one also comes before the first.
    Each line, in the vertical blanking too, has an island as long as there are room and packets.
    """
    signals = raster_signals(mode, frames)
    packed = encode_signals(signals)
    starts = np.flatnonzero(signals.active & ~np.roll(signals.active, 1))
    _overlay(packed, starts - _VIDEO_LEAD, (TOKENS[1], TOKENS[0]))
    guard = sum(word << 10 * channel for channel, word in enumerate(VIDEO_GUARDS))
    for i in range(GUARD):
        packed[starts - GUARD + i] = guard
    around = _LEAST_CONTROL + PREAMBLE + 2 * GUARD + _LEAST_CONTROL + _VIDEO_LEAD
    for begin, length in _gaps(mode, len(frames)):
        room = min((length - around) // PACKET_WORDS, MOST_PACKETS)
        here = list(itertools.islice(packets, max(room, 0)))
        if here:
            first = begin + _LEAST_CONTROL
            _overlay(packed, np.array([first]), (TOKENS[1], TOKENS[1]))
            words = slice(first + PREAMBLE, first + PREAMBLE + 2 * GUARD + PACKET_WORDS * len(here))
            packed[words] = island_words(here, signals.h_sync[words], signals.v_sync[words])
    return packed


def _overlay(packed: Packed, places: npt.NDArray[np.intp], tokens: tuple[int, int]) -> None:
    """Put a preamble, the tokens of channels 1 and 2, at each place."""
    for i in range(PREAMBLE):
        at = places + i
        packed[at] = packed[at] & 0x3FF | tokens[0] << 10 | tokens[1] << 20


class _Period(Enum):
    CONTROL = auto()
    VIDEO_GUARD = auto()
    VIDEO = auto()
    ISLAND_GUARD = auto()
    ISLAND = auto()


@dataclass(frozen=True)
class ReceivedPacket:
    """A packet that came."""

    end: int  # index of its last word
    packet: Packet
    intact: bool  # all check bytes are right


@dataclass
class Received:
    """What a receiver decodes from aligned words, one entry a word."""

    signals: RasterSignals  # the picture; syncs keep their levels where no word carries them
    errors: Flags  # shape (words, 3): the word is not valid in its period
    hdmi: Flags  # there have been guard bands or islands
    packets: list[ReceivedPacket] = field(default_factory=list)  # all that ended, in order


PLAIN_LINES = 16
"""Lines and islands in a row without whole guard bands that make the source one of DVI."""

_Word = tuple[int, int, int]
_NIBBLES = {word: value for value, word in enumerate(TERC4)}
_AFTER_GUARD = {_Period.VIDEO_GUARD: _Period.VIDEO, _Period.ISLAND_GUARD: _Period.ISLAND}
_PREAMBLE_TOKEN = 1
_VOTES = 8
_ENOUGH_VOTES = 4
_ENOUGH_GUARDS = 3
_ALL_GUARDS = 6


@cache
def _data_words() -> frozenset[int]:
    return frozenset(word for word in range(1024) if is_data_word(word))


def _packet(nibbles: Sequence[Sequence[int]]) -> tuple[Packet, bool]:
    """Packet of 32 words, and whether it is intact."""
    header = sum((low >> 2 & 1) << i for i, (low, _, _) in enumerate(nibbles))
    parts = [
        sum(
            (even >> k & 1) << 2 * i | (odd >> k & 1) << 2 * i + 1
            for i, (_, even, odd) in enumerate(nibbles)
        )
        for k in range(4)
    ]
    blocks = [header.to_bytes(4, "little"), *(part.to_bytes(8, "little") for part in parts)]
    intact = all(check_byte(block[:-1]) == block[-1] for block in blocks)
    return Packet(blocks[0][:-1], b"".join(block[:-1] for block in blocks[1:])), intact


def _kind(
    votes: Sequence[int], word: _Word, following: _Word, *, run: int, hdmi: bool
) -> tuple[_Period, bool]:
    """Kind of period that begins with a word, and whether its preamble and guard band are whole.

    From the preamble's votes, this word and the next; `run`: how many tokens of a preamble channel
    1 had in a row. A source that is not known to send HDMI must send all, as DVI may have parts of
    them by accident.
    """
    both = (word, following)
    island = sum(
        (pair[0] in TERC4[12:]) + (pair[1] == ISLAND_GUARD) + (pair[2] == ISLAND_GUARD)
        for pair in both
    )
    video = sum(w == g for pair in both for w, g in zip(pair, VIDEO_GUARDS, strict=True))
    if run == PREAMBLE and votes[2] == _VOTES and island == _ALL_GUARDS:
        return _Period.ISLAND_GUARD, True
    if run == PREAMBLE and votes[2] == 0 and video == _ALL_GUARDS:
        return _Period.VIDEO_GUARD, True
    if hdmi and votes[1] >= _ENOUGH_VOTES:
        if votes[2] >= _ENOUGH_VOTES and island >= _ENOUGH_GUARDS:
            return _Period.ISLAND_GUARD, False
        if votes[2] < _ENOUGH_VOTES and video >= _ENOUGH_GUARDS:
            return _Period.VIDEO_GUARD, False
    return _Period.VIDEO, False


class _Receiver:
    """State from word to word, and what came out."""

    def __init__(self, count: int) -> None:
        self.period = _Period.CONTROL
        # Last token of each channel, and how many of those before it were of a preamble.
        self.held = [0] * _CHANNELS
        self.votes = [0] * _CHANNELS
        # Tokens of a preamble in a row in channel 1.
        self.run = 0
        self.syncs = 0
        self.hdmi = False
        self.plain_lines = 0
        self.nibbles: list[list[int]] = []
        self.active = np.zeros(count, bool)
        self.levels = np.zeros(count, np.uint8)
        self.pixels: Bytes = np.zeros((count, _CHANNELS), np.uint8)
        self.errors = np.zeros((count, _CHANNELS), bool)
        self.is_hdmi = np.zeros(count, bool)
        self.packets: list[ReceivedPacket] = []

    def take(self, i: int, word: _Word, following: _Word) -> None:
        """Take a word; the next one helps to know the guard bands."""
        tokens = [channel in TOKENS for channel in word]
        for c in range(_CHANNELS):
            if tokens[c]:
                self.held[c] = TOKENS.index(word[c])
        if sum(tokens) >= 2:
            self.period = _Period.CONTROL
            self._control(i, tokens)
        else:
            second = self.period != _Period.CONTROL
            if not second:
                self._begin(word, following)
            self.votes = [0] * _CHANNELS
            self.run = 0
            self._inside(i, word)
            if second:
                self.period = _AFTER_GUARD.get(self.period, self.period)
        self.levels[i] = self.syncs
        self.is_hdmi[i] = self.hdmi

    def _control(self, i: int, tokens: list[bool]) -> None:
        """Blanking: syncs, and votes for a preamble."""
        for c in range(_CHANNELS):
            up = self.held[c] == _PREAMBLE_TOKEN
            self.votes[c] = min(self.votes[c] + 1, _VOTES) if up else max(self.votes[c] - 1, 0)
            self.errors[i, c] = not tokens[c]
        self.run = self.run + 1 if self.held[1] == _PREAMBLE_TOKEN else 0
        if tokens[0]:
            self.syncs = self.held[0]

    def _begin(self, word: _Word, following: _Word) -> None:
        """First word after tokens: decide what begins here."""
        self.period, whole = _kind(self.votes, word, following, run=self.run, hdmi=self.hdmi)
        if self.period == _Period.ISLAND_GUARD:
            self.nibbles = []
        if whole:
            self.hdmi, self.plain_lines = True, 0
        elif self.plain_lines == PLAIN_LINES - 1:
            self.hdmi = False
        else:
            self.plain_lines += 1

    def _inside(self, i: int, word: _Word) -> None:
        """Guard band, pixel, or word of an island."""
        if self.period == _Period.VIDEO_GUARD:
            self.errors[i] = [w != guard for w, guard in zip(word, VIDEO_GUARDS, strict=True)]
        elif self.period == _Period.VIDEO:
            self.active[i] = True
            self.errors[i] = [w not in _data_words() for w in word]
            self.pixels[i] = [0 if w in TOKENS else decode_word(w) for w in word[::-1]]
        else:
            self.errors[i] = [w not in _NIBBLES and w != ISLAND_GUARD for w in word]
            if word[0] in _NIBBLES:
                self.syncs = _NIBBLES[word[0]] & 3
        if self.period == _Period.ISLAND:
            self.nibbles.append([_NIBBLES.get(w, 0) for w in word])
            if len(self.nibbles) == PACKET_WORDS:
                self.packets.append(ReceivedPacket(i, *_packet(self.nibbles)))
                self.nibbles = []


def receive(packed: Packed) -> Received:
    """Decode words as the board's receiver does, with errors in them.

    Two of three channels decide between tokens and other words. The period after tokens is
    recognised by preamble and guard band and lasts until the next tokens; the first one of a source
    must be whole, of the others four words of the preamble and three of the six of the guard band
    must be intact. Anything else is video without a guard band, as DVI sources send it.
    """
    words = [
        (number & 0x3FF, number >> 10 & 0x3FF, number >> 20 & 0x3FF) for number in packed.tolist()
    ]
    receiver = _Receiver(len(words))
    for i, (word, following) in enumerate(zip(words, [*words[1:], *words[-1:]], strict=True)):
        receiver.take(i, word, following)
    levels = receiver.levels
    signals = RasterSignals(
        receiver.active, (levels & 1).astype(bool), (levels & 2).astype(bool), receiver.pixels
    )
    return Received(signals, receiver.errors, receiver.is_hdmi, receiver.packets)
