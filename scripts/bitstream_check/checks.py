# SPDX-License-Identifier: Apache-2.0
"""Checks of a build that do not need ISE: sources, constraints, clocks, sites, options.

Each check returns a list of problems, one line each.
"""

import math
import os
import re
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path

from bitstream_check.clock_nets import (
    Net,
    Netlist,
    Place,
    base_name,
    read_netlist,
    top_ports,
)
from bitstream_check.clock_routing import check_clock_routing, global_buffers
from bitstream_check.sites import Pin, device, pins
from bitstream_check.ucf import Constraints, read_constraints
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise import TOOLS, constraints_file, option_folder, read_options
from plenofir.fpga.bitstream.top_level import TOP, project_lines
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground import project
from plenofir.ground.errors import InputError
from vhdl_instances import instances

OPTION_FILES = tuple(f"{tool}.opt" for tool in TOOLS)
# Modules that cross from one clock to another: ports of the source clock (None: any clock, or none)
# and of the destination clock.
CROSSINGS: dict[str, tuple[tuple[str | None, str], ...]] = {
    "synchroniser": ((None, "clk"),),
    "reset_bridge": ((None, "clk"),),
    "bus_crossing": (("source_clk", "destination_clk"), ("destination_clk", "source_clk")),
    "elastic_buffer": (("write_clk", "read_clk"),),
    "clock_meter": (("measured_clk", "clk"),),
}


def check_pins(constraints: Constraints, top_text: str) -> list[str]:
    """Each port has a pin and each pin a port; no ball twice; standards, pairs, banks."""
    ports = top_ports(top_text)
    out = [f"port {bit} has no LOC" for bit in ports if "LOC" not in constraints.pins.get(bit, {})]
    out += [f"pin {net} is no port of {TOP}" for net in constraints.pins if net not in ports]
    out += [f"pin {net} has several LOC" for net in constraints.located_twice]
    out += [
        f"port {bit} has no IOSTANDARD"
        for bit in ports
        if "IOSTANDARD" not in constraints.pins.get(bit, {})
    ]
    used: dict[str, str] = {}
    for net, attributes in constraints.pins.items():
        ball = str(attributes.get("LOC", ""))
        # Map fails an hour later, or connects both nets where a tool allows it.
        if ball in used and ball:
            out.append(f"ball {ball} is used by {used[ball]} and {net}")
        used.setdefault(ball, net)
        if ball and ball not in pins():
            out.append(f"{net}: {ball} is no ball of {device().package.upper()}")
        elif ball and not pins()[ball].is_io:
            out.append(f"{net}: ball {ball} is {pins()[ball].name}, no I/O pin")
    located = {
        net: pins()[str(attributes["LOC"])]
        for net, attributes in constraints.pins.items()
        if attributes.get("LOC") in pins() and pins()[str(attributes["LOC"])].is_io
    }
    out += _check_banks(constraints, located, ports)
    out += _check_pairs(constraints, located)
    return out


def _check_banks(
    constraints: Constraints, located: Mapping[str, Pin], ports: Mapping[str, str]
) -> list[str]:
    out = []
    supplies: dict[int, tuple[float, str]] = {}
    for net, pin in located.items():
        standard = str(constraints.pins[net].get("IOSTANDARD", ""))
        if not standard:
            continue
        if standard not in device().io.volts:
            out.append(f"{net}: {standard} is none of {', '.join(device().io.volts)}")
            continue
        volts = device().io.volts[standard]
        first, other = supplies.setdefault(pin.bank, (volts, net))
        if first != volts:
            out.append(f"bank {pin.bank}: {other} needs {first} V, {net} {volts} V")
        # Inputs of TMDS work in any bank; drivers are only in some.
        drives = ports.get(net, "in") != "in"
        if standard == "TMDS_33" and drives and pin.bank not in device().io.tmds_output_banks:
            out.append(f"{net}: bank {pin.bank} has no TMDS_33 drivers")
        if standard == "TMDS_33" and constraints.config.get("VCCAUX") != "3.3":
            out.append(f"{net}: TMDS_33 needs CONFIG VCCAUX = 3.3")
    return out


