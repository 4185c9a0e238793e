# SPDX-License-Identifier: Apache-2.0
"""Names of clocks in a netlist for nextpnr; Yosys has many for a net through a hierarchy."""

from collections.abc import Mapping
from typing import Any


def name_nets(module: dict[str, Any], nets: Mapping[str, tuple[str, str]]) -> None:
    """Give nets of a module the names that constraints and reports know them by.

    `nets` is each name with the cell and port that the net is joined to; what has no such cell
    is left as it is.
    """
    cells, names = module["cells"], module["netnames"]
    for name, (cell, port) in nets.items():
        if cell in cells:
            bits = cells[cell]["connections"][port]
            for other in [other for other, net in names.items() if net["bits"] == bits]:
                del names[other]
            names[name] = {"hide_name": 0, "bits": bits, "attributes": {}}
