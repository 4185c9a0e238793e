# SPDX-License-Identifier: Apache-2.0
"""A wrapper for cores that have more ports than a device has pins."""

import re

NAME = "few_pins"
"""The wrapper's name."""
# Wider ports are given one pin.
_WIDE = 16
_PORT = re.compile(r"\b(input|output)\s+(?:reg\s+)?(?:\[(\d+):0\]\s*)?(\w+)")


def few_pins(verilog: str, top: str) -> str:
    """Put a core, in GHDL's Verilog, behind few pins, to place it for its clock and size.

    A wide input comes over a shift register, a bit each clock; a wide output leaves as the parity
    of its bits. So no bit of the core is left out, and no path of it becomes longer. `top` has a
    port ``clk``; the result is the module `NAME`.
    """
    found = re.search(rf"^module {top}\b(.*?)\);", verilog, re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError(f"no module {top}")
    pins: list[str] = []
    body: list[str] = []
    links: list[str] = []
    for mode, high, name in _PORT.findall(found[1]):
        width = int(high or 0) + 1
        wide = width > _WIDE
        pins.append(f"{mode} {'' if wide or width == 1 else f'[{high}:0] '}{name}")
        links.append(f".{name}({name}{'_bits' if wide else ''})")
        if wide and mode == "input":
            body += [
                f"  reg [{high}:0] {name}_bits;",
                f"  always @(posedge clk) {name}_bits <= {{{name}_bits, {name}}};",
            ]
        elif wide:
            body += [f"  wire [{high}:0] {name}_bits;", f"  assign {name} = ^{name}_bits;"]
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
