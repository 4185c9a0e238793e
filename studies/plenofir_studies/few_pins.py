# SPDX-License-Identifier: Apache-2.0
"""A wrapper for cores that have more ports than a device has pins."""

import re

NAME = "few_pins"
"""The wrapper's name."""
# Wider ports share one pin.
_WIDE = 16
_PORT = re.compile(r"\b(input|output)\s+(?:reg\s+)?(?:\[(\d+):0\]\s*)?(\w+)")


def few_pins(verilog: str, top: str) -> str:
    """Put a core, in GHDL's Verilog, behind few pins, to place it for its clock and size.

    A wide input is a shift register, one bit each clock; a wide output is reduced to the parity of
    its bits. So no bit of the core is optimised away, and no path becomes longer. `top` has a port
    ``clk``; the result is the module `NAME`.
    """
    pins: list[str] = []
    body: list[str] = []
    links: list[str] = []
    for mode, width, name in _ports(verilog, top):
        wide = width > _WIDE
        high = width - 1
        pins.append(f"{mode} {'' if wide or width == 1 else f'[{high}:0] '}{name}")
        links.append(f".{name}({name}{'_bits' if wide else ''})")
        if wide and mode == "input":
            body += [
                f"  reg [{high}:0] {name}_bits;",
                f"  always @(posedge clk) {name}_bits <= {{{name}_bits, {name}}};",
            ]
        elif wide:
            body += [f"  wire [{high}:0] {name}_bits;", f"  assign {name} = ^{name}_bits;"]
    return _module(top, pins, body, links)


def three_pins(verilog: str, top: str) -> str:
    """Put a core behind clock, one input and one output, for tools that need each pin's location.

    All inputs are one shift register. All outputs are combined in another one, with one gate for
    each bit between two registers, so that no path of the core becomes longer.
    """
    ports = [port for port in _ports(verilog, top) if port[2] != "clk"]
    widths = {mode: sum(w for m, w, _ in ports if m == mode) for mode in ("input", "output")}
    links, begin = [".clk(clk)"], dict.fromkeys(widths, 0)
    for mode, width, name in ports:
        first = begin[mode]
        begin[mode] += width
        links.append(f".{name}({mode}_bits[{first + width - 1}:{first}])")
    body = [
        f"  reg [{widths['input'] - 1}:0] input_bits;",
        f"  wire [{widths['output'] - 1}:0] output_bits;",
        f"  reg [{widths['output'] - 1}:0] folded;",
        "  assign data_out = folded[0];",
        "  always @(posedge clk) begin",
        "    input_bits <= {input_bits, data_in};",
        "    folded <= {folded[0], folded} >> 1 ^ output_bits;",
        "  end",
    ]
    return _module(top, ["input clk", "input data_in", "output data_out"], body, links)


def _ports(verilog: str, top: str) -> list[tuple[str, int, str]]:
    """Mode, width and name of each port of a module."""
    match = re.search(rf"^module {top}\b(.*?)\);", verilog, re.MULTILINE | re.DOTALL)
    if match is None:
        raise ValueError(f"no module {top}")
    return [(mode, int(high or 0) + 1, name) for mode, high, name in _PORT.findall(match[1])]


def _module(top: str, pins: list[str], body: list[str], links: list[str]) -> str:
    return "\n".join(
        [
            f"module {NAME} (",
            ",\n".join(f"  {pin}" for pin in pins),
            ");",
            *body,
            f"  {top} core (",
            ",\n".join(f"    {link}" for link in links),
            "  );",
            "endmodule",
            "",
        ]
    )
