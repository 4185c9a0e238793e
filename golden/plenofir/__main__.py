# SPDX-License-Identifier: Apache-2.0
"""The command ``plenofir``, also as ``python -m plenofir``."""

import sys


def main() -> None:
    """Run the command line; an interrupt while it is being loaded ends in one line too."""
    try:
        from plenofir.commands.app import main as run
    except KeyboardInterrupt:
        print("plenofir: interrupted", file=sys.stderr)
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
