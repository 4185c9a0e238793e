# SPDX-License-Identifier: Apache-2.0
"""Words of TMDS that only HDMI's islands have, and those that an encoder sends as data."""

from plenofir.fpga.hdmi.tmds import DISPARITIES, decode_word, encode_byte

TERC4 = (
    0b1010011100,
    0b1001100011,
    0b1011100100,
    0b1011100010,
    0b0101110001,
    0b0100011110,
    0b0110001110,
    0b0100111100,
    0b1011001100,
    0b0100111001,
    0b0110011100,
    0b1011000110,
    0b1010001110,
    0b1001110001,
    0b0101100011,
    0b1011000011,
)
"""Words of the four bits of data islands (HDMI 1.4, section 5.4.3)."""

ISLAND_GUARD = 0b0100110011
"""Guard band of data islands in channels 1 and 2 (HDMI 1.4, section 5.2.3.3)."""

VIDEO_GUARDS = (TERC4[8], ISLAND_GUARD, TERC4[8])
"""Guard band of video in channels 0 to 2 (HDMI 1.4, section 5.2.2.1)."""


def is_data_word(word: int) -> bool:
    """Whether an encoder can have sent a word as data.

    Neither control tokens nor words that only transmission errors can produce are data words.
    """
    byte = decode_word(word)
    return any(encode_byte(byte, disparity)[0] == word for disparity in DISPARITIES)
