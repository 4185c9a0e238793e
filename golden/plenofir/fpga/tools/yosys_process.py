# SPDX-License-Identifier: Apache-2.0
"""Runs Yosys commands, one for each argument, in a process of their own: Yosys exits on errors."""

import sys


def main() -> None:
    """Run the commands on an empty design."""
    from pyosys import libyosys

    design = libyosys.Design()
    for command in sys.argv[1:]:
        libyosys.run_pass(command, design)


if __name__ == "__main__":
    main()
