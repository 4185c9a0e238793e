# SPDX-License-Identifier: Apache-2.0
"""Paths between clocks in a netlist: registers that registers of another clock sample."""

import json
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from plenofir.fpga.tools.synthesis import run_yosys, write_verilog

Bit = int | str
Register = tuple[Bit, str]  # its clock and its name


class Netlist:
    """A design as Yosys has it: gates, flip-flops of a bit each, and memories."""

    def __init__(
        self, sources: Sequence[Path], top: str, generics: Mapping[str, int], folder: Path
    ) -> None:
        verilog = write_verilog(sources, top, dict(generics), folder)
        run_yosys(
            [
                f"read_verilog {verilog.name}",
                f"hierarchy -check -top {top}; proc; flatten; opt_clean; memory_collect; simplemap",
                "opt_clean; write_json paths.json",
            ],
            folder / "yosys.log",
        )
        # Signals of the VHDL; Yosys also names the ports of instances.
        self._signals = {
            name for s in sources for name in re.findall(r"signal (crossing_\w+)", s.read_text())
        }
        module: dict[str, Any] = json.loads((folder / "paths.json").read_text())["modules"][top]
        self.attributes: dict[str, dict[str, str]] = {}
        self._names: dict[Bit, list[str]] = defaultdict(list)
        for name, net in module["netnames"].items():
            self.attributes[name] = net.get("attributes", {})
            for bit in net["bits"]:
                self._names[bit].append(name)
        # Bits that a gate's output depends on; registers, with the bits that they sample.
        self._gates: dict[Bit, list[Bit]] = defaultdict(list)
        self.registers: dict[Register, list[Bit]] = defaultdict(list)
        self._outputs: dict[Bit, Register] = {}
        for name, cell in module["cells"].items():
            ports: dict[str, list[Bit]] = cell["connections"]
            if "DFF" in cell["type"]:
                register = (ports["C"][0], self._name(ports["Q"][0]))
                self._outputs[ports["Q"][0]] = register
                sampled = (bit for port in "DERS" for bit in ports.get(port, ()))
                self.registers[register].extend(sampled)
            elif cell["type"].startswith("$mem"):
                for bit in ports["RD_DATA"]:
                    self._gates[bit].extend(ports["RD_ADDR"])
                if not ports["WR_CLK"]:
                    continue
                register = (ports["WR_CLK"][0], str(cell["parameters"].get("MEMID", name)))
                self.registers[register].extend(
                    bit for port in ("WR_ADDR", "WR_DATA", "WR_EN") for bit in ports[port]
                )
                self._outputs |= dict.fromkeys(ports["RD_DATA"], register)
            else:
                outputs = {port for port, way in cell["port_directions"].items() if way == "output"}
                inputs = [bit for port in ports if port not in outputs for bit in ports[port]]
                for port in outputs:
                    for bit in ports[port]:
                        self._gates[bit].extend(inputs)

    def _name(self, bit: Bit) -> str:
        """The name that a constraint finds, if a bit has one."""
        return min(
            self._names[bit],
            key=lambda name: (name.rpartition(".")[2] not in self._signals, len(name)),
        )

    def sources(self, register: Register) -> set[Register]:
        """Registers that one samples, through gates and the addresses of memories."""
        reached: set[Bit] = set()
        waiting = list(self.registers[register])
        while waiting:
            bit = waiting.pop()
            if bit not in reached:
                reached.add(bit)
                waiting.extend(self._gates.get(bit, ()))
        return {self._outputs[bit] for bit in reached if bit in self._outputs}

    def paths(self) -> Iterator[tuple[Register, Register]]:
        """From each register to each that samples it in another clock."""
        for register in self.registers:
            for source in self.sources(register):
                if source[0] != register[0]:
                    yield source, register