def _check_pairs(constraints: Constraints, located: Mapping[str, Pin]) -> list[str]:
    out = []
    for net, pin in located.items():
        if constraints.pins[net].get("IOSTANDARD") != "TMDS_33":
            continue
        positive, is_p = re.subn(r"_p\b", "_n", net)
        if not is_p:
            # The negative half is looked at with its positive one.
            if not re.search(r"_n\b", net):
                out.append(f"{net}: a differential port ends in _p or _n")
            continue
        other = located.get(positive)
        if other is None:
            out.append(f"{net}: its partner {positive} has no pin")
        elif (pin.bank, pin.pair) != (other.bank, other.pair) or not pin.is_positive:
            out.append(f"{net}, {positive}: {pin.ball} and {other.ball} are no P and N of a pair")
    return out


def check_clocks(constraints: Constraints, netlist: Netlist, top_text: str) -> list[str]:
    """Each clock has a period and a clock-capable pin; crossings have a limit of their own."""
    out = []
    ports = top_ports(top_text)
    kept = set(re.findall(r'attribute keep of (\w+)\s*: signal is "TRUE"', top_text))
    named = {net for nets in constraints.groups.values() for net in nets}
    for net in sorted(named):
        if net not in ports and net not in re.findall(r"signal (\w+)", top_text):
            out.append(f"TNM_NET {net} is no net of {TOP}")
        elif net not in ports and net not in kept:
            out.append(f"TNM_NET {net}: without the attribute keep its name may vanish")
    grouped_nets = {*constraints.groups, *constraints.unions}
    for group in {
        *constraints.periods,
        *(name for pair in constraints.limits for name in pair),
        *(name for parts in constraints.unions.values() for name in parts),
    } - grouped_nets:
        out.append(f"group {group} is not declared")
    # The tools derive no period behind a PLL or DCM from a group that is in other constraints too.
    shared = {name for pair in constraints.limits for name in pair}
    shared |= {name for parts in constraints.unions.values() for name in parts}
    timed: dict[Net, float] = {}
    for group, period in constraints.periods.items():
        for net in constraints.members(group):
            derived = netlist.reach(("", net), through_synthesizers=group not in shared)
            timed |= dict.fromkeys(derived, period)
    out += [
        f"clock {_text(clock)} has no period"
        for clock in sorted(netlist.clock_nets)
        if clock not in timed
    ]
    for net in (net for group in constraints.periods for net in constraints.members(group)):
        ball = constraints.pins.get(net, {}).get("LOC")
        if ball in pins() and not pins()[str(ball)].is_clock:
            out.append(f"clock {net}: ball {ball} ({pins()[str(ball)].name}) is no clock input")
    out += _check_synthesizers(netlist, timed)
    out += _check_crossings(constraints, netlist, timed)
    out += _check_untimed(constraints, top_text, kept)
    return out


def _text(net: Net) -> str:
    return "/".join(part for part in net if part)


def _check_synthesizers(netlist: Netlist, timed: Mapping[Net, float]) -> list[str]:
    """The input period in the generics of a PLL or DCM is that of the constraint."""
    out = []
    for kind, port, generic in (
        ("pll_adv", "clkin1", "CLKIN1_PERIOD"),
        ("dcm_clkgen", "clkin", "CLKIN_PERIOD"),
    ):
        for place in netlist.all_of(kind):
            stated = float(place.instance.generics[generic])
            period = timed.get(netlist.port(place, port))
            if period is not None and stated != period:
                out.append(
                    f"{place.path}: {generic} is {stated:g} ns, the constraint {period:g} ns"
                )
    return out


def _check_crossings(
    constraints: Constraints, netlist: Netlist, timed: Mapping[Net, float]
) -> list[str]:
    """Paths between clocks that crossings make have a limit, at most a period; no others have."""
    clocks_of = {
        group: set().union(*(netlist.reach(("", net)) for net in constraints.members(group)))
        & netlist.clock_nets
        for group in {*constraints.groups, *constraints.unions}
    }
    out = []
    crossed: set[tuple[Net | None, Net]] = set()
    for entity, ways in CROSSINGS.items():
        for place in netlist.all_of(entity):
            for source_port, target_port in ways:
                source = None if source_port is None else netlist.port(place, source_port)
                target = netlist.port(place, target_port)
                crossed.add((source, target))
                way = f"from {'any' if source is None else _text(source)} to {_text(target)}"
                delays = [
                    delay
                    for (begin, to), delay in constraints.limits.items()
                    if target in clocks_of.get(to, ())
                    and (source is None or source in clocks_of.get(begin, ()))
                ]
                # A clock without a period is told above.
                shortest = min(timed.get(source or target, math.inf), timed.get(target, math.inf))
                if not delays:
                    out.append(f"{place.path}: no limit {way}")
                elif source is not None and min(delays) > shortest:
                    out.append(f"{place.path}: {min(delays):g} ns {way}, {shortest:g} at most")
    for begin, to in constraints.limits:
        if not any(
            target in clocks_of.get(to, ())
            and (source is None or source in clocks_of.get(begin, ()))
            for source, target in crossed
        ):
            out.append(f"limit from {begin} to {to}: no crossing goes that way")
        if clocks_of.get(begin, set()) & clocks_of.get(to, set()):
            out.append(f"limit from {begin} to {to}: they share a clock")
    return out


