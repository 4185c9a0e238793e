# SPDX-License-Identifier: Apache-2.0
"""What a memory takes, by the rules of Yosys (`synth_xilinx -family xc6s`, `synth_ecp5`)."""

from collections.abc import Iterator
from dataclasses import dataclass

from plenofir.fpga.devices import Usage

MAX_LINE_BUFFER_BITS = 1 << 26
"""Bits of column memories, or of a depth index, that the VHDL takes (refocus_pkg)."""

# Yosys takes the memory with the lowest cost: a RAMB8BWER 65, a RAMB16BWER 129, a group of four
# LUTs as RAM 8, a bit of a ROM in logic 1/64 (brams_xc3sda.txt, lutrams_xc5v.txt, memory_libmap).
_RAMB8_COST = 65
_RAMB16_COST = 129
_LUT_RAM_COST = 8
_ROM_BITS_FOR_A_COST = 64
_MULTIPLEXER_COST = 0.5
# Bits of a word at each number of address bits, parity bits included.
_RAMB8_WIDTHS = {8: 36, 9: 18, 10: 9, 11: 4, 12: 2, 13: 1}
_RAMB16_WIDTHS = {9: 36, 10: 18, 11: 9, 12: 4, 13: 2, 14: 1}
# ECP5: a DP16KD, which has the same words; 16 words of 4 bits in LUTs (brams_16kd.txt,
# lutrams_trellis.txt); a bit of a ROM in logic 1/16 (memory_libmap, what it takes by itself).
_DP16KD_COST = 128
_ECP5_ROM_BITS_FOR_A_COST = 16
_DPR16X4_COST = 4


@dataclass(frozen=True)
class Memory:
    """A memory of a core."""

    name: str
    address_bits: int  # it has 2**address_bits words
    width: int
    copies: int
    rom: bool = False
    words: int | None = None  # if they are no power of two

    @property
    def _words(self) -> int:
        return 1 << self.address_bits if self.words is None else self.words

    @property
    def bits(self) -> int:
        """Bits of all copies."""
        return self.copies * self.width * self._words

    @property
    def usage(self) -> Usage:
        """What all copies take; ROMs in logic count nothing here."""
        options = [
            *self._blocks(_RAMB8_WIDTHS, _RAMB8_COST, half=True),
            *self._blocks(_RAMB16_WIDTHS, _RAMB16_COST, half=False),
        ]
        if self.rom:
            options.append((self.width * self._words / _ROM_BITS_FOR_A_COST, Usage()))
        else:
            options.append(self._lut_ram())
        return min(options, key=lambda option: option[0])[1] * self.copies

    @property
    def ecp5_blocks(self) -> int:
        """DP16KD of an ECP5 that all copies take."""
        blocks = self._blocks(_RAMB16_WIDTHS, _DP16KD_COST, half=False)
        options = [(cost, usage.ramb16) for cost, usage in blocks]
        if self.rom:
            options.append((self.width * self._words / _ECP5_ROM_BITS_FOR_A_COST, 0))
        else:
            banks = -(-self._words // 16)
            cost = _DPR16X4_COST * banks * -(-self.width // 4)
            options.append((cost + self._joined(banks), 0))
        return min(options)[1] * self.copies

    def _joined(self, banks: int) -> float:
        """Cost of a decoder and of multiplexers behind several banks."""
        return _MULTIPLEXER_COST * (banks - 1) * (self.width + 1)

    def _blocks(
        self, widths: dict[int, int], cost: int, *, half: bool
    ) -> Iterator[tuple[float, Usage]]:
        """Block RAMs side by side, in one bank or several."""
        for bank_bits, width in widths.items():
            banks = -(-self._words >> bank_bits) or 1
            count = banks * -(-self.width // width)
            lut = (banks - 1) * self.width // 2
            usage = Usage(lut, ramb8=count) if half else Usage(lut, ramb16=count)
            yield cost * count + self._joined(banks), usage

    def _lut_ram(self) -> tuple[float, Usage]:
        """Four LUTs: 32 words of 6 bits, or 64 words of 3 bits."""
        width = 6 if self.address_bits <= 5 else 3
        banks = -(-self._words // 64)
        whole, rest = divmod(self.width, width)
        cost = _LUT_RAM_COST * whole + (1 + (_LUT_RAM_COST - 1) * rest / width if rest else 0)
        lut = 4 * (whole + (rest > 0)) * banks + (banks - 1) * self.width // 2
        return banks * cost + self._joined(banks), Usage(lut)


def rom_luts(address_bits: int, width: int) -> int:
    """LUTs of a ROM in logic, 64 words of a bit each; none for a ROM in block RAM."""
    if Memory("", address_bits, width, 1, rom=True).usage.block_rams:
        return 0
    return width << max(address_bits - 6, 0)


def block_sizes(words: int, width: int) -> list[int]:
    """Words of each block that ram_blocks.vhd divides a memory into.

    No block needs a multiplexer between block RAMs, and no other such division into blocks of 2**n
    words takes fewer block RAMs, or as many in fewer blocks.
    """

    def divide(full: int, least: int) -> list[int]:
        sizes, left = [], words
        while left:
            bits = min(full, left.bit_length() - 1)
            sizes.append(1 << bits if bits >= least else left)
            left -= sizes[-1]
        return sizes

    def block_rams(size: int) -> int:
        bits = max((size - 1).bit_length(), min(_RAMB16_WIDTHS))
        return -(-width // _RAMB16_WIDTHS[bits])

    bits = sorted(_RAMB16_WIDTHS)
    divisions = [divide(full, least) for full in bits for least in bits if least <= full]
    return min(divisions, key=lambda sizes: (sum(map(block_rams, sizes)), len(sizes)))
