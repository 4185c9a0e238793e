# SPDX-License-Identifier: Apache-2.0
"""Measurements and comparisons: precision, validation, experiments, the tables of the thesis.

They use the package `plenofir`; nothing in it imports them.
"""

from pathlib import Path

from plenofir.refocus import first_calls

# Times are those of compiled code.
first_calls.patient = True

DATA = Path(__file__).resolve().parent / "data"
"""What the thesis prints, and what was measured beside it."""
