# SPDX-License-Identifier: Apache-2.0
"""What a memory takes, by the rules of Yosys for a family (`plenofir.fpga.families`)."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

from plenofir.fpga.devices import Usage
from plenofir.fpga.families import FAMILIES, Facts, Family, LutRam

# Block RAM by which ram_blocks_pkg.vhd divides memories.
_DIVIDED = FAMILIES["ecp5"].block_rams[0].widths
# Yosys's cost for each bit that is selected from several banks: a multiplexer of two.
_MULTIPLEXER_COST = 0.5
# Least share in percent of an Intel block RAM that a memory must fill (bram_m10k.txt).
_LEAST_SHARE = 5


def bits_for(largest: int) -> int:
    """Bits of a number from 0 to the largest (math_pkg)."""
    return max(largest.bit_length(), 1)


@dataclass(frozen=True)
class Memory:
    """A memory of a core."""

    name: str
    address_bits: int  # it has 2**address_bits words
    width: int
    copies: int
    rom: bool = False
    words: int | None = None  # if they are no power of two
    alike: int = 1  # copies of the same words, which are one memory where it is flip-flops

    @property
    def _words(self) -> int:
        return 1 << self.address_bits if self.words is None else self.words

    @property
    def bits(self) -> int:
        """Bits of all copies."""
        return self.copies * self.width * self._words

    def usage(self, family: Family = "spartan6") -> Usage:
        """What all copies take; ROMs in logic count nothing here."""
        usage = _usage_of(family, self._words, self.width, self.rom) * self.copies
        return replace(usage, flip_flops=usage.flip_flops // self.alike)


@cache
def _usage_of(family: Family, words: int, width: int, rom: bool) -> Usage:
    """What a memory takes of a family's devices."""
    facts = FAMILIES[family]
    if facts.fullest:
        return _fullest(facts, words, width, rom)
    # At equal cost, logic is taken.
    options: list[tuple[float, Usage]] = []
    if rom:
        options.append((width * words * facts.rom_cost, Usage()))
    elif facts.lut_ram is not None:
        options.append(_lut_ram(facts.lut_ram, words, width))
    else:
        # Flip-flops, which have a cost of one for each bit.
        options.append((width * words, Usage(flip_flops=width * words)))
    return min([*options, *_blocks(facts, words, width, rom)], key=lambda option: option[0])[1]


def _joined(banks: int, width: int) -> float:
    """Cost of a decoder and of multiplexers behind several banks."""
    return _MULTIPLEXER_COST * (banks - 1) * (width + 1)


def _blocks(facts: Facts, words: int, width: int, rom: bool) -> Iterator[tuple[float, Usage]]:
    """Block RAMs side by side, each with its cost; the words of all banks fill them together."""
    for kind in facts.block_rams:
        for bank_bits, bits in kind.widths.items():
            banks = -(-words >> bank_bits) or 1
            byte = 1 if rom else min(kind.byte, bits)
            count = -(-banks * (-(-width // byte) * byte) // bits)
            lut = (banks - 1) * width // 2
            units = count * kind.units
            usage = Usage(lut, ramb8=units) if kind.half else Usage(lut, ramb16=units)
            yield kind.cost * count + _joined(banks, width), usage


def _lut_ram(kind: LutRam, words: int, width: int) -> tuple[float, Usage]:
    """Memory in look-up tables, the deepest that it needs."""
    depth, bits = next(
        (
            (depth, bits)
            for depth, bits in zip(kind.words, kind.widths, strict=True)
            if words <= depth
        ),
        (kind.words[-1], kind.widths[-1]),
    )
    banks = -(-words // depth)
    whole, rest = divmod(width, bits)
    cost = kind.cost * (whole + (rest > 0))
    if rest and kind.scaled:
        cost = kind.cost * whole + 1 + (kind.cost - 1) * rest / bits
    lut = kind.luts * (whole + (rest > 0)) * banks + (banks - 1) * width // 2
    return banks * cost + _joined(banks, width), Usage(lut)


def _fullest(facts: Facts, words: int, width: int, rom: bool) -> Usage:
    """Block RAM that a memory fills best, if it fills enough of it."""
    options = []
    for kind in facts.block_rams:
        for address_bits, bits in kind.widths.items():
            count = -(-words >> address_bits) * -(-width // bits)
            share = 100 * words * width // (count * bits << address_bits)
            options.append((share, -count, Usage(ramb16=count)))
    share, _, usage = max(options, key=lambda option: option[:2])
    if share >= _LEAST_SHARE:
        return usage
    assert facts.lut_ram is not None
    return Usage() if rom else _lut_ram(facts.lut_ram, words, width)[1]


def rom_luts(address_bits: int, width: int) -> int:
    """LUTs of a ROM in logic, 64 words of a bit each; none for a ROM in block RAM."""
    if Memory("", address_bits, width, 1, rom=True).usage().block_rams:
        return 0
    return width << max(address_bits - 6, 0)


def block_sizes(words: int, width: int) -> list[int]:
    """Words of each block that ram_blocks_pkg.vhd divides a memory into.

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
        bits = max((size - 1).bit_length(), min(_DIVIDED))
        return -(-width // _DIVIDED[bits])

    bits = sorted(_DIVIDED)
    divisions = [divide(full, least) for full in bits for least in bits if least <= full]
    return min(divisions, key=lambda sizes: (sum(map(block_rams, sizes)), len(sizes)))
