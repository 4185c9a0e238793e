# SPDX-License-Identifier: Apache-2.0
"""Verilog models of Spartan-6's block RAM, which Yosys lacks, for the modes that Yosys uses.

A port that writes reads the old word (READ_FIRST); there are no output registers and no resets.
"""

from collections.abc import Iterator, Sequence

_WORD = 256
"""Bits of an INIT parameter."""


def _parameters(rows: int, parity_rows: int) -> Iterator[str]:
    """Verilog lines of the parameters, with rows of initial data and parity."""
    for letter in "AB":
        yield f"  parameter DATA_WIDTH_{letter} = 0;"
        yield f"  parameter DO{letter}_REG = 0;"
        yield f'  parameter EN_RSTRAM_{letter} = "TRUE";'
        yield f"  parameter [71:0] INIT_{letter} = 0;"
        yield f"  parameter [71:0] SRVAL_{letter} = 0;"
        yield f'  parameter RST_PRIORITY_{letter} = "CE";'
        yield f'  parameter WRITE_MODE_{letter} = "READ_FIRST";'
    yield '  parameter RAM_MODE = "TDP";'
    yield '  parameter RSTTYPE = "SYNC";'
    for kind, count in (("INIT_", rows), ("INITP_", parity_rows)):
        for row in range(count):
            yield f"  parameter [{_WORD - 1}:0] {kind}{row:02X} = 0;"


def _module(
    name: str, bits: int, ports: Sequence[tuple[str, dict[str, str]]], wide: bool
) -> Iterator[str]:
    """Verilog lines of a block RAM with data bits and one parity bit for each eight."""
    rows, parity_rows = bits // _WORD, bits // 8 // _WORD
    address = (bits - 1).bit_length()
    lanes = 2 if wide else 4
    pins = [pin for _, port in ports for pin in port.values()]
    yield f"module {name}({', '.join(pins)});"
    yield from _parameters(rows, parity_rows)
    for _, port in ports:
        yield f"  input {port['clock']}, {port['enable']}, {port['reset']}, {port['register']};"
        yield f"  input [{address - 1}:0] {port['address']};"
        yield f"  input [{lanes - 1}:0] {port['write']};"
        yield f"  input [{8 * lanes - 1}:0] {port['data']};"
        yield f"  input [{lanes - 1}:0] {port['parity']};"
        yield f"  output reg [{8 * lanes - 1}:0] {port['out']};"
        yield f"  output reg [{lanes - 1}:0] {port['out_parity']};"
    yield f"  reg [{bits - 1}:0] data;"
    yield f"  reg [{bits // 8 - 1}:0] parity;"
    yield "  integer i;"
    yield "  initial begin"
    for name_, kind, count in (("data", "INIT_", rows), ("parity", "INITP_", parity_rows)):
        for row in range(count):
            yield f"    {name_}[{row * _WORD} +: {_WORD}] = {kind}{row:02X};"
    yield "  end"
    for letter, port in ports:
        width = f"(DATA_WIDTH_{letter} >= 9 ? DATA_WIDTH_{letter} / 9 * 8 : DATA_WIDTH_{letter})"
        yield f"  localparam W{letter} = {width};"
        yield f"  wire [{address - 1}:0] base_{letter} = {port['address']} & ~(W{letter} - 1);"
    (_, a), (_, b) = ports
    if wide:
        # One port of both halves writes, the other one reads.
        yield '  generate if (RAM_MODE == "SDP") begin : sdp'
        yield f"  always @(posedge {a['clock']}) if ({a['enable']})"
        yield "    for (i = 0; i < 4; i = i + 1)"
        yield f"      if (i < 2 ? {a['write']}[i] : {b['write']}[i - 2]) begin"
        yield f"        data[base_A + 8 * i +: 8] <= i < 2 ? {a['data']}[8 * i +: 8]"
        yield f"          : {b['data']}[8 * (i - 2) +: 8];"
        yield f"        parity[(base_A >> 3) + i] <= i < 2 ? {a['parity']}[i]"
        yield f"          : {b['parity']}[i - 2];"
        yield "      end"
        yield f"  always @(posedge {b['clock']}) if ({b['enable']}) begin"
        yield f"    {{{b['out']}, {a['out']}}} <= data[base_B +: 32];"
        yield f"    {{{b['out_parity']}, {a['out_parity']}}} <= parity[(base_B >> 3) +: 4];"
        yield "  end"
        yield "  end else begin : tdp"
    for letter, port in ports:
        yield f"  always @(posedge {port['clock']}) if ({port['enable']}) begin"
        yield f"    for (i = 0; i < {8 * lanes}; i = i + 1)"
        yield f"      if (i < W{letter}) begin"
        yield f"        {port['out']}[i] <= data[base_{letter} + i];"
        yield f"        if ({port['write']}[i / 8]) data[base_{letter} + i] <= {port['data']}[i];"
        yield "      end"
        yield f"    for (i = 0; i < {lanes}; i = i + 1)"
        yield f"      if (8 * i < W{letter} && W{letter} >= 8) begin"
        place = f"(base_{letter} >> 3) + i"
        yield f"        {port['out_parity']}[i] <= parity[{place}];"
        yield f"        if ({port['write']}[i]) parity[{place}] <= {port['parity']}[i];"
        yield "      end"
        yield "  end"
    if wide:
        yield "  end endgenerate"
    yield "endmodule"


def block_ram_models() -> str:
    large = [
        (
            letter,
            {
                "clock": f"CLK{letter}",
                "enable": f"EN{letter}",
                "reset": f"RST{letter}",
                "register": f"REGCE{letter}",
                "address": f"ADDR{letter}",
                "write": f"WE{letter}",
                "data": f"DI{letter}",
                "parity": f"DIP{letter}",
                "out": f"DO{letter}",
                "out_parity": f"DOP{letter}",
            },
        )
        for letter in "AB"
    ]
    small_a = {
        "clock": "CLKAWRCLK",
        "enable": "ENAWREN",
        "reset": "RSTA",
        "register": "REGCEA",
        "address": "ADDRAWRADDR",
        "write": "WEAWEL",
        "data": "DIADI",
        "parity": "DIPADIP",
        "out": "DOADO",
        "out_parity": "DOPADOP",
    }
    small_b = {
        "clock": "CLKBRDCLK",
        "enable": "ENBRDEN",
        "reset": "RSTBRST",
        "register": "REGCEBREGCE",
        "address": "ADDRBRDADDR",
        "write": "WEBWEU",
        "data": "DIBDI",
        "parity": "DIPBDIP",
        "out": "DOBDO",
        "out_parity": "DOPBDOP",
    }
    lines = [
        *_module("RAMB16BWER", 1 << 14, large, wide=False),
        *_module("RAMB8BWER", 1 << 13, [("A", small_a), ("B", small_b)], wide=True),
    ]
    return "\n".join(lines) + "\n"
