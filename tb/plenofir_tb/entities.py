# SPDX-License-Identifier: Apache-2.0
"""cocotb tests for one entity each, in a common module."""

from typing import Any

import cocotb

from plenofir_tb.case import read_case


def for_entity(name: str) -> Any:
    """Run a test only if its entity is under test."""
    return cocotb.test(skip=read_case()["entity"] != name)
