# SPDX-License-Identifier: Apache-2.0
"""Multipliers that a product takes, by the rules of Yosys for a family (``mul2dsp``)."""

from collections.abc import Sequence
from math import ceil

from plenofir.fpga.families import FAMILIES, Family, Multiplier


def multiplier_units(a: int, b: int, family: Family) -> int:
    """Multipliers that a product of unsigned factors of some bits takes; 0 if it becomes logic."""
    rules = FAMILIES[family].multipliers
    if rules and rules[0].signed:
        a, b = a + 1, b + 1
    return _units(max(a, b), min(a, b), rules)


def _units(a: int, b: int, rules: Sequence[Multiplier]) -> int:
    """Multipliers by the rules from a given one on, as ``mul2dsp`` divides factors."""
    for number, rule in enumerate(rules):
        if a < rule.least[0] or b < rule.least[1] or a + b < rule.product:
            continue
        rest = rules[number:]
        if a > rule.most[0]:
            count, part, last = _slices(a, rule.most[0], rule)
            return count * _units(part, b, rest) + _units(last, b, rest)
        if b > rule.most[1]:
            count, part, last = _slices(b, rule.most[1], rule)
            return count * _units(a, part, rest) + _units(a, last, rest)
        return rule.units
    return 0


def _slices(bits: int, most: int, rule: Multiplier) -> tuple[int, int, int]:
    """Parts that a factor is divided into, their bits, and the bits of the last one."""
    part = rule.part or most
    count = ceil((bits - most) / (part - rule.signed))
    return count, part, bits - count * (part - rule.signed)
