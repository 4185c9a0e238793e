# SPDX-License-Identifier: Apache-2.0
"""The receiver's tests on GHDL's Verilog of it."""

from plenofir_tb.case import begin_case, load_cases

begin_case(load_cases()[0]["case"])

from csi.receiver_bench import *  # noqa: E402, F403
