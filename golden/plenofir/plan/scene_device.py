# SPDX-License-Identifier: Apache-2.0
"""A device of the user's own: the facts of any part of a family that plenofir knows."""

from difflib import SequenceMatcher, get_close_matches
from itertools import takewhile
from typing import Annotated, get_args

from pydantic import BaseModel, ConfigDict, Field, field_validator

from plenofir.fpga.devices import DEVICES, Device, Usage, family_clocks
from plenofir.fpga.families import FAMILIES, Family

Amount = Annotated[int, Field(ge=0, le=10_000_000)]
# What vendors call parts of a family; titles and names of `FAMILIES` are taken, too.
_NAMES: dict[str, Family] = {
    **dict.fromkeys(("artix-7", "kintex-7", "spartan-7", "virtex-7", "zynq-7000"), "series7"),
    **dict.fromkeys(("zynq ultrascale+", "kintex ultrascale+", "artix ultrascale+"), "usplus"),
    **dict.fromkeys(("crosslink-nx", "certus-nx", "certuspro-nx"), "nexus"),
    **{facts.title.lower(): family for family, facts in FAMILIES.items()},
    **{family: family for family in get_args(Family)},
}


# Intel's families that Yosys counts unlike Quartus (docs/resources.md), by the beginning of parts.
_UNCOUNTED = {
    "10m": "MAX 10",
    "10cl": "Cyclone 10 LP",
    "10cx": "Cyclone 10 GX",
    "ep4c": "Cyclone IV",
}


def nearest_device(typed: str) -> str:
    """Advice for a device that is not in the table: the one whose name begins most like it.

    For a family that Yosys does not count a Cyclone V, with the reason; empty if no name begins
    like it.
    """
    typed = typed.strip().lower()
    for start, title in _UNCOUNTED.items():
        if typed.startswith(start):
            near = next(name for name, row in DEVICES.items() if row.family == "cyclonev")
            return f"{near}, as Yosys does not count a {title} as Quartus builds it"

    def likeness(name: str) -> tuple[int, float]:
        alike = takewhile(lambda pair: pair[0] == pair[1], zip(typed, name, strict=False))
        return sum(1 for _ in alike), SequenceMatcher(None, typed, name).ratio()

    near = max(DEVICES, key=likeness)
    return near if likeness(near)[0] > 1 else ""


class SceneDevice(BaseModel):
    """Facts of a part, of its data sheet, with the amounts that its family counts."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._/-]*$", max_length=40)]
    family: Family
    lut: Annotated[Amount, Field(ge=1)]  # for Cyclone V ALMs
    flip_flops: Annotated[Amount, Field(ge=1)]
    block_rams: Amount  # of the size that `plenofir devices` names for the family
    multipliers: Amount = 0
    pins: Amount = 0  # of the package; 0 if they are not known
    part: str = ""  # as the vendor's tool names it, package and grade included; the name if empty
    package: str = ""
    speed_grade: str = ""

    @field_validator("family", mode="before")
    @classmethod
    def _is_a_family(cls, name: object) -> object:
        if not isinstance(name, str) or name.lower() in _NAMES:
            return _NAMES[name.lower()] if isinstance(name, str) else name
        if name.lower() in map(str.lower, _UNCOUNTED.values()):
            raise ValueError(f"Yosys does not count a {name}; the nearest is 'cyclone v'")
        near = get_close_matches(name.lower(), _NAMES, 1, 0.4)
        nearest = f"the nearest is {near[0]!r}; " if near else ""
        raise ValueError(f"{nearest}choose one of {', '.join(FAMILIES)}")

    def device(self) -> Device:
        """The device, with the clocks that cores are trusted to keep on its family."""
        return Device(
            name=self.name.lower(),
            total=Usage(self.lut, self.flip_flops, self.block_rams, dsp=self.multipliers),
            package=self.package,
            pins=self.pins,
            family=self.family,
            part_pattern=self.part or self.name,
            grade=self.speed_grade,
            clocks_mhz=family_clocks(self.family),
            assumed=True,
            source="the scene's own facts",
        )