def _check_untimed(constraints: Constraints, top_text: str, kept: set[str]) -> list[str]:
    """Each pin but clocks has a TIG, and each TIG a pin or a signal that keeps its name."""
    ports = top_ports(top_text)
    clocks = {net for group in constraints.periods for net in constraints.members(group)}
    clocks |= {re.sub(r"_p$", "_n", net) for net in clocks}
    out = [
        f"port {bit} is in no constraint of timing, not even a TIG"
        for bit in ports
        if bit not in clocks and not any(fnmatch(bit, net) for net in constraints.untimed)
    ]
    for net in constraints.untimed:
        if net.split("<")[0] not in kept and not any(fnmatch(bit, net) for bit in ports):
            out.append(f"TIG of {net}: no port, and no signal that keeps its name")
        out += [f"TIG of {net}: a clock" for clock in sorted(clocks) if fnmatch(clock, net)]
    return out


def check_sites(counts: Mapping[str, int]) -> list[str]:
    """The device has the primitives, and enough of each."""
    out = [f"{name} is no primitive of the device" for name in counts if not _is_known(name)]
    sites: Counter[str] = Counter()
    for name, number in counts.items():
        if _is_known(name):
            # A differential buffer takes two pins.
            pins_each = 2 if name in ("ibufds", "obufds") else 1
            sites[device().primitives[name]] += number * pins_each
    out += [
        f"{number} {site}, the device has {device().sites[site]}"
        for site, number in sites.items()
        if number > device().sites[site]
    ]
    return out


def _is_known(primitive: str) -> bool:
    return primitive in device().primitives


def check_serial_banks(constraints: Constraints, netlist: Netlist) -> list[str]:
    """A BUFPLL drives serialisers of one bank only, and a bank has two BUFPLLs."""
    out = []
    bufplls: Counter[int] = Counter()
    by_path = {place.path: place for place in netlist.places}
    for buffer in netlist.all_of("bufpll"):
        clock = netlist.port(buffer, "ioclk")
        banks: dict[int, str] = {}
        for serdes in (*netlist.all_of("iserdes2"), *netlist.all_of("oserdes2")):
            if netlist.port(serdes, "clk0") == clock:
                for net, bank in _banks_of(by_path[serdes.path.split("/")[0]], constraints):
                    banks.setdefault(bank, net)
        if len(banks) > 1:
            where = " and ".join(f"{bank} ({net})" for bank, net in sorted(banks.items()))
            out.append(f"{buffer.path}: serialisers in banks {where}, a BUFPLL reaches one")
        bufplls.update(set(banks))
    out += [
        f"bank {bank}: {number} BUFPLLs, it has {device().io.bufpll_per_bank}"
        for bank, number in bufplls.items()
        if number > device().io.bufpll_per_bank
    ]
    return out


def _banks_of(place: Place, constraints: Constraints) -> list[tuple[str, int]]:
    """Pins and banks of the top level's ports that an instance is joined to."""
    names = {base_name(actual) for actual in place.instance.ports.values()}
    return [
        (net, pins()[str(attributes["LOC"])].bank)
        for net, attributes in constraints.pins.items()
        if net.split("<")[0] in names
        and attributes.get("LOC") in pins()
        and pins()[str(attributes["LOC"])].is_io
    ]


def source_of_line(line: str) -> Path:
    """File that a line of a project file names; it must be VHDL for the library work."""
    match = re.fullmatch(r'vhdl work "([^"]+)"', line)
    if match is None:
        raise InputError(
            f'{line!r} is not understood; write vhdl work "path"', where="project file"
        )
    return Path(match[1])


def check_project(lines: Sequence[str]) -> list[str]:
    """The project file lists each source once, except those of other boards, and nothing else."""
    listed = [source_of_line(line) for line in lines]
    out = [f"{path}: no such file" for path in listed if not path.is_file()]
    out += [f"{path} is listed twice" for path, number in Counter(listed).items() if number > 1]
    folder = project.root() / "hdl"
    others = set(hdl.all_sources()) - set(hdl.board_sources())
    sources = {
        path
        for path in folder.rglob("*.vhd")
        if not path.is_relative_to(folder / "sim") and path not in others
    }
    out += [f"{path} is missing" for path in sorted(sources - set(listed))]
    out += [f"{path} is no synthesisable source" for path in listed if path not in sources]
    return out


