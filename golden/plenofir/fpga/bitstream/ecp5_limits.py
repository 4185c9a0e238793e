# SPDX-License-Identifier: Apache-2.0
"""Limits of the slowest ECP5 by its data sheet, beside what placed designs reach.

Timing analysis covers the paths of the fabric, but not the specified limits of clock network, lane
registers and output buffers. The numbers are those of FPGA-DS-02012 for grade 6: output buffers
(table 3.21) and lanes (GDDRX1 500 Mb/s, GDDRX2 624 Mb/s) as public projects quote edition 1.9, the
clock network (table 3.22) from memory. The data sheet was not at hand: check them there.
"""

from dataclasses import dataclass

PRIMARY_CLOCK_MHZ = 257.0
"""Global clock network."""
LANE_MBITS = 500.0
"""A lane with one bit for each edge of a clock of the fabric (GDDRX1)."""
LVCMOS33_OUTPUT_MHZ = 150.0
"""Output buffers at 3.3 V, of which the GPDI's pairs are made. Public designs for the ULX3S drive
them at twice that; the eye gets smaller. It is told, not refused."""


@dataclass(frozen=True)
class Beyond:
    """What exceeds the data sheet in a build, one sentence each."""

    refused: tuple[str, ...]  # not built unless the user asks for it
    notes: tuple[str, ...]  # built, and said


def beyond_data_sheet(fastest_mhz: float) -> Beyond:
    """Judge the fastest pixel clock of a build whose lanes take two bits a clock."""
    lanes = 5 * fastest_mhz
    refused = []
    if lanes > PRIMARY_CLOCK_MHZ:
        refused.append(f"lanes' clock of {lanes:g} MHz, {PRIMARY_CLOCK_MHZ:g} MHz specified")
    if 2 * lanes > LANE_MBITS:
        refused.append(f"lanes of {2 * lanes:g} Mb/s, {LANE_MBITS:g} Mb/s specified")
    notes = []
    if lanes > LVCMOS33_OUTPUT_MHZ:
        notes.append(
            f"outputs of up to {lanes:g} MHz at {fastest_mhz:g} MHz pixel clock, "
            f"{LVCMOS33_OUTPUT_MHZ:g} MHz specified for LVCMOS33"
        )
    return Beyond(tuple(refused), tuple(notes))
