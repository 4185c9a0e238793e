# SPDX-License-Identifier: Apache-2.0
"""Check that each clock can be routed from its source to its loads on dedicated resources.

The facts are those of ``xc6slx45.toml``. Buffers are placed one after the other, those
with the fewest choices first.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch

from bitstream_check.clock_nets import Net, Netlist, Place
from bitstream_check.sites import device, pins
from bitstream_check.ucf import Constraints

IMPLIED = "pin"
"""Buffer that XST puts behind a clock pin, as a kind of primitive."""

_ANY_LINE = frozenset(range(16))


@dataclass(frozen=True)
class GlobalBuffer:
    """A BUFG or BUFGMUX: its name, and of I0 (and I1) the net and the lines that it can come on."""

    name: str
    inputs: tuple[tuple[Net, frozenset[int]], ...]

    @property
    def is_free(self) -> bool:
        """Whether it fits any place whose lines are free."""
        return all(lines == _ANY_LINE for _, lines in self.inputs)


def check_clock_routing(constraints: Constraints, netlist: Netlist) -> list[str]:
    """Check routes from pins, BUFIO2s, DCMs and PLLs to clock multiplexers and BUFPLLs."""
    drivers = _drivers(netlist)
    out = _check_routes(netlist, drivers)
    if not out:
        out = _check_places(global_buffers(constraints, netlist, drivers))
    return out


Driver = tuple[Place | None, str]
"""Instance (None: a pin) and what drives a net there, ``bufg.o``."""


def _drivers(netlist: Netlist) -> dict[Net, Driver]:
    """What drives the nets that come out of clock primitives, or of clock pins."""
    drivers: dict[Net, Driver] = {net: (None, IMPLIED) for net in netlist.clock_nets if not net[0]}
    outputs = {name for names in device().routes.values() for name in names}
    for place in netlist.places:
        for port in place.instance.ports:
            name = f"{place.instance.of}.{port}"
            if any(fnmatch(name, output) for output in outputs):
                drivers[netlist.port(place, port)] = (place, name)
    return drivers


def _check_routes(netlist: Netlist, drivers: Mapping[Net, Driver]) -> list[str]:
    """Each input is driven by an output that has a route to it."""
    out = []
    for place in netlist.places:
        for port in place.instance.ports:
            allowed = device().routes.get(f"{place.instance.of}.{port}")
            if allowed is None:
                continue
            source, name = drivers.get(netlist.port(place, port), (None, "logic or a port"))
            # XST inserts a BUFG behind a clock pin.
            pin = "bufg.o" if name == IMPLIED else name
            if not any(fnmatch(pin, pattern) for pattern in allowed):
                where = f" of {source.path}" if source else ""
                out.append(f"{place.path}: no way from {name}{where} to {port}")
    for place in netlist.all_of("bufpll"):
        clock, locked = (drivers.get(netlist.port(place, port)) for port in ("pllin", "locked"))
        if clock and locked and clock[0] != locked[0]:
            out.append(f"{place.path}: pllin and locked come from two PLLs")
    return out


def global_buffers(
    constraints: Constraints, netlist: Netlist, drivers: Mapping[Net, Driver] | None = None
) -> list[GlobalBuffer]:
    """Find the buffers that need a clock multiplexer, and the lines that their inputs can use.

    They are those of the source, and those that XST puts behind clock pins.
    """
    drivers = _drivers(netlist) if drivers is None else drivers
    ports = {
        netlist.same(("", net.split("<")[0])): pins()[str(attributes["LOC"])].clock_lines
        for net, attributes in constraints.pins.items()
        if attributes.get("LOC") in pins() and pins()[str(attributes["LOC"])].is_clock
    }

    def lines(net: Net) -> frozenset[int]:
        """Lines of the pin that a net comes from through its BUFIO2; of PLLs and DCMs all."""
        if net in ports:
            return ports[net]
        place, name = drivers.get(net, (None, ""))
        if place is not None and name in ("bufio2.divclk", "ibufds.o"):
            return lines(netlist.port(place, "i"))
        return _ANY_LINE

    buffers = [
        GlobalBuffer(
            place.path,
            tuple((net, lines(net)) for net in (netlist.port(place, port) for port in inputs)),
        )
        for kind, inputs in (("bufg", ("i",)), ("bufgmux", ("i0", "i1")))
        for place in netlist.all_of(kind)
    ]
    buffers += [
        GlobalBuffer(f"pin {net[1]}", ((net, lines(net)),))
        for net, (_, name) in drivers.items()
        if name == IMPLIED
    ]
    # Buffers with the fewest choices come first; of equals, those that take two lines.
    return sorted(
        buffers, key=lambda b: (min(len(lines) for _, lines in b.inputs), -len(b.inputs), b.name)
    )


def _check_places(buffers: Sequence[GlobalBuffer]) -> list[str]:
    """There is a clock multiplexer for each buffer that its inputs reach."""
    for number, buffer in enumerate(buffers, 1):
        if not can_place(buffers[:number]):
            nets = " and ".join("/".join(filter(None, net)) for net, _ in buffer.inputs)
            others = ", ".join(other.name for other in buffers[: number - 1])
            reach = "reach" if len(buffer.inputs) > 1 else "reaches"
            return [f"{buffer.name}: no clock multiplexer that {nets} {reach}, beside {others}"]
    return []


def can_place(
    buffers: Sequence[GlobalBuffer],
    occupied: frozenset[int] = frozenset(),
    lines: Mapping[int, Net] | None = None,
) -> bool:
    """Whether all buffers find a clock multiplexer; those with the fewest choices come first.

    `occupied` are multiplexers of other nets, `lines` the lines in use, with their nets.
    """
    if not buffers:
        return True
    lines = lines or {}
    buffer, rest = buffers[0], buffers[1:]
    line_of = device().clock_lines.i0

    def new_lines(site: int) -> int:
        return sum(line_of[site ^ i] not in lines for i in range(len(buffer.inputs)))

    for site in sorted(set(range(len(line_of))) - occupied, key=new_lines):
        needs = {line_of[site ^ i]: (net, able) for i, (net, able) in enumerate(buffer.inputs)}
        if all(
            lines.get(line, net) == net
            # A BUFIO2 drives one line, and its net is on that or on none.
            and line in able
            and (able == _ANY_LINE or net not in lines.values() or lines.get(line) == net)
            for line, (net, able) in needs.items()
        ):
            used = {**lines, **{line: net for line, (net, _) in needs.items()}}
            if can_place(rest, occupied | {site}, used):
                return True
            if buffer.is_free:
                # The buffers behind it are free too; no other place would be better for them.
                return False
    return False