def elaborate(sources: Sequence[Path], folder: Path) -> tuple[list[str], Counter[str]]:
    """Analyse the sources as VHDL-93 and elaborate the top: problems, number of each primitive."""
    simulator = find_simulator("ghdl", brief=True)
    environment = {**os.environ, **simulator.environment}
    standard = ["--std=93", "--syn-binding"]
    # XST takes a component of this name from its library, whatever was declared.
    steps = [
        ["ghdl", "-a", *standard, "--work=unisim", *map(str, hdl.model_sources())],
        ["ghdl", "-a", *standard, *map(str, sources)],
        ["ghdl", "-e", *standard, TOP],
        [
            *("ghdl", "-r", *standard, TOP, "--max-stack-alloc=0"),
            *("--ieee-asserts=disable", "--disp-tree=inst", "--stop-time=0ns"),
        ],
    ]
    for step in steps:
        process = subprocess.run(
            step, cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
        if process.returncode != 0:
            lines = (process.stderr + process.stdout).splitlines()
            placed = re.compile(r"\S+:\d+:\d+:(?!warning:|note:)|.*:error: ")
            errors = [line for line in lines if placed.match(line)] or lines
            return [errors[0] if errors else f"{' '.join(step[:2])} failed"], Counter()
    names = {path.stem for path in hdl.model_sources()} - {"vcomponents", "model_faults"}
    entities = re.findall(r"-(\w+) \[entity\]", process.stdout)
    return [], Counter(name for name in entities if name in names)


def check_options(folder: Path) -> list[str]:
    """All option files exist, and each of their lines is an option."""
    out = []
    for name in OPTION_FILES:
        try:
            options = read_options(folder / name)
        except InputError as error:
            out.append(str(error))
            continue
        flags = [option.split()[0] for option in options if not option.startswith("-g ")]
        out += [f"{name}: {flag} is there twice" for flag, n in Counter(flags).items() if n > 1]
    return out


Report = Callable[[str, Sequence[str], str], None]


def run_checks(report: Report) -> int:
    """Run all checks and count the problems.

    `report` is called with the name of each check, its problems, and what was found.
    """
    total = 0

    def tell(name: str, problems: Sequence[str], summary: str) -> None:
        nonlocal total
        total += len(problems)
        report(name, problems, summary)

    lines = project_lines()
    sources = [source_of_line(line) for line in lines]
    tell("project", check_project(lines), f"{len(lines)} sources")
    with tempfile.TemporaryDirectory() as work:
        problems, counts = elaborate(sources, Path(work))
    tell("sources", problems, "analysed in order as VHDL-93, elaborated")
    texts = {path.stem: path.read_text() for path in sources}
    top_text = texts[TOP]
    netlist = read_netlist(TOP, texts)
    used = {i.of for text in texts.values() for i in instances(text) if i.is_component}
    tell("sites", check_sites(counts or dict.fromkeys(used, 1)), _listed(counts))
    try:
        constraints = read_constraints(constraints_file())
    except InputError as error:
        tell("constraints", [str(error)], "")
    else:
        ports = top_ports(top_text)
        tell("pins", check_pins(constraints, top_text), f"{len(ports)} pins")
        tell(
            "clocks",
            check_clocks(constraints, netlist, top_text),
            f"{len(netlist.clock_nets)} clocks, {len(constraints.limits)} ways between clocks",
        )
        banks = check_serial_banks(constraints, netlist)
        tell("serial", banks, f"{len(netlist.all_of('bufpll'))} BUFPLLs")
        tell(
            "routing",
            check_clock_routing(constraints, netlist),
            f"{len(global_buffers(constraints, netlist))} clock multiplexers have places",
        )
    folder = option_folder()
    tell("options", check_options(folder), f"{len(OPTION_FILES)} option files")
    return total


def _listed(counts: Mapping[str, int]) -> str:
    sites: Counter[str] = Counter()
    for name, number in counts.items():
        if _is_known(name) and device().primitives[name] != "IOB":
            sites[device().primitives[name]] += number
    return ", ".join(f"{n} of {device().sites[site]} {site}" for site, n in sorted(sites.items()))
