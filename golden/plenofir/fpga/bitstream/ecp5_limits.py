# SPDX-License-Identifier: Apache-2.0
"""What the data sheet gives the slowest ECP5, beside what placed designs reach.

Timing analysis says how fast the fabric's paths are, not what clock network, lane registers and
output buffers are specified for. The numbers are those of FPGA-DS-02012 for grade 6: output buffers
(table 3.21) and lanes (GDDRX1 500 Mb/s, GDDRX2 624 Mb/s) as public projects quote edition 1.9, the
clock network (table 3.22) as remembered. The data sheet itself could not be read when this was
written: check them there.
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
    """What of a build is beyond the data sheet, a sentence each."""

    refused: tuple[str, ...]  # unless it is asked for
    told: tuple[str, ...]


def beyond_data_sheet(fastest_mhz: float) -> Beyond:
    """Judge the fastest pixel clock of a build whose lanes take two bits a clock."""
    lanes = 5 * fastest_mhz
    refused = []
    if lanes > PRIMARY_CLOCK_MHZ:
        refused.append(f"lanes' clock of {lanes:g} MHz, {PRIMARY_CLOCK_MHZ:g} MHz specified")
    if 2 * lanes > LANE_MBITS:
        refused.append(f"lanes of {2 * lanes:g} Mb/s, {LANE_MBITS:g} Mb/s specified")
    told = []
    if lanes > LVCMOS33_OUTPUT_MHZ:
        told.append(
            f"outputs of up to {lanes:g} MHz at {fastest_mhz:g} MHz pixel clock, "
            f"{LVCMOS33_OUTPUT_MHZ:g} MHz specified for LVCMOS33"
        )
    return Beyond(tuple(refused), tuple(told))
