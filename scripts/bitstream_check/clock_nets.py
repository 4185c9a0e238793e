# SPDX-License-Identifier: Apache-2.0
"""Which names mean the same net, and which clock is derived from which.

All instances are followed down from the top level; a net and the port that it is connected to are
one. That is enough for clocks, which pass through ports, renamings and primitives only. Instances
in a generate statement count once.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from bitstream_check.sites import device
from plenofir.fpga.hdl_text import Declaration, declarations
from vhdl_instances import Instance, clocks, instances, renamings

Net = tuple[str, str]
"""Path of the instance (empty at the top) and local name."""


def base_name(actual: str) -> str:
    """The signal of an actual: ``bus(3)`` is a part of ``bus``; expressions have none."""
    name = actual.split("(", 1)[0].strip()
    return name if name.isidentifier() and name != "open" else ""


@dataclass(frozen=True)
class Place:
    """An instance with its path from the top."""

    path: str
    instance: Instance


@dataclass
class Netlist:
    """Nets and clocks of a design."""

    places: list[Place] = field(default_factory=list)
    clock_nets: set[Net] = field(default_factory=set)  # nets that clock registers
    _parent: dict[Net, Net] = field(default_factory=dict)
    _arcs: list[tuple[Net, Net, bool]] = field(default_factory=list)

    def same(self, net: Net) -> Net:
        """One name for all names of a net, that nearest to the top."""
        while net in self._parent:
            net = self._parent[net]
        return net

    def _join(self, a: Net, b: Net) -> None:
        a, b = self.same(a), self.same(b)
        if a != b:
            upper, lower = sorted((a, b), key=lambda net: (net[0].count("/"), bool(net[0]), net))
            self._parent[lower] = upper

    def port(self, place: Place, name: str) -> Net:
        """Net that a port of an instance is joined to."""
        return self.same((place.path, name))

    def all_of(self, entity: str) -> list[Place]:
        """Instances of an entity or component."""
        return [place for place in self.places if place.instance.of == entity]

    def reach(self, net: Net, *, through_synthesizers: bool = False) -> set[Net]:
        """Nets of the same clock: `net`, those behind buffers and, if wanted, PLLs and DCMs."""
        reached = {self.same(net)}
        while True:
            more = {
                self.same(target)
                for source, target, is_buffer in self._arcs
                if self.same(source) in reached and (is_buffer or through_synthesizers)
            }
            if more <= reached:
                return reached
            reached |= more

    def add(self, text: str, sources: Mapping[str, str], path: str = "") -> None:
        """Take in an entity and all below it."""
        self.clock_nets |= {(path, name) for name in clocks(text)}
        for target, source in renamings(text):
            self._join((path, target), (path, source))
        for instance in instances(text):
            place = Place(f"{path}/{instance.label}" if path else instance.label, instance)
            self.places.append(place)
            for formal, actual in instance.ports.items():
                if name := base_name(actual):
                    self._join((place.path, formal.split("(")[0].strip()), (path, name))
            if instance.is_component:
                self._add_arcs(place)
            elif instance.of in sources:
                self.add(sources[instance.of], sources, place.path)

    def _add_arcs(self, place: Place) -> None:
        for kinds, is_buffer in ((device().buffers, True), (device().synthesizers, False)):
            for source, targets in kinds.get(place.instance.of, {}).items():
                for target in targets:
                    self._arcs.append(((place.path, source), (place.path, target), is_buffer))


def read_netlist(top: str, sources: Mapping[str, str]) -> Netlist:
    """Follow a design down from its top level."""
    netlist = Netlist()
    netlist.add(sources[top], sources)
    # Names of a net may have been merged after it was noted.
    netlist.clock_nets = {netlist.same(net) for net in netlist.clock_nets}
    return netlist


def top_ports(text: str) -> dict[str, str]:
    """Bits of the ports of the top level (``led<0>``) to their modes."""
    return {bit: port.mode for port in declarations(text, "port") for bit in _bits(port)}


def _bits(port: Declaration) -> list[str]:
    """Names of the bits of a port as constraints have them: ``led<0>``, or the name itself."""
    bounds = re.search(r"\((\d+) downto (\d+)\)", port.type_name)
    if bounds is None:
        return [port.name]
    return [f"{port.name}<{i}>" for i in range(int(bounds[2]), int(bounds[1]) + 1)]
