# SPDX-License-Identifier: Apache-2.0
"""The driver's tests on a design with a single entity, in GHDL's Verilog."""

from plenofir_tb.case import begin_case, load_cases

begin_case(load_cases()[0]["case"])

from axi.driver_bench import *  # noqa: E402, F403
