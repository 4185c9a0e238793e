# SPDX-License-Identifier: Apache-2.0
"""The receiver's tests on a design that holds it alone: what GHDL makes of it in Verilog."""

from plenofir_tb.case import begin_case, load_cases

begin_case(load_cases()[0]["case"])

from csi.receiver_bench import *  # noqa: E402, F403
