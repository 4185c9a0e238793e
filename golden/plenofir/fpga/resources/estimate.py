# SPDX-License-Identifier: Apache-2.0
"""The resources of a design on a family, estimated from its blocks without any tool.

Block RAM and multipliers follow the rules of Yosys (`plenofir.fpga.families`). Look-up tables and
flip-flops are weighted sums over the parts of each kind of block; the weights were fitted to
designs that were synthesised, for an ECP5 placed (`Record.weights`, scripts/resources.py fit). A
family without a fit of its own takes so many times those of a Spartan-6.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil

from plenofir.fpga.devices import Usage
from plenofir.fpga.families import FAMILIES, Family, Multiplier
from plenofir.fpga.resources.memory import Memory
from plenofir.fpga.resources.record import Weights, load_record

UNFITTED = 0.33
"""Largest relative error of LUTs and flip-flops where no design of the family was fitted."""
# Families with the same cells, whose weights are those of another one.
_LIKE: dict[Family, Family] = {"gw1n": "gw2a", "usplus": "series7"}


# In families without multipliers products are logic, weighed by the bits of their factors.
_PRODUCT_BITS = "product bits"


@dataclass(frozen=True)
class Block:
    """A part of a design; blocks of the same kind are weighed together."""

    kind: str  # in `Record.weights`
    parts: Mapping[str, int]  # amounts of what takes look-up tables and flip-flops
    memories: tuple[Memory, ...] = ()
    # How many products of factors of so many bits: (number, bits, bits).
    products: tuple[tuple[int, int, int], ...] = ()
    # Multipliers of products whose widths are not those of `products`.
    multipliers: Mapping[Family, int] = field(default_factory=dict)

    def parts_on(self, family: Family) -> dict[str, int]:
        """Parts on a family, with the products that it makes of logic."""
        bits = sum(number * a * b for number, a, b in self.products)
        return {**self.parts, _PRODUCT_BITS: 0 if FAMILIES[family].multipliers else bits}

    def multipliers_on(self, family: Family) -> int:
        """Multipliers that the block takes of a family."""
        units = (number * _multiplier_units(a, b, family) for number, a, b in self.products)
        return sum(units) + self.multipliers.get(family, 0)


VIDEO = Block("video", {"video": 1})
"""A board without its core, synthesised: receiver, transmitter, timing, control."""


@dataclass(frozen=True)
class Estimate(Usage):
    """Estimated resources, and how far the design may be off."""

    within: float = 0.0  # largest relative error of LUTs and flip-flops
    spare_block_rams: int = 0  # block RAMs that may be too many

    @property
    def error_class(self) -> str:
        """How far off, in words."""
        spare = f" up to {self.spare_block_rams} too many" * (self.spare_block_rams > 0)
        usual = {resource: most for resource, (*_, most) in load_record().drawn_errors.items()}
        return (
            f"LUTs and flip-flops within {self.within:.0%} (cores alone, 95 % of those "
            f"fitted: LUTs {usual['lut']:.0%}, flip-flops {usual['flip_flops']:.0%}), "
            f"block RAM{spare or ' exact'}"
        )


def is_weighed(kind: str) -> bool:
    """Whether there are weights for a kind of block; a new engine has none yet."""
    return kind in load_record().weights


def estimate(blocks: Iterable[Block], family: Family = "spartan6") -> Estimate:
    """Estimate the resources of a design's blocks on a family.

    A kind of block without weights counts its memories and multipliers only.
    """
    kinds: dict[str, list[Block]] = defaultdict(list)
    for block in blocks:
        kinds[block.kind].append(block)
    usage, spare, doubt = Usage(), 0, 0.0
    for kind, alike in kinds.items():
        added, weights = _usage_of(kind, alike, family)
        usage += added
        spare += weights.spare_block_rams
        doubt += weights.within * (added.lut + added.flip_flops)
    within = doubt / max(usage.lut + usage.flip_flops, 1)
    amounts = usage.lut, usage.flip_flops, usage.ramb16, usage.ramb8, usage.dsp
    return Estimate(*amounts, within, spare)


def _weights_of(kind: str, family: Family) -> Weights:
    """Weights of a kind of block on a family, or its factors to those of a Spartan-6."""
    record, like = load_record(), _LIKE.get(family, family)
    families = record.weights[kind]
    if like in families:
        return families[like]
    spare = families["spartan6"].spare_block_rams
    return Weights(times=record.times[like], within=UNFITTED, spare_block_rams=spare)


def _usage_of(kind: str, blocks: list[Block], family: Family) -> tuple[Usage, Weights]:
    """Resources of the blocks of a kind, and the weights that they were taken from."""
    memories = [memory for block in blocks for memory in block.memories]
    usage = sum((memory.usage(family) for memory in memories), Usage())
    usage += Usage(dsp=sum(block.multipliers_on(family) for block in blocks))
    if not is_weighed(kind):
        return usage, Weights(within=1)
    weights = _weights_of(kind, family)
    parts = Counter[str]()
    for block in blocks:
        parts.update(block.parts_on(family))
    if weights.times is None:
        return usage + _weighed(weights, parts), weights
    # The factors apply to the whole, with the memories of a Spartan-6.
    like = _weighed(load_record().weights[kind]["spartan6"], parts)
    lut = like.lut + sum(memory.usage().lut for memory in memories)
    lut, flip_flops = round(weights.times[0] * lut), round(weights.times[1] * like.flip_flops)
    return Usage(lut, flip_flops, usage.ramb16, usage.ramb8, usage.dsp), weights


def _weighed(weights: Weights, parts: Mapping[str, int]) -> Usage:
    """Weighted sums over the parts of the blocks of a kind."""
    lut, flip_flops, block_rams, multipliers = (
        round(sum(weight * parts.get(part, 0) for part, weight in table.items()))
        for table in (weights.lut, weights.flip_flops, weights.block_rams, weights.multipliers)
    )
    return Usage(lut, flip_flops, block_rams, dsp=multipliers)


def _multiplier_units(a: int, b: int, family: Family) -> int:
    """Multipliers that a product of unsigned factors of some bits takes; 0 if it becomes logic."""
    rules = FAMILIES[family].multipliers
    if rules and rules[0].signed:
        a, b = a + 1, b + 1
    return _units(max(a, b), min(a, b), rules)


def _units(a: int, b: int, rules: Sequence[Multiplier]) -> int:
    """Multipliers by the rules from a given one on, as Yosys's ``mul2dsp`` divides factors."""
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
