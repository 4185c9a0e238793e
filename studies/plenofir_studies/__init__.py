# SPDX-License-Identifier: Apache-2.0
"""Measurements and comparisons: precision, validation, experiments, the tables of the thesis.

They use the package `plenofir`; nothing in it imports them.
"""

from pathlib import Path

DATA = Path(__file__).resolve().parent / "data"
"""What the thesis prints, and what was measured beside it."""
