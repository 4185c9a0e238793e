# SPDX-License-Identifier: Apache-2.0
"""The driver of a core behind a bus: its registers."""

from plenofir.driver.registers import Access, Registers

__all__ = ["Access", "Registers"]
