# SPDX-License-Identifier: Apache-2.0
"""A core alone as a project: it has more ports than many packages have pins.

Vivado synthesises it out of context, Quartus gives it virtual pins; for the other tools a wrapper
with three pins stands around it.
"""

from typing import Literal

from plenofir.plan.ip.components import components
from plenofir.plan.plan import Plan
from plenofir.plan.scene_top import TOP

Way = Literal["context", "virtual", "pins"]
"""How a tool builds a core alone: out of context, with virtual pins, in `PINS_TOP`."""
PINS_TOP = "scene_pins"
"""Entity around a core with a clock, one input and one output."""

OUT_OF_CONTEXT = """\
# The core is a part of a design: its ports get no pads.
set_property -name {STEPS.SYNTH_DESIGN.ARGS.MORE OPTIONS} -value {-mode out_of_context} \\
  -objects [get_runs synth_1]
"""


def core_ports(plan: Plan) -> list[tuple[str, str, int]]:
    """Name, mode and bits of each port of a scene's top level; 0 bits are a single std_logic."""
    (top,) = (component for component in components(plan) if component.core == TOP)
    return [
        (port.name, port.mode, port.bits if port.core_bits is None else port.core_bits)
        for port in top.ports
    ]


def pins_of(plan: Plan) -> int:
    """Pins that all ports of a scene's top level would take."""
    return sum(max(bits, 1) for _, _, bits in core_ports(plan))


def virtual_pins(plan: Plan) -> str:
    """Tcl for Quartus: each port except the clock is a virtual pin."""
    lines = []
    for name, _, bits in core_ports(plan):
        names = [f"{name}[{bit}]" for bit in range(bits)] or [name]
        lines += [
            f"set_instance_assignment -name VIRTUAL_PIN ON -to {{{pin}}}"
            for pin in names
            if pin != "clk"
        ]
    return "".join(f"{line}\n" for line in lines)


def pins_text(plan: Plan) -> str:
    """VHDL-93 of `PINS_TOP`.

    All inputs are one shift register. All outputs are combined in another one, with one gate for
    each bit between two registers, so that no path of the core becomes longer and none is removed.
    """
    begin, links = {"in": 0, "out": 0}, []
    for name, mode, bits in core_ports(plan):
        if name == "clk":
            links.append("      clk => clk")
            continue
        first = begin[mode]
        begin[mode] += max(bits, 1)
        place = f"{begin[mode] - 1} downto {first}" if bits else str(first)
        links.append(f"      {name} => {mode}_bits({place})")
    inputs, outputs = begin["in"] - 1, begin["out"] - 1
    return "\n".join(
        [
            f"-- The scene {plan.scene} behind three pins, to build it for its size and its clock.",
            "",
            "library ieee;",
            "  use ieee.std_logic_1164.all;",
            "",
            f"entity {PINS_TOP} is",
            "  port (",
            "    clk      : in    std_logic;",
            "    -- The core's inputs, one after the other.",
            "    data_in  : in    std_logic;",
            "    -- All of the core's outputs, combined.",
            "    data_out : out   std_logic",
            "  );",
            f"end entity {PINS_TOP};",
            "",
            f"architecture rtl of {PINS_TOP} is",
            "",
            f"  signal in_bits  : std_logic_vector({inputs} downto 0);",
            f"  signal out_bits : std_logic_vector({outputs} downto 0);",
            f"  signal folded   : std_logic_vector({outputs} downto 0);",
            "",
            "begin",
            "",
            "  data_out <= folded(0);",
            "",
            "  shift : process (clk) is",
            "  begin",
            "    if rising_edge(clk) then",
            f"      in_bits <= in_bits({inputs - 1} downto 0) & data_in;",
            f"      folded  <= (folded(0) & folded({outputs} downto 1)) xor out_bits;",
            "    end if;",
            "  end process shift;",
            "",
            f"  core : entity work.{TOP}",
            "    port map (",
            ",\n".join(links),
            "    );",
            "",
            "end architecture rtl;",
            "",
        ]
    )
