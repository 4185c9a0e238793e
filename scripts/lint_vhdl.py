# SPDX-License-Identifier: Apache-2.0
"""Style of the VHDL sources by vsg, only of those that changed since they were found good.

Usage: python scripts/lint_vhdl.py

Good sources, with the version of vsg and its configuration, are recorded in build/vsg, as reading
all sources takes a minute. Names that are visible beside Verilog (ports, generics, signals, labels)
must not be reserved words of SystemVerilog, which some mixed-language simulators refuse.
"""

import hashlib
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

from plenofir.ground import project

ROOT = project.root()
CONFIGURATION = ROOT / "scripts" / "vsg.yaml"
GOOD = ROOT / "build" / "vsg" / "good.txt"

# IEEE 1800-2017, annex B, without those that VHDL reserves too or that name no thing.
_WORDS = """
accept_on always always_comb always_ff always_latch assign automatic before bind bins binsof bit
break buf bufif0 bufif1 byte casex casez cell chandle checker class clocking cmos const
constraint continue covergroup coverpoint cross deassign default defparam design dist do edge
endcase endmodule enum eventually expect export extends extern final first_match force foreach
forever fork forkjoin genvar global highz0 highz1 iff ifnone implements implies import incdir
include initial input inside instance int integer interconnect interface intersect join join_any
join_none large let liblist local localparam logic longint macromodule matches medium modport
module negedge nettype nexttime nmos notif0 notif1 output packed parameter pmos posedge
primitive priority program property pull0 pull1 pulldown pullup rand randc randcase randsequence
rcmos real realtime ref reg reject_on repeat restrict rnmos rpmos rtran scalared sequence
shortint shortreal signed small soft solve specify specparam static string strong strong0
strong1 struct super supply0 supply1 table tagged task this throughout time timeprecision
timeunit tran tri tri0 tri1 triand trior trireg typedef union unique unique0 unsigned until
untyped uwire var vectored virtual void wand weak weak0 weak1 wildcard wire within wor
"""
RESERVED = frozenset(_WORDS.split())


def reserved_names(text: str) -> Iterator[tuple[int, str]]:
    """Lines and names of ports, generics, signals and labels that SystemVerilog reserves."""
    plain = re.sub(r"--[^\n]*", "", text)
    # Fields of records and parameters of functions are visible in VHDL only.
    for inside in (
        r"\bis record\b.*?\bend record\b",
        r"\b(?:function|procedure)\s+\w+\s*\(.*?\)\s*(?:return|;|is)",
    ):
        plain = re.sub(inside, lambda found: "\n" * found[0].count("\n"), plain, flags=re.S)
    for found in re.finditer(r"^ *(?:signal +)?(\w+(?: *, *\w+)*) *:(?!=)", plain, re.M):
        for name in re.split(r" *, *", found[1]):
            if name in RESERVED:
                yield plain.count("\n", 0, found.start(1)) + 1, name


def digests() -> dict[str, Path]:
    """Hashes of everything that vsg's verdict depends on, by source."""
    common = version("vsg").encode() + b"\0" + CONFIGURATION.read_bytes() + b"\0"
    return {
        hashlib.sha256(common + str(path).encode() + b"\0" + path.read_bytes()).hexdigest(): path
        for folder in ("hdl", "tb", "examples")
        for path in sorted((ROOT / folder).rglob("*.vhd"))
    }


def main() -> int:
    """Print what vsg finds, and names that are reserved."""
    refused = [
        f"{path}:{line}: {name} is a reserved word of SystemVerilog; choose another name"
        for path in sorted((ROOT / "hdl").rglob("*.vhd"))
        # Models have the names that a vendor's primitives have.
        if not path.is_relative_to(ROOT / "hdl" / "sim")
        for line, name in reserved_names(path.read_text())
    ]
    if refused:
        print(*refused, sep="\n")
        return 1
    sources = digests()
    good = set(GOOD.read_text().split()) if GOOD.exists() else set()
    changed = [str(path) for digest, path in sources.items() if digest not in good]
    if not changed:
        return 0
    command = [str(Path(sys.executable).parent / "vsg"), "--configuration", str(CONFIGURATION)]
    command += ["--output_format", "syntastic", "--filename", *changed]
    status = subprocess.run(command, check=False).returncode
    if status == 0:
        GOOD.parent.mkdir(parents=True, exist_ok=True)
        GOOD.write_text("\n".join(sources) + "\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
