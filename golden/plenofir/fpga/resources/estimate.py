# SPDX-License-Identifier: Apache-2.0
"""The resources of a design on a family, estimated from its blocks without any tool.

Block RAM and multipliers follow the rules of Yosys (`plenofir.fpga.families`). Look-up tables and
flip-flops are weighted sums over the parts of each kind of block; the weights were fitted to
designs that were synthesised, for an ECP5 placed (`Record.weights`, scripts/resources.py fit). A
family without a fit of its own takes so many times those of a Spartan-6.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.fpga.resources.memory import Memory
from plenofir.fpga.resources.record import Weights, load_record

UNFITTED = 0.33
"""Largest relative error of LUTs and flip-flops where no design of the family was fitted."""
# Families with the same cells, whose weights are those of another one.
_LIKE: dict[Family, Family] = {"gw1n": "gw2a"}


@dataclass(frozen=True)
class Block:
    """A part of a design; blocks of the same kind are weighed together."""

    kind: str  # in `Record.weights`
    parts: Mapping[str, int]  # amounts of what takes look-up tables and flip-flops
    memories: tuple[Memory, ...] = ()
    multipliers: int = 0


class Design(Protocol):
    """Something that can be estimated."""

    def blocks(self, family: Family) -> Iterable[Block]:
        """Blocks of the design for a family."""


@dataclass(frozen=True)
class Together:
    """Several designs side by side."""

    designs: tuple[Design, ...]

    def blocks(self, family: Family) -> Iterator[Block]:
        """Blocks of all designs."""
        for design in self.designs:
            yield from design.blocks(family)


@dataclass(frozen=True)
class Only:
    """The blocks of one kind in a design."""

    design: Design
    kind: str

    def blocks(self, family: Family) -> Iterator[Block]:
        """Blocks of that kind."""
        for block in self.design.blocks(family):
            if block.kind == self.kind:
                yield block


@dataclass(frozen=True)
class Part:
    """A design that is one part of a kind, such as a board's video path."""

    kind: str

    def blocks(self, family: Family) -> Iterator[Block]:
        """One block, with the kind's only part once."""
        del family
        yield Block(self.kind, {self.kind: 1})


VIDEO = Part("video")
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
        return f"LUTs and flip-flops within {self.within:.0%}, block RAM{spare or ' exact'}"


def is_weighed(kind: str) -> bool:
    """Whether there are weights for a kind of block; a new engine has none yet."""
    return kind in load_record().weights


def estimate(design: Design, family: Family = "spartan6") -> Estimate:
    """Estimate the resources of a design on a family.

    A kind of block without weights counts its memories and multipliers only.
    """
    kinds: dict[str, list[Block]] = defaultdict(list)
    for block in design.blocks(family):
        kinds[block.kind].append(block)
    usage, spare, doubt = Usage(), 0, 0.0
    for kind, blocks in kinds.items():
        added, weights = _usage_of(kind, blocks, family)
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
    usage += Usage(dsp=sum(block.multipliers for block in blocks))
    if not is_weighed(kind):
        return usage, Weights(within=1)
    weights = _weights_of(kind, family)
    if weights.times is None:
        return usage + _weighed(weights, blocks), weights
    # The factors apply to the whole, with the memories of a Spartan-6.
    like = _weighed(load_record().weights[kind]["spartan6"], blocks)
    lut = like.lut + sum(memory.usage().lut for memory in memories)
    lut, flip_flops = round(weights.times[0] * lut), round(weights.times[1] * like.flip_flops)
    return Usage(lut, flip_flops, usage.ramb16, usage.ramb8, usage.dsp), weights


def _weighed(weights: Weights, blocks: list[Block]) -> Usage:
    """Weighted sums over the parts of blocks of a kind."""
    lut, flip_flops, block_rams, multipliers = (
        round(
            sum(
                weight * block.parts.get(part, 0)
                for part, weight in table.items()
                for block in blocks
            )
        )
        for table in (weights.lut, weights.flip_flops, weights.block_rams, weights.multipliers)
    )
    return Usage(lut, flip_flops, block_rams, dsp=multipliers)
