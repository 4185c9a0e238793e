# SPDX-License-Identifier: Apache-2.0
"""The command ``plenofir``, also as ``python -m plenofir``."""

import logging
import os
import sys
import warnings


def main() -> None:
    """Run the command line; an interrupt while it is being loaded ends in one line too."""
    # Read when NumPy is imported. No matrix here is large enough for a second thread to help, and
    # OpenBLAS's threads wait by spinning: half of a calibration's processor time.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if not sys.warnoptions and "--debug" not in sys.argv:
        # What libraries warn and log of is for whoever writes the program; processes that this one
        # starts inherit the first.
        os.environ["PYTHONWARNINGS"] = "ignore"
        warnings.simplefilter("ignore")
        logging.getLogger().addHandler(logging.NullHandler())
    try:
        from plenofir.commands.app import main as run
    except KeyboardInterrupt:
        print("plenofir: interrupted", file=sys.stderr)
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
