# SPDX-License-Identifier: Apache-2.0
"""Resources of a design on a family: memories, multipliers, and the weighted sum of its parts.

``data/weights.json`` holds LUTs and flip-flops of a bit of each part, fitted to synthesised designs
(scripts/resources.py fit), for an ECP5 to placed ones. Where few designs of a family were
synthesised, it holds two factors instead: LUTs and flip-flops for each of a Spartan-6.
"""

import json
from collections.abc import Mapping, Sequence
from functools import cache
from math import ceil
from typing import Any

from plenofir.fpga.core.memory import Memory
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import FAMILIES, Family, Multiplier
from plenofir.ground import project

FILE = project.DATA / "weights.json"
RESOURCES = ("lut", "flip_flops")
# Families with the same cells, whose weights are those of another one.
_LIKE: dict[Family, Family] = {"gw1n": "gw2a"}


@cache
def load_weights() -> Mapping[str, Mapping[str, Any]]:
    """Weights by kind of design and family: a table for each resource, or the two factors."""
    content: Mapping[str, Mapping[str, Any]] = json.loads(FILE.read_text())
    return content


def is_weighed(kind: str) -> bool:
    """Whether there are weights for a kind of design; a new engine has none yet."""
    return kind in load_weights()


def usage_of_parts(
    kind: str,
    parts: Mapping[str, int],
    memories: Sequence[Memory],
    family: Family,
    multipliers: int = 0,
) -> Usage:
    """Resources of a design of a kind on a family.

    Only memories and multipliers if there are no weights for the kind.
    """
    in_memories = sum((memory.usage(family) for memory in memories), Usage())
    if not is_weighed(kind):
        return in_memories + Usage(dsp=multipliers)
    known = load_weights()[kind]
    found = known[_LIKE.get(family, family)]
    tables = known["spartan6"] if isinstance(found, list) else found
    lut, flip_flops = (
        round(sum(weight * parts[name] for name, weight in tables[resource].items()))
        for resource in RESOURCES
    )
    logic = Usage(lut=lut, flip_flops=flip_flops, dsp=multipliers)
    if isinstance(found, list):
        # The factors apply to the whole, with the memories of a Spartan-6.
        lut += sum(memory.usage().lut for memory in memories)
        logic = Usage(round(found[0] * lut), round(found[1] * flip_flops), dsp=multipliers)
        in_memories = Usage(ramb16=in_memories.ramb16, ramb8=in_memories.ramb8)
    return logic + in_memories


def on_family(usage: Usage, family: Family) -> Usage:
    """Resources on another family for logic of a Spartan-6, by the factors of small parts."""
    if family == "spartan6":
        return usage
    lut, flip_flops = load_weights()["sharpener"][_LIKE.get(family, family)]
    dsp = usage.dsp if FAMILIES[family].multipliers else 0
    return Usage(round(lut * usage.lut), round(flip_flops * usage.flip_flops), dsp=dsp)


def multiplier_units(a: int, b: int, family: Family) -> int:
    """Multipliers that a product of unsigned factors of some bits takes; 0 if it becomes logic."""
    rules = FAMILIES[family].multipliers
    if rules and rules[0].signed:
        a, b = a + 1, b + 1
    return _units(max(a, b), min(a, b), rules)


def _units(a: int, b: int, rules: Sequence[Multiplier]) -> int:
    """The same by the rules from a given one on, as ``mul2dsp`` divides factors."""
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
